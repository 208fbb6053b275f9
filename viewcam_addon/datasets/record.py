"""What the sidecar of a picture says of its camera. The format: cameras/sidecar.py."""

from ..cameras.sidecar import CONVENTION, record

__all__ = ["CONVENTION", "record"]
