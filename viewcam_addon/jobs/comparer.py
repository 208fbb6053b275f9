"""The comparer of a batch's shots: is what Cycles renders through a camera what the camera's numbers say?

A process of its own, kept open: it reads Cycles' passes of geometry, traces the same scene with the camera of the sidecar, and
compares the two as `viewcam compare` does. Scene and tracer are kept from shot to shot, so that a shot costs its own pixels
only. It is no part of Blender's process, where there must be no second copy of OpenEXR. Rejected: `viewcam render` and
`viewcam compare` for each shot, two processes and a scene to read and build each time.

    python -m viewcam_addon.jobs.comparer HANDLE
"""

import dataclasses
import importlib.util
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from .. import checks, child_process
from ..errors import InputError
from ..pinhole import Pinhole

if TYPE_CHECKING:
    from ..comparison.geometry import GeometryComparison


def lacking() -> str | None:
    """What a check or a label needs and does not find here, as a sentence; its search path is ours."""
    if importlib.util.find_spec("OpenEXR") is None:
        return "checks and labels need OpenEXR: install the extension from its zip, or pip install OpenEXR"
    return None


class TracingServer(child_process.ServerOnDemand):
    """A process of ours that traces, as the one who asks has it."""

    name: ClassVar[str]

    def __init__(self, threads: int | None = None) -> None:
        super().__init__(f"the {self.name}", f"jobs.{self.name}")
        self._threads = threads

    def ask(self, request: Mapping[str, Any]) -> Any:
        if sentence := lacking():
            raise InputError(sentence)
        return super().ask({**request, "threads": self._threads})


class Comparer(TracingServer):
    name = "comparer"

    def verdict(
        self,
        scene: Path,
        image: Path,
        camera: Pinhole,
        clip: tuple[float, float],
        stated: Pinhole | None = None,
        not_modelled: Sequence[str] = (),
        everything: Path | None = None,
    ) -> dict[str, Any]:
        """True if a picture shows what a camera sees.

        scene : a scene file; the same path is the same scene, and is not read again. image : Cycles' passes of geometry.
        camera : the camera that is said to have taken the picture, whatever the scene's is; clip : what it sees, as in Scene.
        stated : the four values that it was made from, if it was. not_modelled : names of objects that are not. everything :
        Cycles' passes with all of them, if there are any.

        Returns `passed`, `answer` (as comparison/answer.py has them), `verdict` (the sentence of `viewcam compare`),
        `not_modelled` (as in its JSON) and `figures`, the few of its figures that a sidecar keeps: `pixels` compared,
        `position` in pixels, `share_of_tolerance` of each pass where it is largest, `mismatches`, and `conversion`, the stated
        camera against this one, None where none is stated. None is what was not compared, too.

        Raises
        ------
        InputError
            if scene or picture can't be read or are not of the same size, there is no OpenEXR, or the process ended first.
        """
        request = {
            "scene": str(scene),
            "image": str(image),
            "camera": dataclasses.asdict(camera),
            "clip": list(clip),
            "stated": stated and dataclasses.asdict(stated),
            "not_modelled": list(not_modelled),
            "everything": everything and str(everything),
        }
        return self.ask(request)


class _Scenes:
    """What the process keeps from question to question."""

    def __init__(self) -> None:
        from ..tracer.render import Keeper

        self._keeper = Keeper()
        self._path, self._scene = "", None

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        from .. import image
        from ..comparison import geometry
        from ..comparison.everything import not_modelled
        from ..tracer.scene import scene_file

        if request["scene"] != self._path:
            self._scene, self._path = scene_file.read(request["scene"]), request["scene"]
        camera, stated = Pinhole(**request["camera"]), request["stated"] and Pinhole(**request["stated"])
        scene = dataclasses.replace(self._scene, camera=camera, clip=tuple(request["clip"]))
        test = image.read(request["image"])
        tracer = self._keeper.tracer(scene, request["threads"])
        reference = image.Image(tracer.render(), camera)
        comparison = geometry.compare(reference, test, camera, tracer.surface_at, stated, scene.origin)
        names, everything = request["not_modelled"], request["everything"]
        shown, whole = tracer.pixels_of(names), everything and image.read(everything)
        told = not_modelled(names, shown, reference, [test], whole)
        answer = dataclasses.replace(comparison, not_modelled=told).answer
        return {
            "passed": answer.passed,
            "answer": answer.answer,
            "verdict": answer.sentence,
            "not_modelled": answer.not_modelled.to_json(),
            "figures": _figures(comparison),
        }


def _figures(comparison: "GeometryComparison") -> dict[str, Any]:
    """What is kept of a comparison."""
    position = comparison.rows[0].to_json()
    return checks.for_json(
        {
            "pixels": position["count"],
            "position": {name: figure["value"] for name, figure in position["percentiles"].items()},
            "share_of_tolerance": {row.name: max(row.shares, default=None) for row in comparison.rows},
            "mismatches": {
                "count": len(comparison.mismatches.kinds),
                "unexplained": comparison.mismatches.unexplained_count,
                "allowed_unexplained": comparison.allowed_unexplained,
            },
            "conversion": comparison.conversion and comparison.conversion.to_json(),
        }
    )


if __name__ == "__main__":
    child_process.serve(sys.argv[1], _Scenes().answer)
