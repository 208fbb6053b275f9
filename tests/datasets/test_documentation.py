"""docs/datasets.md: its program runs, and writes what the page shows."""

import json
import re
from pathlib import Path

import pytest

from viewcam_addon.cameras import axes
from viewcam_addon.cameras import sidecar as record
from viewcam_addon.pinhole import Pinhole

PAGE = Path(__file__).parents[2] / "docs" / "datasets.md"
BLOCK = re.compile(r"```(\w+)\n(.*?)```", re.S)


@pytest.fixture(scope="module")
def blocks():
    """Language → what stands in each block of it."""
    found = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    return {language: [text for other, text in found if other == language] for language, _ in found}


@pytest.fixture(scope="module")
def batch(blocks, tmp_path_factory):
    """The folder in which the page's program ran."""
    folder = tmp_path_factory.mktemp("batch")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        program, _ = blocks["python"]  # the other one is Blender's
        exec(compile(program, str(PAGE), "exec"), {})
    return folder


def written(batch):
    return {str(path.relative_to(batch)): path.read_text(encoding="utf-8") for path in batch.rglob("*.*") if path.is_file()}


def test_the_program_writes_what_the_page_shows(blocks, batch):
    files = written(batch)
    assert files.keys() == {"transforms.json", *(f"sparse/0/{name}.txt" for name in ("cameras", "images", "points3D"))}
    transforms, sidecar = blocks["json"]
    assert transforms == files["transforms.json"]
    assert blocks["text"] == [files["sparse/0/cameras.txt"], files["sparse/0/images.txt"]]
    shown = json.loads(sidecar)
    pinhole = Pinhole(**shown["camera"])
    assert shown | {"convention": record.CONVENTION} == json.loads(json.dumps(record.record(pinhole)))
    assert pinhole.eye == (0, -5, 0) and shown["worldToCamera"] == axes.world_to_camera(pinhole)


def test_what_the_page_shows_the_readers_read(readers, batch):
    """Both cameras look at the origin, which is at their principal points."""
    files = written(batch)
    for projections in (
        readers["transforms"](files["transforms.json"]),
        readers["colmap"]({name.removeprefix("sparse/0/"): text for name, text in files.items()}),
    ):
        assert projections.keys() == {"images/front.png", "images/above.png"}
        for projection in projections.values():
            assert projection([[0.0, 0.0, 0.0]]).tolist() == [[320, 180]]
