"""The commands of docs/farm.md do what it says, word by word. This machine is the farm, Blender a stand-in."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from viewcam_addon import child_process

pytest.importorskip("distributed")

pytestmark = pytest.mark.exhaustive

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "farm.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"(?m)^```(sh|text)\n((?:.*\n)*?)```$", PAGE)
COMMANDS = [line for language, block in BLOCKS if language == "sh" for line in block.splitlines()]


@pytest.fixture
def here(stand_in, tmp_path):
    """Makes the page's words those of this machine: (text) → text."""
    (tmp_path / "shot.blend").write_text("a scene")
    rows = [f"shot_{i},{i} -6 2,0 0 1,0 0 1,400,64,36" for i in range(16)]
    (tmp_path / "shots.csv").write_text("\n".join(["name,eye,look_at,up,d,width,height", *rows]))
    programs = {
        "blender": str(stand_in.program),
        "dask": f"{sys.executable} -m dask",
        "viewcam": shlex.join(child_process.viewcam()),
    }

    def farm_of(text):
        text = text.replace("/opt/blender/blender", "blender").replace("/shared/", f"{tmp_path}/")
        text = text.replace("VIEWCAM_BLENDER=blender", f"VIEWCAM_BLENDER={programs['blender']}")
        program = re.match(r"(?:\w+=\S+ )*(\w+)", text)
        return text[: program.start(1)] + programs[program[1]] + text[program.end(1) :]

    return farm_of


def the_one(beginning):
    (command,) = [line for line in COMMANDS if beginning in line]
    return command


def done_in(folder):
    return {path.stem for path in folder.glob("shot_*.exr")}


def test_scheduler_worker_and_batch_as_the_page_starts_them(here, stand_in, tmp_path, processes):
    family = []

    def start(words):
        message = tmp_path / f"said-{len(family)}.txt"
        words = ["sh", "-c", f"exec env {here(words)}"]
        family.append(
            child_process.ProcessGroup(
                words, message, child_process.environment(DASK_TEMPORARY_DIRECTORY=str(tmp_path / "dask"))
            )
        )
        return message

    try:
        # With a port and a place of their own: others may test on this machine.
        message = start(the_one("dask scheduler").replace("8786", "0") + " --host 127.0.0.1 --no-dashboard")
        assert processes.until(lambda: re.search(r"Scheduler at:\s+(tcp://\S+)", message.read_text())), message.read_text()
        address = re.search(r"Scheduler at:\s+(tcp://\S+)", message.read_text())[1]
        message = start(the_one("dask worker").replace("tcp://farm:8786", address) + " --no-dashboard")
        assert processes.until(lambda: "Registered to" in message.read_text()), message.read_text()
        words = ["sh", "-c", here(the_one("viewcam batch /shared/shot.blend").replace("tcp://farm:8786", address))]
        batch = subprocess.run(words, env=child_process.environment(), capture_output=True, text=True)
    finally:
        for each in family:
            each.end()
    assert batch.returncode == 0, batch.stdout + batch.stderr
    assert done_in(tmp_path / "renders") == {f"shot_{i}" for i in range(16)}
    assert len(stand_in.diary("open")) == 2, "one looks at the file, one renders"


def managers():
    """The command of part 1 for each manager, with the words that are replaced there."""
    texts = [block.strip() for language, block in BLOCKS if language == "text"]
    opencue, deadline, flamenco = texts
    yield pytest.param(opencue, "#IFRAME#", id="OpenCue")
    executable, arguments = re.search(r'-executable (\S+) -arguments "([^"]*)"', deadline).groups()
    yield pytest.param(f"{executable} {arguments}", "<STARTFRAME>", id="Deadline")
    before, arguments = re.search(r'exeArgs: "([^"]*)"', flamenco)[1], re.search(r"args: \[(\".*)\]", flamenco)[1]
    values = {"shots": "/shared/shots.csv", "out": "/shared/renders", "`${part}/${parts}`": "{part}/8"}
    words = [values.get(word, word.strip('"')) for word in arguments.split(", ")]
    yield pytest.param(f"blender {before} /shared/shot.blend {shlex.join(words)}", "{part}", id="Flamenco")
    yield pytest.param(the_one("--shard 1/8").replace("1/8", "{part}/8"), "{part}", id="any other")


@pytest.mark.parametrize(("command", "placeholder"), list(managers()))
def test_the_parts_of_a_manager_are_the_whole_and_a_repeated_part_renders_nothing(
    here, stand_in, tmp_path, command, placeholder
):
    assert placeholder in command

    def run(words):
        done = subprocess.run(["sh", "-c", here(words)], env=child_process.environment(), capture_output=True, text=True)
        assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"

    for part in (3, 7, 3):
        run(command.replace(placeholder, str(part)))
    assert done_in(tmp_path / "renders") == {"shot_2", "shot_10", "shot_6", "shot_14"}, "neighbors are in different parts"
    assert len(stand_in.diary("render")) == 4


def test_after_all_parts_the_command_without_them_renders_nothing_and_sums_up(here, stand_in, tmp_path):
    command = the_one("--shard 1/8")
    for part in ("1/2", "2/2"):
        subprocess.run(["sh", "-c", here(command.replace("1/8", part))], env=child_process.environment(), check=True)
    assert not (tmp_path / "renders" / "summary.json").exists() and len(stand_in.diary("render")) == 16
    subprocess.run(["sh", "-c", here(command.replace(" --shard 1/8", ""))], env=child_process.environment(), check=True)
    assert len(stand_in.diary("render")) == 16
    assert len(json.loads((tmp_path / "renders" / "summary.json").read_text())["shots"]) == 16
