"""Running scripts with Blender's Python, in a separate process."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

from dermis.base.errors import refuse

PYTHON_VARIABLE = "DERMIS_BLENDER_PYTHON"
_INSTALL_HINT = (
    f"Set {PYTHON_VARIABLE} to a Python with bpy, kept apart since bpy wants numpy below 2: "
    'python3.11 -m venv blender && blender/bin/pip install bpy "numpy<2"'
)


class BlenderTask(NamedTuple):
    """Wording of error messages about a run of Blender.

    renderer : name of the renderer, such as "Cycles"
    goal : purpose of the run, such as "to render the head"
    advice : sentence on what the user can do when the run fails
    """

    renderer: str
    goal: str
    advice: str


def blender_python(python: str | Path | None = None) -> Path:
    """Return the path of a Python with bpy, by default from the environment variable DERMIS_BLENDER_PYTHON.

    Raises DermisError when there is no such file.
    """
    path = python or os.environ.get(PYTHON_VARIABLE) or ""
    if not path:
        _refuse_missing_python("none is named")
    if not Path(path).is_file():
        _refuse_missing_python(f"there is no file {path}")
    return Path(path)


def run_blender(
    python: Path, script: Path, script_options: Sequence[str], timeout_s: float, blender_task: BlenderTask
) -> None:
    """Run a script in Blender's Python, isolated from the user's modules and from the script's folder.

    script_options : command-line arguments of the script

    Raises DermisError when the script cannot be run, fails, or takes longer than the timeout.
    """
    command = [str(python), "-I", str(script), *script_options]
    try:
        process = subprocess.run(command, capture_output=True, check=False, timeout=timeout_s)
    except OSError as fault:
        _refuse_missing_python(f"{python} cannot be run ({fault.strerror})")
    except subprocess.TimeoutExpired:
        actual = f"it was ended after {timeout_s:.0f} s"
        refuse(blender_task.renderer, blender_task.goal, actual, "Take fewer samples or a smaller image")
    if process.returncode != 0:
        _refuse_failed_run(python, process, blender_task)


def _refuse_failed_run(
    python: Path, process: subprocess.CompletedProcess[bytes], blender_task: BlenderTask
) -> NoReturn:
    output = (process.stderr.strip() or process.stdout.strip()).decode("utf-8", "replace").splitlines()
    last_line = output[-1] if output else "no output"
    if "No module named" in last_line:
        _refuse_missing_python(f"{python} says: {last_line}")
    outcome = f"signal {-process.returncode} ended it" if process.returncode < 0 else "it failed"
    refuse(blender_task.renderer, blender_task.goal, f"{outcome} ({last_line})", blender_task.advice)


def _refuse_missing_python(actual_python: str) -> NoReturn:
    refuse("Cycles", "a Python that has Blender's module bpy", actual_python, _INSTALL_HINT)
