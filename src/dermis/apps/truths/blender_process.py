"""Blender's Python as a process of its own: where it is, and how it may fail."""

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
    """What Blender is to do, as messages say it.

    who : does it
    task : "to ..."
    remedy : for one that failed
    """

    who: str
    task: str
    remedy: str


def blender_python(python: str | Path | None = None) -> Path:
    """Return the Python that has bpy: the one given, or the one that DERMIS_BLENDER_PYTHON names.

    Raises DermisError when there is no such file.
    """
    named = python or os.environ.get(PYTHON_VARIABLE) or ""
    if not named:
        _refuse_python("none is named")
    if not Path(named).is_file():
        _refuse_python(f"there is no file {named}")
    return Path(named)


def run_blender(
    python: Path, script: Path, arguments: Sequence[str], longest_s: float, errand: BlenderTask
) -> None:
    """Run a script in Blender's Python, isolated from the modules beside it and from the user's.

    Raises DermisError when it cannot be run, fails, or takes longer.
    """
    command = [str(python), "-I", str(script), *arguments]
    try:
        ran = subprocess.run(command, capture_output=True, check=False, timeout=longest_s)
    except OSError as fault:
        _refuse_python(f"{python} cannot be run ({fault.strerror})")
    except subprocess.TimeoutExpired:
        came = f"it was ended after {longest_s:.0f} s"
        refuse(errand.who, errand.task, came, "Take fewer samples or a smaller image")
    if ran.returncode != 0:
        _refuse_exit(python, ran, errand)


def _refuse_exit(python: Path, ran: subprocess.CompletedProcess[bytes], errand: BlenderTask) -> NoReturn:
    said = (ran.stderr.strip() or ran.stdout.strip()).decode("utf-8", "replace").splitlines()
    last = said[-1] if said else "it said nothing"
    if "No module named" in last:
        _refuse_python(f"{python} says: {last}")
    ended = f"signal {-ran.returncode} ended it" if ran.returncode < 0 else "it failed"
    refuse(errand.who, errand.task, f"{ended} ({last})", errand.remedy)


def _refuse_python(came: str) -> NoReturn:
    refuse("Cycles", "a Python that has Blender's module bpy", came, _INSTALL_HINT)
