"""The tour through all that an artist does with a camera, in order. Each file has the steps of one subject."""

import tour_animation
import tour_files
import tour_moves
import tour_objects
import tour_targets
import tour_values
import tour_view

STEPS = [
    *tour_values.STEPS,
    *tour_targets.STEPS,
    *tour_moves.STEPS,
    *tour_view.STEPS,
    *tour_objects.STEPS,
    *tour_animation.STEPS,
    *tour_files.STEPS,
]
