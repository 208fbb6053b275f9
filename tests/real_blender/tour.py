"""The tour through all that an artist does with a camera, in order. Each file has the steps of one subject."""

import tour_moves
import tour_values

STEPS = [*tour_values.STEPS, *tour_moves.STEPS]
