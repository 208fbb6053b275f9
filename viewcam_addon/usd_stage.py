"""The cameras of a USD stage, read by OpenUSD (`pxr`) in a process of its own, with bounds on time, memory and files.

OpenUSD was not written for hostile files: some crash it, a few references to references make it compose for hours, and a stage
opens whatever it names. So it never runs in this process, where a crash would be Blender's. In its own it has `_SECONDS` and
`_MEMORY` beyond what it needs to start, and more for a file that is long; and it opens no file by itself: each layer is read
into memory here, after a look at where it lies, and every arc of it is led to a layer in memory or taken out.

Of files there are those of the stage's own folder and of the folders in it, by relative paths. What else a stage names is left
out and told: absolute paths, paths that leave the folder, packages within packages, value clips, and what is no file.

Rejected: OpenUSD's resolver, which can't be exchanged from Python; a sandbox of the system, which Linux alone has.
"""

import contextlib
import importlib.util
import math
import os
import stat
import sys
import time
import zipfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from . import child_process
from .errors import InputError
from .files import temporary_folder

_SECONDS = 2
"""The seconds of computing, and one more for each `_BYTES_A_SECOND` of the file."""

_BYTES_A_SECOND = 4 * 2**20
_WALL = 10
"""Times as many seconds may pass meanwhile on a busy machine."""

_MEMORY = 640 * 2**20
"""Bytes, and `_TIMES` as many as the file has."""

_TIMES = 8
_MOST_LAYERS = 1_000
_MOST_SAMPLES = 100_000
_SUFFIXES = (".usd", ".usda", ".usdc")
_MODELS = ("cameraProjectionType", "omni:lensdistortion:model")  # Omniverse's, of other lenses
_LENS = (
    *("Projection", "FocalLength", "HorizontalAperture", "VerticalAperture", "HorizontalApertureOffset"),
    *("VerticalApertureOffset", "FStop"),
)
_PICTURE = {"resolution": None, "pixelAspectRatio": 1.0, "aspectRatioConformPolicy": "expandAperture"}
"""The attributes of UsdRender's settings and products that decide a picture's shape, with their usual values."""

_TOO_MUCH = "OpenUSD needed more time or memory for it than its size accounts for: export the cameras alone, without references"


def read(name: str, path: Path | None, text: str, size: str, values: str) -> dict[str, Any]:
    """The cameras of the stage of a file, or of a text if `path` is None.

    name : its name in sentences.
    size : the attribute of a camera that has the pixels of its picture.
    values : the key of its customData that is wanted.

    It has y_up; meters_per_unit; documentation of the root layer; values (of all prims, texts); left_out (what is not read, as
    it stands in the file); cameras: each a name, a path, renders (the values of _PICTURE for each shape that the stage renders
    it in) and an error, or samples: each with the time, seconds (None if there is one alone), size, matrix (16, for row
    vectors) and the attributes of the lens by their names.

    Raises InputError if OpenUSD is not here, can't open it, or needs more than the bounds.
    """
    if importlib.util.find_spec("pxr") is None:
        raise InputError(
            "USD is read by OpenUSD (the module pxr), which this Python has not: pip install usd-core, or export another format"
        )
    length = path.stat().st_size if path else len(text)
    seconds = _SECONDS + length / _BYTES_A_SECOND
    variables = child_process.environment(apart_from=child_process.blender_scripts(), PXR_WORK_THREAD_LIMIT="1")
    with (
        temporary_folder() as folder,
        child_process.ServerProcess("OpenUSD", child_process.module("usd_stage"), variables) as server,
    ):
        request: dict[str, Any] = {"size": size, "values": values, "seconds": seconds, "memory": _MEMORY + _TIMES * length}
        request |= {"path": str(path.absolute()), "unpacked": str(folder)} if path else {"text": text}
        try:
            server.ask({"start": True})
            result: dict[str, Any] = server.ask(request, ends=time.monotonic() + _WALL * seconds)
        except (child_process.ProcessEnded, child_process.AnswerTimeout):
            raise InputError(f"{name} is no stage that can be read safely, since {_TOO_MUCH}") from None
        except InputError as error:
            raise InputError(f"{name} is no stage that USD can open ({error}): export it again") from None
    return result


# ---- in the process of its own


def _answer(request: dict[str, Any]) -> dict[str, Any] | None:
    """Whatever goes wrong is the file's fault."""
    try:
        from pxr import Sdf

        if "start" in request:
            Sdf.Layer.CreateAnonymous(".usda").ImportFromString("#usda 1.0\n")  # loaded by OpenUSD when it is first used
            return None
        _bound(request["seconds"], request["memory"])
        return _read(request)
    except InputError:
        raise
    except Exception as error:
        raise InputError(_reason(error)) from None


def _bound(seconds: float, memory: int) -> None:
    """End this process once it has computed for so many seconds from now on, and give it so many bytes more than it has."""
    if sys.platform == "win32":
        return  # whoever asks ends it in time
    import resource

    with contextlib.suppress(ValueError, OSError):
        spent = time.process_time() + seconds
        resource.setrlimit(resource.RLIMIT_CPU, (int(spent) + 1, resource.RLIM_INFINITY))
        statistics = Path("/proc/self/statm")
        if statistics.exists():  # no other system keeps to such a limit
            pages = int(statistics.read_text().split()[0])
            resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + memory, resource.RLIM_INFINITY))


def _read(request: dict[str, Any]) -> dict[str, Any]:
    from pxr import Sdf, Usd, UsdGeom

    layers = _Layers(Sdf)
    if "text" in request:
        root = layers.of_text(request["text"])
    else:
        path = Path(request["path"])
        if zipfile.is_zipfile(path):
            path = _unpacked(path, Path(request["unpacked"]))
        root = layers.of_file(path)
    stage = Usd.Stage.Open(root)
    result: dict[str, Any] = {
        "y_up": UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y,
        "meters_per_unit": UsdGeom.GetStageMetersPerUnit(stage),
        "documentation": _text(lambda: root.documentation),
        "cameras": [],
        "values": [],
        "left_out": layers.left_out,
    }
    samples = 0
    renders = _Renders()
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if value := _text(partial(prim.GetCustomDataByKey, request["values"])):
            result["values"].append(value)
        if prim.GetTypeName() in ("RenderSettings", "RenderProduct"):
            renders.add(prim)
        if not prim.IsA(UsdGeom.Camera):
            continue
        camera: dict[str, Any] = {"name": _text(prim.GetDisplayName) or _text(prim.GetName) or "camera"}
        camera["path"] = str(prim.GetPath())
        result["cameras"].append(camera)
        try:
            camera["samples"] = _samples(prim, stage, request["size"], Usd, UsdGeom)
        except Exception as error:
            camera["error"] = _reason(error)
        samples += len(camera.get("samples", "1"))
        if samples > _MOST_SAMPLES:
            raise InputError(f"its cameras have more than {_MOST_SAMPLES} time samples")
    by_camera = renders.by_camera()
    for camera in result["cameras"]:
        camera["renders"] = by_camera.get(camera["path"], [])
    return result


class _Renders:
    """The pictures that a stage renders, by UsdRender's rule: of what a product does not say, the settings that list it do."""

    def __init__(self) -> None:
        self._stated: dict[str, tuple[dict[str, Any], list[str]]] = {}  # by path: attributes, and cameras
        self._products: dict[str, list[str]] = {}  # paths, by their settings

    def add(self, prim: Any) -> None:
        attributes = {key: prim.GetAttribute(key) for key in _PICTURE if prim.HasAttribute(key)}
        values = {key: _plain(each.Get()) for key, each in attributes.items() if each.HasAuthoredValue()}
        path = str(prim.GetPath())
        self._stated[path] = values, self._targets(prim, "camera")
        if prim.GetTypeName() == "RenderSettings":
            self._products[path] = self._targets(prim, "products")

    @staticmethod
    def _targets(prim: Any, name: str) -> list[str]:
        return [*map(str, prim.GetRelationship(name).GetForwardedTargets())] if prim.HasRelationship(name) else []

    def by_camera(self) -> dict[str, list[dict[str, Any]]]:
        """The different pictures of each camera whose resolution is said."""
        of_settings = {product: path for path, products in self._products.items() for product in products}
        result: dict[str, list[dict[str, Any]]] = {}
        for path, (values, cameras) in self._stated.items():
            if any(product in self._stated for product in self._products.get(path, ())):
                continue
            shared, usual = self._stated.get(of_settings.get(path, ""), ({}, []))
            picture = _PICTURE | shared | values
            for camera in cameras or usual:
                if picture["resolution"] is not None and picture not in result.setdefault(camera, []):
                    result[camera].append(picture)
        return result


class _Layers:
    """Layers in memory, each with all that it is composed of; what may not be read is taken out of them.

    left_out : the things that were taken out, as they stand in the file.
    """

    def __init__(self, sdf: Any) -> None:
        self.left_out: list[str] = []
        self._sdf, self._by_path = sdf, dict[str, Any]()
        self._folder = ""

    def of_text(self, text: str) -> Any:
        layer = self._sdf.Layer.CreateAnonymous(".usda")
        if not layer.ImportFromString(text):
            raise InputError("its text is not understood")
        self._close(layer, None)
        return layer

    def of_file(self, path: Path) -> Any:
        self._folder = os.path.realpath(path.parent)
        return self._opened(os.path.realpath(path))

    def _opened(self, path: str) -> Any:
        if path not in self._by_path:
            if len(self._by_path) >= _MOST_LAYERS:
                raise InputError(f"it is made of more than {_MOST_LAYERS} layers")
            layer = self._by_path[path] = self._sdf.Layer.OpenAsAnonymous(path)
            if layer is None:
                raise InputError("it is no layer")
            self._close(layer, os.path.dirname(path))
        return self._by_path[path]

    def _close(self, layer: Any, folder: str | None) -> None:
        """Lead all that the layer is composed of to layers in memory.

        folder : the layer's folder; None if it is a text.
        """
        offsets = dict(zip(layer.subLayerPaths, [*layer.subLayerOffsets], strict=True))
        for named in filter(None, layer.GetCompositionAssetDependencies()):  # without a name: the layer itself
            place = self._allowed(named, folder)
            inner = None
            if place:
                with contextlib.suppress(Exception):  # no layer: left out, too
                    inner = self._opened(place)
            if inner is None:
                self.left_out.append(named)
            layer.UpdateCompositionAssetDependency(named, inner.identifier if inner else "")
            if inner is not None and named in offsets:  # which a new name sets back
                layer.subLayerOffsets[[*layer.subLayerPaths].index(inner.identifier)] = offsets[named]
        clipped = []

        def look(path: Any) -> None:
            spec = layer.GetPrimAtPath(path) if path.IsPrimPath() or path.IsPrimVariantSelectionPath() else None
            if spec and any(spec.HasInfo(key) for key in ("clips", "clipSets")):
                clipped.append(spec)

        layer.Traverse(self._sdf.Path.absoluteRootPath, look)
        for spec in clipped:
            for key in ("clips", "clipSets"):
                spec.ClearInfo(key)
            self.left_out.append(f"the value clips of {spec.path}")

    def _allowed(self, named: str, folder: str | None) -> str | None:
        """The file that is meant, if it may be read."""
        if folder is None or os.path.isabs(named) or Path(named).suffix.lower() not in _SUFFIXES:
            return None
        path = os.path.realpath(os.path.join(folder, named))
        with contextlib.suppress(OSError, ValueError):
            if os.path.commonpath([path, self._folder]) == self._folder and stat.S_ISREG(os.stat(path).st_mode):
                return path
        return None


def _unpacked(path: Path, folder: Path) -> Path:
    """The root layer of a package, which is its first file, beside all other layers of it in a folder."""
    most = path.stat().st_size
    with zipfile.ZipFile(path) as archive:
        layers = [each for each in archive.infolist() if Path(each.filename).suffix.lower() in _SUFFIXES]
        if not layers or len(layers) > _MOST_LAYERS:
            raise InputError("a package has a layer as its first file")
        for entry in layers:
            if entry.compress_type != zipfile.ZIP_STORED or entry.file_size > most:
                raise InputError("a package's files are not compressed")
            archive.extract(entry, folder)  # which keeps it inside
        return folder / layers[0].filename


def _samples(prim: Any, stage: Any, size: str, usd: Any, usd_geom: Any) -> list[dict[str, Any]]:
    camera = usd_geom.Camera(prim)
    attributes = [*_attributes(prim, camera, usd_geom)]
    times = sorted({time for attribute in attributes for time in _times(attribute)}) or [0.0]
    is_moving = len(times) > 1
    result = []
    for moment in times[:_MOST_SAMPLES]:
        code = usd.TimeCode(moment) if is_moving or moment else usd.TimeCode.EarliestTime()
        sample = {name: _plain(getattr(camera, f"Get{name}Attr")().Get(code)) for name in _LENS}
        sample["matrix"] = [number for row in camera.ComputeLocalToWorldTransform(code) for number in row]
        sample["model"] = next(
            filter(None, (_plain(prim.GetAttribute(name).Get()) for name in _MODELS if prim.HasAttribute(name))), None
        )
        sample["size"] = _plain(prim.GetAttribute(size).Get()) if prim.HasAttribute(size) else None
        sample |= {"time": moment if is_moving else None, "seconds": None}
        if is_moving:
            sample["seconds"] = moment / (stage.GetTimeCodesPerSecond() or 24.0)
        result.append(sample)
    return result


def _attributes(prim: Any, camera: Any, usd_geom: Any) -> Iterator[Any]:
    """The attributes on which the picture depends: the camera's own, and the transforms of all above it that move it."""
    for name in _LENS[1:-1]:
        yield getattr(camera, f"Get{name}Attr")()
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(usd_geom.Xformable):
            for operation in usd_geom.Xformable(prim).GetOrderedXformOps():
                yield operation.GetAttr()
            if usd_geom.Xformable(prim).GetResetXformStack():
                return
        prim = prim.GetParent()


def _times(attribute: Any) -> Sequence[float]:
    """The times at which an attribute has a sample; of a spline, its knots and all frames between them."""
    if not (hasattr(attribute, "HasSpline") and attribute.HasSpline()):
        return attribute.GetTimeSamples()[:_MOST_SAMPLES]
    knots = [*attribute.GetSpline().GetKnots()][:_MOST_SAMPLES]
    frames = range(math.ceil(min(knots, default=0.0)), math.ceil(max(knots, default=0.0)))
    return [*knots, *frames[:_MOST_SAMPLES]]


def _plain(value: Any) -> Any:
    """The value as JSON has it."""
    if value is None or isinstance(value, str | int | float):
        return value
    try:
        return [float(each) if isinstance(each, float) else int(each) for each in value]
    except (TypeError, ValueError):
        return str(value)[:100]


def _text(read: Callable[[], Any]) -> str:
    """A text of the file, which may be none in any encoding."""
    try:
        value = read()
    except Exception:
        return ""
    return value if isinstance(value, str) else ""


def _reason(error: Exception) -> str:
    """The first thing that OpenUSD says of an error, without where in its own code that is."""
    words = _text(lambda: " ".join(str(error).split()))  # which may quote the file
    return words.rpartition(" : ")[2].strip("'")[:120] or "OpenUSD gives no reason that is a text"


if __name__ == "__main__":
    child_process.serve(sys.argv[-1], lambda request, _: _answer(request))
