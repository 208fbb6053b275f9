"""A batch's folder: when a shot counts as done, and what of a killed batch is swept away."""

import errno
import json
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.errors import FullDiskError, InputError
from viewcam_addon.files import written_whole
from viewcam_addon.jobs import dataset, locks
from viewcam_addon.jobs.folder import Folder, Outputs, write_json
from viewcam_addon.jobs.locks import Claims

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@pytest.fixture
def folder(tmp_path, painting):
    painting.paint(tmp_path, 2, check=True)
    return Folder(tmp_path)


def made_from(painting):
    return painting.hashes(painting.shots(2))["shot_000"]


def test_a_shot_that_was_rendered_is_finished(folder, painting):
    record = folder.finished("shot_000", made_from(painting), Outputs(check=True))
    assert record["image"] == "shot_000.exr" and record["check"]["passed"]
    assert record == json.loads(folder.sidecar("shot_000").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "harm",
    [
        lambda folder: folder.sidecar("shot_000").unlink(),
        lambda folder: folder.image("shot_000").unlink(),
        lambda folder: folder.preview("shot_000").unlink(),
        lambda folder: folder.image("shot_000").write_bytes(b"shorter"),
        lambda folder: folder.preview("shot_000").write_bytes(b""),
        lambda folder: folder.sidecar("shot_000").write_text(folder.sidecar("shot_000").read_text()[:-3]),
        lambda folder: folder.sidecar("shot_000").write_bytes(b"\xff"),
        lambda folder: folder.sidecar("shot_000").write_text("[" * 200_000),
        lambda folder: folder.sidecar("shot_000").write_text("[]"),
        lambda folder: folder.sidecar("shot_000").write_text("{}"),
    ],
    ids=["no sidecar", "no image", "no preview", "short image", "empty preview", "half", "no UTF-8", "deep", "list", "empty"],
)
def test_a_shot_that_is_not_whole_is_not_finished(folder, painting, harm):
    harm(folder)
    assert folder.finished("shot_000", made_from(painting)) is None
    other = painting.hashes(painting.shots(2))["shot_001"]
    assert folder.finished("shot_001", other), "the other shot is as it was"


@pytest.mark.parametrize("value", [None, {"a": 1}, [5], "gone"])
@pytest.mark.parametrize(
    "path", ["rendered", "rendered.width", "warnings", "timing", "timing.seconds", "check", "check.verdict"]
)
def test_a_sidecar_that_lacks_a_key_or_has_it_otherwise_is_not_finished(folder, painting, path, value):
    """Nor does it stop the summary and the contact sheet of all the others."""
    sidecar = folder.sidecar("shot_000")
    record = json.loads(sidecar.read_text(encoding="utf-8"))
    *outer, key = path.split(".")
    owner = record[outer[0]] if outer else record
    if value == "gone":
        del owner[key]
    else:
        owner[key] = value
    write_json(sidecar, record)
    assert folder.finished("shot_000", made_from(painting), Outputs(check=True)) is None


@pytest.mark.parametrize(
    "text", ["1e999", "-1e999", "NaN", "Infinity", '"\\ud800"', '{"\\udfff": 1}', "9" * 5000, "[" * 900 + "]" * 900]
)
@pytest.mark.parametrize("key", ["timing.seconds", "warnings", "camera", "other"])
def test_a_sidecar_of_what_no_summary_can_hold_is_rendered_again(tmp_path, painting, text, key):
    """Infinite numbers ended every later --resume in a bug."""
    painting.paint(tmp_path, 2)
    sidecar = tmp_path / "shot_000.json"
    whole = sidecar.read_bytes()
    record = json.loads(whole)
    outer, _, inner = key.partition(".")
    record[outer] = {**record[outer], inner: "@"} if inner else ["@"]
    sidecar.write_text(json.dumps(record).replace('"@"', text), encoding="utf-8")
    painter = painting.Painter()
    summary = painting.paint(tmp_path, 2, painter=painter, resume=True)
    assert summary.exit_status == 0 and painter.painted in ([], ["shot_000"])
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["counts"]["done"] == 2


@pytest.mark.parametrize(
    "name", ["summary.json", "contact-sheet.html", "shot_001.json", "shot_001.exr", "shot_001.png", "shot_001.labels.json"]
)
@pytest.mark.parametrize("options", [{}, {"resume": True}, {"overwrite": True}], ids=lambda options: next(iter(options), "new"))
def test_a_folder_where_a_file_belongs_is_refused_before_anything_is_rendered(tmp_path, painting, name, options):
    """A folder called summary.json was found when all was rendered."""
    (tmp_path / name).mkdir()
    painter = painting.Painter()
    with pytest.raises(InputError, match=rf"{name} is a folder, and a file is to be written there"):
        painting.paint(tmp_path, 3, painter=painter, labels=("depth",), **options)
    assert not painter.painted and (tmp_path / name).is_dir()


def test_what_is_no_business_of_the_batch_may_be_a_folder(tmp_path, painting):
    for name in ("sparse", "shot_009.exr", "shot_001.labels.json"):
        (tmp_path / name).mkdir()
    assert painting.paint(tmp_path, 2).exit_status == 0


@pytest.mark.parametrize("name", ["transforms.json", "sparse/0/images.txt"])
def test_a_folder_where_a_dataset_belongs_is_refused_before_anything_is_rendered(tmp_path, name):
    (tmp_path / name).mkdir(parents=True)
    with pytest.raises(InputError, match=rf"{name.rpartition('/')[2]} is a folder"):
        dataset.check_folder(Folder(tmp_path))


def test_a_shot_of_other_settings_is_not_finished(folder):
    assert folder.finished("shot_000", "0" * 64) is None


def test_a_shot_that_was_not_checked_is_finished_only_where_no_check_is_asked_for(tmp_path, painting):
    painting.paint(tmp_path, 2)
    folder = Folder(tmp_path)
    assert folder.finished("shot_000", made_from(painting))
    assert folder.finished("shot_000", made_from(painting), Outputs(check=True)) is None


@settings(max_examples=20)  # each waits for the disk
@given(st.dictionaries(st.text(), plain | st.lists(st.dictionaries(st.text(), plain))))
def test_a_document_is_read_as_it_was_written(tmp_path_factory, document):
    path = tmp_path_factory.getbasetemp() / "document.json"
    write_json(path, document)
    assert json.loads(path.read_text(encoding="utf-8")) == document


def test_a_document_has_a_key_a_line_and_an_object_a_line(tmp_path):
    write_json(tmp_path / "a.json", {"one": [1, 2], "two": [{"a": 1}, {"b": 2}]})
    assert (tmp_path / "a.json").read_bytes().count(b"\n") == 7


def test_leftovers_of_this_batch_are_removed_and_nothing_else(tmp_path):
    shots = ["a", "b.c", "a-0123abcd"]
    ours = [".a-0123abcd.exr", ".a-01234567.png", ".a-89abcdef.json", ".b.c-0123abcd.exr", ".a-0123abcd-0123abcd.exr"]
    ours += [".summary-0123abcd.json", ".contact-sheet-0123abcd.html"]
    others = [".other-0123abcd.exr", "a-0123abcd.exr", ".a-0123abcd.blend", ".a-0123.exr", "a.exr", ".viewcam.lock"]
    others += [".summary-1-of-2-0123abcd.json", ".a-0123abcd.exr.bak"]
    for name in [*ours, *others]:
        (tmp_path / name).touch()
    Folder(tmp_path).remove_leftovers(shots)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(others)


@pytest.mark.parametrize("part", ["", "2-of-8"])
def test_what_a_killed_process_leaves_of_any_file_is_a_leftover(tmp_path, part):
    """written_whole chooses the temporary names: here they are those that are looked for."""
    folder = Folder(tmp_path, part)
    files = [folder.image("a"), folder.preview("a"), folder.sidecar("a"), folder.summary, folder.contact_sheet]
    for file in files:
        with written_whole(file) as temporary:
            temporary.touch()
            left = temporary.name
        (tmp_path / left).touch()  # as if the process had ended in the block
        file.unlink()
    assert len(list(tmp_path.iterdir())) == len(files)
    folder.remove_leftovers(["a"])
    assert not list(tmp_path.iterdir())


def test_a_part_of_a_batch_has_files_of_its_own(tmp_path):
    whole, part = Folder(tmp_path), Folder(tmp_path, "2-of-8")
    assert part.summary.name == "summary-2-of-8.json" and part.contact_sheet.name == "contact-sheet-2-of-8.html"
    assert part.image("a") == whole.image("a") and part.lock == whole.lock


def test_a_name_with_dots_loses_none_of_them(tmp_path):
    assert Folder(tmp_path).image("shot.v2").name == "shot.v2.exr"


def test_a_file_in_the_place_of_the_folder_is_named_in_one_sentence(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"file can't be a folder of pictures .*: give another for --out"):
        Folder(tmp_path / "file")


def test_a_full_disk_is_an_error_of_its_own(tmp_path):
    with pytest.raises(FullDiskError, match="No space left"), written_whole(tmp_path / "a") as temporary:
        temporary.touch()
        raise OSError(28, "No space left on device")
    with pytest.raises(InputError) as caught, written_whole(tmp_path / "a"):
        raise OSError(5, "Input/output error")
    assert type(caught.value) is InputError


# --- Two batches in one folder never have the same shot at the same time, and a killed one has none


posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has one batch a folder: the tests at the end")

ROOT = Path(__file__).resolve().parent.parent.parent
HOLDER = """
import sys
from pathlib import Path
from viewcam_addon.jobs.locks import Claims
with Claims(Path(sys.argv[1])) as claims:
    with claims.alone() as alone:
        print(alone, flush=True)
    for line in sys.stdin:
        words = line.split()
        print(getattr(claims, words[0])(words[1]), flush=True)
"""


class Other:
    """A batch in another process."""

    def __init__(self, path):
        command = [sys.executable, "-c", HOLDER, str(path)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        self.alone = self.process.stdout.readline().strip() == "True"

    def ask(self, *words):
        print(*words, file=self.process.stdin, flush=True)
        return self.process.stdout.readline().strip()

    def kill(self):
        with self.process:
            self.process.kill()


@pytest.fixture
def path(tmp_path):
    return tmp_path / ".viewcam.lock"


@pytest.fixture
def another(path):
    others = []

    def start():
        others.append(Other(path))
        return others[-1]

    yield start
    for other in others:
        other.kill()


def alone(claims):
    with claims.alone() as is_alone:
        return is_alone


@posix
def test_a_shot_is_one_batchs_until_it_is_released(path, another):
    other = another()
    assert other.alone
    with Claims(path) as claims:
        assert other.ask("take", "left") == "True"
        assert not claims.take("left") and claims.take("right")
        assert other.ask("take", "right") == "False"
        other.ask("release", "left")
        claims.release("right")
        assert claims.take("left") and other.ask("take", "right") == "True"


@posix
def test_names_that_are_one_file_are_one_claim(path, another):
    with Claims(path) as claims:
        assert claims.take("Größe") and another().ask("take", "GRÖSSE") == "False"


@posix
def test_a_killed_batch_has_no_claims(path, another):
    other = another()
    other.ask("take", "left")
    with Claims(path) as claims:
        assert not alone(claims) and not claims.take("left")
        other.kill()
        assert alone(claims) and claims.take("left")


@posix
def test_only_the_first_of_several_batches_is_alone(path, another):
    with Claims(path) as claims:
        assert alone(claims) and alone(claims)
        assert [another().alone, another().alone] == [False, False]
        assert not alone(claims)


@posix
def test_no_batch_begins_while_another_is_told_that_it_is_alone(path, another):
    with Claims(path) as claims, claims.alone() as is_alone:
        assert is_alone
        beginner = another()
        assert not beginner.alone
        beginner.process.stdin.close()  # nothing is left for it to do but to begin
        with pytest.raises(subprocess.TimeoutExpired):
            beginner.process.wait(2)
    assert beginner.process.wait() == 0


@posix
def test_ten_thousand_names_have_ten_thousand_bytes_of_their_own():
    places = {locks._byte(f"shot_{number}") for number in range(10_000)}
    assert len(places) == 10_000 and min(places) > 1 and max(places) < 2**63


@posix
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOTSUP])
def test_where_there_are_no_locks_every_claim_is_granted_and_nobody_is_alone(path, monkeypatch, number):
    def refuse(*_):
        raise OSError(number, "No locks available")

    monkeypatch.setattr(locks.fcntl, "lockf", refuse)
    with Claims(path) as claims, claims.summing_up():
        assert claims.take("left") and claims.take("left") and not alone(claims)
        claims.release("left")


@posix
def test_an_error_that_is_none_of_locks_is_not_taken_for_one(path, monkeypatch):
    def fail(*_):
        raise OSError(errno.EIO, "Input/output error")

    with Claims(path) as claims:
        monkeypatch.setattr(locks.fcntl, "lockf", fail)
        with pytest.raises(OSError, match="Input/output"):
            claims.take("left")


def test_a_folder_that_can_not_be_written_is_named(tmp_path):
    with pytest.raises(InputError, match=r"lock can't be written .*: choose another folder"):
        Claims(tmp_path / "missing" / ".viewcam.lock")


class OneAtATime:
    """msvcrt, which Windows alone has: a byte of a file is locked once."""

    LK_NBLCK = 2
    locked = False

    def locking(self, file, kind, count):
        if self.locked:
            raise OSError(errno.EACCES, "Permission denied")
        self.locked = True


def test_on_windows_a_second_batch_in_a_folder_is_refused(path, monkeypatch):
    monkeypatch.setattr(locks, "_ON_WINDOWS", True)
    monkeypatch.setattr(locks, "msvcrt", OneAtATime(), raising=False)
    with Claims(path) as claims, claims.summing_up():
        assert alone(claims) and claims.take("left")
        claims.release("left")
        with pytest.raises(InputError, match=r"another batch works in .*: wait for it, or give another --out"):
            Claims(path)
