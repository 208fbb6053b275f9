"""What rays meet: geometry in camera space, first hits, shadows, and what is known of the points that they meet."""
