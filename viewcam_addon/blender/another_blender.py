"""A Blender like this one, in a process of its own, with factory settings and nothing open: for what this one can't do now.

It has a folder of its own for what is the user's: a Blender that reads factory settings has no extension enabled, and removes
the wheels of all that are installed. Rejected: a thread, since Blender renders one thing at a time.
"""

import subprocess
import sys
from pathlib import Path

import bpy

from .. import child_process
from ..files import temporary_folder


def run(statements: str, timeout: float) -> subprocess.CompletedProcess[bytes]:
    """Let it run these statements of Python; scripts of files that it opens are off. timeout : seconds.

    Raises OSError or subprocess.TimeoutExpired if it can't be started, or is not done in time.
    """
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "--background", "--factory-startup", "--disable-autoexec"]
        command += ["--python-exit-code", "1", "--python-expr", statements]
    else:
        command = [sys.executable, "-c", statements]
    scripts = bpy.utils.system_resource("SCRIPTS")  # where there is a bpy that only this process can import
    with temporary_folder() as folder:
        # In a session of its own: a Ctrl-C that is meant for us would end it, and look like a failure.
        return subprocess.run(
            command,
            env=child_process.environment(scripts, BLENDER_USER_RESOURCES=str(folder)),
            start_new_session=True,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=timeout,
            check=False,
        )


def call(module: str, arguments: list[str], timeout: float) -> subprocess.CompletedProcess[bytes]:
    """Let it call `main(*arguments)` of a module of this package. module : dotted, without the package's own name."""
    package = Path(__file__).parents[1]
    return run(
        f"import sys; sys.path.append({str(package.parent)!r})\nfrom {package.name}.{module} import main; main(*{arguments!r})",
        timeout,
    )
