"""Export and Cycles in the Blender that VIEWCAM_BLENDER names: the same words, and its status."""

import shlex
import sys

import pytest

from viewcam_addon.cli import main


@pytest.fixture
def named(tmp_path, monkeypatch):
    """A function that names a program, which writes its words down and ends with this status."""
    if sys.platform == "win32":
        pytest.skip("a script of the shell stands in for Blender")

    def name(status):
        program = tmp_path / "blender"
        program.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > {shlex.quote(str(tmp_path / "words.txt"))}\nexit {status}\n')
        program.chmod(0o755)
        monkeypatch.setenv("VIEWCAM_BLENDER", str(program))
        return lambda: (tmp_path / "words.txt").read_text().splitlines()

    return name


@pytest.mark.parametrize("command", ["export", "cycles"])
@pytest.mark.parametrize("status", [0, 2, 3])
def test_the_named_blender_gets_the_file_and_the_other_words_and_its_status_is_ours(named, tmp_path, command, status):
    words, out = named(status), str(tmp_path / "out")
    assert main([command, "./shot one.blend", out, "--level", "path", "--samples", "8"]) == status
    after = ["--command", "viewcam", command, out, "--level", "path", "--samples", "8"]
    assert words() == ["-b", "--disable-autoexec", "shot one.blend", *after]


def test_a_trusted_file_is_opened_with_its_scripts(named, tmp_path):
    words = named(0)
    assert main(["export", "a.blend", str(tmp_path / "out"), "--trust"]) == 0
    assert words()[:2] == ["-b", "--enable-autoexec"] and words()[-1] == "--trust"


def test_a_blender_without_the_extension_or_none_at_all_is_one_sentence(named, tmp_path, monkeypatch, capfd):
    named(1)
    assert main(["export", "a.blend", str(tmp_path / "out")]) == 2
    assert "with the extension Virtual Pinhole" in capfd.readouterr().err
    monkeypatch.setenv("VIEWCAM_BLENDER", str(tmp_path / "none"))
    assert main(["cycles", "a.blend", str(tmp_path / "out")]) == 2
    assert "can't be started" in capfd.readouterr().err
