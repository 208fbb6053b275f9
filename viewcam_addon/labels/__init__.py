"""Ground truth of a scene's picture, from exact hits at the pixels' centres.

surfaces.py: which instance, primitive and point each pixel shows, and what follows from that; motion.py: where those points
are in another frame; masks.py: run lengths and boxes; coverage.py: shares of pixels; scene_labels.py: all labels of one frame;
files.py: how they are written; coco.py, bop.py, colmap.py, kitti.py: those of many pictures as a dataset.

A label is what lies at the centre of its pixel: nothing but coverage is averaged over a pixel, and two labels of one pixel are
of the same point. Rejected: labels made of the passes that a renderer writes (float32, indices shared by instances, no
occlusion).
"""

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
