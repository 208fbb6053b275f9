"""Ground truth of a scene's picture, from exact hits at the pixels' centers.

surfaces.py: which instance, primitive and point each pixel shows, and what follows from that; masks.py: run lengths and boxes;
coverage.py: shares of pixels; scene_labels.py: all labels of one frame, and motion to another; files.py: how they are written;
surface_points.py: which pictures see a point; coco.py, yolo.py, bop.py, colmap.py, kitti.py, stereo.py, tracks.py: those of
many pictures as a dataset.

A label is what lies at the center of its pixel: nothing but coverage is averaged over a pixel, and two labels of one pixel are
of the same point. Rejected: labels made of the passes that a renderer writes (float32, indices shared by instances, no
occlusion).
"""

from collections.abc import Collection

from ..image import COVERAGE_PASSES

PASSES = {
    "depth": ("Depth", "Distance"),
    "normals": ("Normal", "Camera Normal"),
    "position": ("Position", "Object Position"),
    "masks": ("Instance", "Material Index"),
    "amodal": (),
    "flow": tuple(f"{way} {what}" for way in ("Forward", "Backward") for what in ("Flow", "Motion", "Hidden")),
    "coverage": COVERAGE_PASSES[:1],
}
"""The labels, and the passes of each: of flow those of a direction that has another frame; of coverage the first of them."""

KINDS = tuple(PASSES)

DEPTH_STEPS = 1000.0
"""The steps of a 16-bit depth in a scene unit: millimeters, where the unit is a meter."""

FILES = {
    "depth.png": "Depth",
    "instances.png": "Instance",
    "mask.png": "Instance",
    "forward.flo": "Forward Flow",
    "forward_hidden.png": "Forward Hidden",
    "backward.flo": "Backward Flow",
    "backward_hidden.png": "Backward Hidden",
}
"""Beside the EXR and the JSON, and the pass that each shows."""


def endings(passes: Collection[str]) -> list[str]:
    """The endings of the files that are written of labels with these passes, in order."""
    return [*["labels.exr"][: len(passes)], *(each for each, name in FILES.items() if name in passes), "labels.json"]
