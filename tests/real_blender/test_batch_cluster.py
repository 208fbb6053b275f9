"""`blender -b FILE --command viewcam batch --workers 2`: each worker another Blender, the files those of one process."""

import re

WORDS = ("--orbit", "4", "--size", "96x54", "--samples", "2", "--engine", "CYCLES")


def run_batch(blender, folder, *words, python=()):
    return blender.run(
        "-b", *python, "sample_scenes/studio.blend", "--command", "viewcam", "batch", *WORDS, "--out", folder, *words
    )


def contents(folder):
    """Name → bytes without timings, of the shots' files and the contact sheet."""
    paths = [path for path in folder.iterdir() if path.suffix in (".exr", ".png", ".json", ".html")]
    bare = {path.name: re.sub(rb'"timing": \{[^}]*\}', b"", path.read_bytes()) for path in paths}
    return {name: data for name, data in bare.items() if name != "summary.json"}


def test_two_blenders_write_the_bytes_of_one(real_blender, packages, tmp_path, monkeypatch):
    alone = run_batch(real_blender, tmp_path / "one")
    assert alone.returncode == 0, alone.stdout + alone.stderr
    monkeypatch.setenv("PYTHONPATH", str(packages))
    both = run_batch(real_blender, tmp_path / "two", "--workers", "2", python=["--python-use-system-env"])
    assert both.returncode == 0, both.stdout + both.stderr
    assert len(contents(tmp_path / "one")) == 4 * 3 + 1
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    words = both.stdout + both.stderr
    assert not re.search("distributed|tornado|nanny|worker|traceback", words, re.IGNORECASE), words


def test_a_blender_without_dask_says_what_to_install_and_renders_nothing(real_blender, tmp_path):
    outcome = run_batch(real_blender, tmp_path / "out", "--workers", "2")
    assert outcome.returncode == 2
    assert re.search(
        r"viewcam batch: several workers need Dask, which is not here: \S+ -m pip install distributed", outcome.stderr
    )
    assert not list(tmp_path.glob("out/*.exr"))
