"""A file appears whole or not at all, the folder tells nothing of a failure, and what is no file is not replaced by one."""

import ast
import contextlib
import gc
import os
import socket
import stat
import struct
import subprocess
import sys
import threading
import time
import zlib
from pathlib import Path

import numpy as np
import pytest

from viewcam_addon import npy
from viewcam_addon.errors import InputError
from viewcam_addon.files import check_writable, read_bytes, written_whole
from viewcam_addon.png import is_whole, strip

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such things in its folders")


def test_what_was_written_appears_under_its_name_alone(tmp_path):
    with written_whole(tmp_path / "new" / "file.txt") as temporary:
        temporary.write_text("whole")
        assert not (tmp_path / "new" / "file.txt").exists()
        assert temporary.suffix == ".txt"
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["file.txt"]
    assert (tmp_path / "new" / "file.txt").read_text() == "whole"


@pytest.mark.parametrize("failure", [KeyboardInterrupt, ValueError, MemoryError])
def test_a_failure_midway_leaves_the_older_file_and_nothing_else(tmp_path, failure):
    target = tmp_path / "file.txt"
    target.write_text("older")
    with pytest.raises(failure), written_whole(target) as temporary:
        temporary.write_text("half")
        raise failure
    assert [path.name for path in tmp_path.iterdir()] == ["file.txt"]
    assert target.read_text() == "older"


def test_a_folder_that_can_not_be_written_is_named_in_one_sentence(tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(InputError, match="can't be written") as caught, written_whole(tmp_path / "file" / "below.txt"):
        pass
    assert "below.txt" in str(caught.value) and "\n" not in str(caught.value)


def test_the_name_of_a_folder_is_no_name_of_a_file(tmp_path):
    with pytest.raises(InputError, match="is a folder"), written_whole(tmp_path):
        pass


def test_a_block_that_wrote_nothing_is_an_error(tmp_path):
    with pytest.raises(InputError, match=r"file\.txt can't be written"), written_whole(tmp_path / "file.txt"):
        pass
    assert not list(tmp_path.iterdir())


def test_a_symbolic_link_stays_and_what_it_leads_to_is_replaced(tmp_path, symlink):
    (tmp_path / "elsewhere").mkdir()
    file, link = tmp_path / "elsewhere" / "file.txt", tmp_path / "link.txt"
    file.write_text("older")
    symlink(link, file)
    with written_whole(link) as temporary:
        temporary.write_text("whole")
        assert temporary.parent == file.parent and file.read_text() == "older"
    assert link.is_symlink() and file.read_text() == "whole"
    assert [path.name for path in file.parent.iterdir()] == ["file.txt"]


def test_a_link_that_leads_nowhere_yet_leads_to_the_file_then(tmp_path, symlink):
    link = tmp_path / "link.txt"
    symlink(link, tmp_path / "file.txt")
    with written_whole(link) as temporary:
        temporary.write_text("whole")
    assert link.is_symlink() and (tmp_path / "file.txt").read_text() == "whole"


def test_a_link_to_itself_is_refused_in_one_sentence(tmp_path, symlink):
    symlink(tmp_path / "link.txt", "link.txt")
    with pytest.raises(InputError, match=r"link\.txt can't be written"), written_whole(tmp_path / "link.txt"):
        raise AssertionError("nothing is to be made for it")
    assert (tmp_path / "link.txt").is_symlink()


@posix
def test_a_pipe_stays_and_its_reader_has_all_of_it(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    read = []
    reader = threading.Thread(target=lambda: read.append((tmp_path / "pipe").read_bytes()), daemon=True)
    reader.start()
    content = bytes(range(256)) * 4096  # sixteen times what a pipe holds
    with _when_it_is_read(tmp_path / "pipe"), written_whole(tmp_path / "pipe") as temporary:
        temporary.write_bytes(content)
    reader.join(30)
    assert read == [content] and stat.S_ISFIFO(os.stat(tmp_path / "pipe").st_mode)
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


@posix
def test_a_pipe_that_nobody_reads_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe that nobody reads"), written_whole(tmp_path / "pipe") as temporary:
        temporary.write_bytes(b"whole")
    assert stat.S_ISFIFO(os.stat(tmp_path / "pipe").st_mode)


@posix
def test_a_device_is_written_to_and_stays_one(tmp_path):
    """Before, root's --json /dev/null left a file there. A terminal of our own is a device that tells what it was given."""
    ours, its = os.openpty()
    device = Path(os.ttyname(its))
    try:
        with written_whole(device) as temporary:
            temporary.write_text("whole\n")
        assert os.read(ours, 100).strip() == b"whole"
        assert stat.S_ISCHR(device.stat().st_mode)
    finally:
        os.close(ours)
        os.close(its)
    with written_whole("/dev/null") as temporary:
        temporary.write_text("gone")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


@posix
def test_standard_output_by_its_name_is_written_to_behind_what_is_printed_already(tmp_path):
    program = "import viewcam_addon.files as files; print('printed')\nwith files.written_whole('/dev/stdout') as path:\n"
    program += " path.write_text('whole\\n')\nprint('more')"
    for way in ("pipe", "file"):
        with open(tmp_path / "out.txt", "w") as out:
            child = subprocess.run(
                [sys.executable, "-c", program], stdout=subprocess.PIPE if way == "pipe" else out, check=True
            )
        output = child.stdout.decode() if way == "pipe" else (tmp_path / "out.txt").read_text()
        assert output == "printed\nwhole\nmore\n", way


@posix
def test_what_is_no_file_is_not_read_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero", tmp_path, tmp_path / "none"):
        with pytest.raises(OSError, match=r"no file|directory|No such"):
            read_bytes(path)
    (tmp_path / "link").symlink_to(__file__)
    assert read_bytes(tmp_path / "link") == Path(__file__).read_bytes()


@posix
def test_a_socket_is_refused_and_stays(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the names of sockets are short
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        with pytest.raises(InputError, match="is a socket"), written_whole("socket"):
            raise AssertionError("nothing is to be made for it")
    assert stat.S_ISSOCK(os.stat("socket").st_mode)


@pytest.mark.parametrize("kind", ["folder", "file as folder", "long name", "disk"])
def test_what_can_not_be_written_is_known_before_there_is_anything_to_write(tmp_path, kind, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    target = {
        "folder": tmp_path,
        "file as folder": tmp_path / "file" / "out.exr",
        "long name": tmp_path / f"{'a' * 300}.exr",
        "disk": tmp_path / "disk",
    }[kind]
    if kind == "disk":  # to make a real one takes root
        disk = os.stat_result((stat.S_IFBLK | 0o660, *os.stat(tmp_path)[1:]))
        real = os.stat
        monkeypatch.setattr(os, "stat", lambda path, **options: disk if Path(path) == target else real(path, **options))
    with pytest.raises(InputError, match=r"is a folder|can't be written|is a disk"):
        check_writable(target)


def test_a_drive_that_is_not_there_is_named(monkeypatch):
    """Every path of Linux and macOS lies in a folder that is there; one of Windows may name a missing drive or share."""
    missing = r"Q:\out.exr" if sys.platform == "win32" else "/out.exr"
    if sys.platform != "win32":
        monkeypatch.setattr(os.path, "lexists", lambda path: False)
    with pytest.raises(InputError, match="which is not there: choose another"):
        check_writable(missing)


@pytest.mark.parametrize("name", ["nul\0nul.exr", pytest.param("a" * 40_000, id="40,000 letters")])
def test_what_can_be_no_name_of_a_file_is_refused_in_one_sentence(tmp_path, name):
    for write in (check_writable, lambda path: written_whole(path).__enter__()):
        with pytest.raises(InputError, match=r"is no name that a file can have|can't be written"):
            write(tmp_path / name)


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_an_archive_of_arrays_has_the_bytes_of_numpys(tmp_path, save):
    arrays = {"a": np.arange(5000.0).reshape(50, 100), "b": np.zeros((0, 3), np.int32), "c": np.array(True)}
    save(tmp_path / "numpys.npz", **arrays)
    npy.write_archive(tmp_path / "ours.npz", arrays, is_compressed=save is np.savez_compressed)
    assert (tmp_path / "ours.npz").read_bytes() == (tmp_path / "numpys.npz").read_bytes()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_an_archive_that_meets_a_full_disk_prints_nothing(monkeypatch):
    """Python's ZipFile tries once more as it is let go, and prints a traceback of that."""
    printed = []
    monkeypatch.setattr(sys, "unraisablehook", printed.append)
    with pytest.raises(OSError, match="No space left"):
        npy.write_archive(Path("/dev/full"), {"a": np.zeros(100_000)})
    gc.collect()
    assert printed == []


def test_texts_have_the_same_bytes_on_every_system():
    """Lines that Python writes without newline= end otherwise on Windows."""
    package = Path(__file__).resolve().parent.parent / "viewcam_addon"
    for path in package.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "write_text":
                assert any(keyword.arg == "newline" for keyword in node.keywords), f"{path}:{node.lineno}"


def test_to_look_whether_a_file_can_be_written_leaves_nothing(tmp_path):
    (tmp_path / "older.txt").write_text("older")
    check_writable(tmp_path / "older.txt")
    check_writable(tmp_path / "new" / "folder" / "file.txt")
    check_writable(os.devnull)
    assert [path.name for path in tmp_path.iterdir()] == ["older.txt"] and (tmp_path / "older.txt").read_text() == "older"


@contextlib.contextmanager
def _when_it_is_read(pipe):
    """Begins when somebody has opened the pipe, and holds it open on the way."""
    ends, handle = time.monotonic() + 30, None
    while handle is None:
        try:
            handle = os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError:
            assert time.monotonic() < ends, "nobody reads"
            time.sleep(0.01)
    try:
        yield
    finally:
        os.close(handle)


HELD = """
import os, signal, sys
from viewcam_addon.files import temporary_folder

with temporary_folder() as folder:
    (folder / "scene.npz").write_bytes(b"large")
    os.utime(folder, (0, 0))  # as if it were old
    print(folder, flush=True)
    if sys.argv[1] == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    sys.stdin.read()
"""


@posix
def test_what_killed_processes_left_among_the_temporary_files_goes_and_what_others_hold_stays(tmp_path):
    """kill -9 left exported scenes there for ever."""
    environment = os.environ | {"TMPDIR": str(tmp_path), "PYTHONPATH": str(Path(__file__).parents[1])}

    def held(end):
        command = [sys.executable, "-c", HELD, end]
        process = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        return process, Path(process.stdout.readline().strip())

    killed, left = held("killed")
    killed.communicate()
    assert killed.returncode == -9 and (left / "scene.npz").exists(), "the test wants something that is left"
    young, link = (left.with_name(f"{left.name}{what}") for what in ("young", "link"))
    others = [tmp_path / name for name in ("viewcam-another_machine-1", "viewcam", "else")]
    for folder in (young, *others):
        folder.mkdir()
    for other in others:
        os.utime(other, (0, 0))
    link.symlink_to(others[-1])
    alive, kept = held("alive")
    assert not left.exists() and kept.exists()
    second, also = held("alive")
    assert (kept / "scene.npz").exists() and also.exists(), "a folder of a process that lives was removed"
    for process in (alive, second):
        process.communicate("")
        assert process.returncode == 0
    assert {*tmp_path.iterdir()} == {young, link, *others}


# --- A PNG that Blender wrote is whole or is seen not to be; its texts can be taken out, and nothing else


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


HEADER = chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0))
PIXELS = chunk(b"IDAT", zlib.compress(b"\0\1\2\3"))
END = chunk(b"IEND", b"")
TEXTS = [chunk(b"tEXt", b"Date\x00yesterday"), chunk(b"tIME", bytes(7)), chunk(b"iTXt", b"RenderTime"), chunk(b"zTXt", b"File")]


@pytest.fixture
def png(tmp_path):
    """A function: chunks → the path of a PNG of them."""

    def write(*chunks):
        path = tmp_path / "picture.png"
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))
        return path

    return write


def test_texts_and_times_are_taken_out_and_all_else_stays(png):
    expected = png(HEADER, PIXELS, END).read_bytes()
    path = png(TEXTS[0], HEADER, TEXTS[1], PIXELS, *TEXTS[2:], END)
    strip(path)
    assert path.read_bytes() == expected


def test_a_whole_file_is_whole_and_any_part_of_it_is_not(png):
    path = png(HEADER, TEXTS[0], PIXELS, END)
    content = path.read_bytes()
    assert is_whole(path)
    for length in range(len(content)):
        path.write_bytes(content[:length])
        assert not is_whole(path), f"{length} of {len(content)} bytes"


def test_what_is_no_png_is_not_whole(png, tmp_path):
    path = png(HEADER, END)
    path.write_bytes(b"GIF89a.." + path.read_bytes()[8:])
    assert not is_whole(path) and not is_whole(tmp_path / "missing.png")
