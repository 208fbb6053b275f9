"""A Blender like this one, in a process of its own, with factory settings and nothing open: for what this one can't do now.

Rejected: a thread, since Blender renders one thing at a time.
"""

import subprocess
import sys
from pathlib import Path

import bpy

from .. import child_process


def run(statements: str, timeout: float) -> subprocess.CompletedProcess[bytes]:
    """Let it run these statements of Python; scripts of files that it opens are off. timeout : seconds.

    Raises OSError or subprocess.TimeoutExpired if it can't be started, or is not done in time.
    """
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "--background", "--factory-startup", "--disable-autoexec"]
        command += ["--python-exit-code", "1", "--python-expr", statements]
    else:
        command = [sys.executable, "-c", statements]
    # There stands a bpy that only this process can import.
    variables = child_process.environment(apart_from=bpy.utils.system_resource("SCRIPTS"))
    # In a session of its own: a Ctrl-C that is meant for us would end it, and look like a failure.
    return subprocess.run(
        command,
        env=variables,
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
