"""As many samples as a wanted error takes: rounds.py takes them, interior.py finds pixels that need but one, estimate.py tells
which need no more."""
