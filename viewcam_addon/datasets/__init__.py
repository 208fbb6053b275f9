"""The cameras of pictures of one's own as a dataset, in Python: views, and what is written of them.

    transforms.py   transforms.json, as NeRF, instant-ngp and nerfstudio read it
    colmap.py       cameras.txt, images.txt and points3D.txt of COLMAP
    record          what a picture's sidecar says of its camera (cameras/sidecar.py)

The formats themselves are those of cameras/; here are their names in scripts. World space stays as it is: no format here
scales, centres or turns it.
"""

from dataclasses import dataclass

from ..cameras import sidecar as record
from ..cameras.camera import Camera
from ..cameras.naming import check_image
from ..pinhole import Pinhole

__all__ = ["View", "record"]


@dataclass(frozen=True)
class View:
    """A picture and the camera that took it.

    file : the picture's path inside the folder of the batch, "/" between folders, suffix included. Dataset files name pictures
        by it, so they belong in that folder, or it is what their reader takes for the folder of images.

    Raises
    ------
    InputError
        if the file is no such path.
    """

    file: str
    pinhole: Pinhole

    def __post_init__(self) -> None:
        check_image(self.file)

    @property
    def camera(self) -> Camera:
        """The same as what cameras/ reads and writes."""
        return Camera(self.file, self.pinhole, image=self.file)
