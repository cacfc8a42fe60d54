"""Blender's Python as a process of its own: what it is given, how it may fail, what it leaves."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from dermis.errors import DermisError, refuse
from dermis.images.io import read_image

PYTHON_VARIABLE = "DERMIS_BLENDER_PYTHON"
Floats = NDArray[np.float32]
_REMEDY = (
    f"Set {PYTHON_VARIABLE} to a Python with bpy, kept apart since bpy wants numpy below 2: "
    'python3.11 -m venv blender && blender/bin/pip install bpy "numpy<2"'
)
_START_S, _PATH_S = 300.0, 5e-4
"""Longest start and path: a hundred times what two cores took."""


@dataclass(frozen=True, eq=False)
class CyclesPass:
    """One rendering by Cycles, black where there is no head.

    image : (h, w, 3) radiance, linear Rec. 709
    coverage : (h, w) share of the pixel that the head fills
    samples : paths through each pixel
    seconds : on the clock; those of the first pass include the scene and the acceleration structure
    core_seconds : of all cores together
    version : Blender's
    """

    image: Floats
    coverage: Floats
    samples: int
    seconds: float
    core_seconds: float
    version: str


def blender_python(python: str | Path | None = None) -> Path:
    """The Python that has bpy: the one given, or the one that DERMIS_BLENDER_PYTHON names.

    Raises DermisError when there is no such file.
    """
    named = python or os.environ.get(PYTHON_VARIABLE) or ""
    if not named:
        _refuse_python("none is named")
    if not Path(named).is_file():
        _refuse_python(f"there is no file {named}")
    return Path(named)


def write_scene(folder: Path, described: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """The input of cycles_script.py."""
    (folder / "scene.json").write_text(json.dumps(described), encoding="utf-8")
    np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]  # its last parameter is no array


def run_cycles(python: Path, folder: Path, paths: int) -> None:
    """Render what lies in a folder.

    paths : to be traced, which sets how long to wait

    Raises DermisError when that does not end well, or not at all.
    """
    script = Path(__file__).with_name("cycles_script.py")
    # Isolated: our packages are for another numpy, and the `cycles` beside the script is not Blender's.
    command = [str(python), "-I", str(script), str(folder)]
    longest = _START_S + _PATH_S * paths
    try:
        ran = subprocess.run(command, capture_output=True, check=False, timeout=longest)
    except OSError as fault:
        _refuse_python(f"{python} cannot be run ({fault.strerror})")
    except subprocess.TimeoutExpired:
        came = f"it was ended after {longest:.0f} s"
        refuse("Cycles", "to render the scene", came, "Take fewer samples or a smaller image")
    if ran.returncode != 0:
        _refuse_end(python, ran)


def read_passes(folder: Path, samples: Sequence[int], size: tuple[int, int]) -> list[CyclesPass]:
    """What Cycles left in a folder.

    samples : of each pass
    size : width and height [pixel]

    Raises DermisError when that is not what was asked for.
    """
    try:
        done = json.loads((folder / "done.json").read_text(encoding="utf-8"))
        pixels = [
            read_image(folder / f"pass_{k}.exr").astype(np.float32, copy=False) for k in range(len(samples))
        ]
        if any(one.shape != (size[1], size[0], 4) or not np.isfinite(one).all() for one in pixels):
            raise ValueError("a pass of another size, or with no numbers in it")
        return [
            CyclesPass(
                one[..., :3], one[..., 3], int(count), float(clock), float(cores), str(done["version"])
            )
            for one, count, (clock, cores) in zip(pixels, samples, done["times"], strict=True)
        ]
    except (OSError, ValueError, KeyError, TypeError, DermisError) as fault:
        _refuse_render(f"it left something else ({str(fault) or type(fault).__name__})")


def _refuse_end(python: Path, ran: subprocess.CompletedProcess[bytes]) -> NoReturn:
    said = (ran.stderr.strip() or ran.stdout.strip()).decode("utf-8", "replace").splitlines()
    last = said[-1] if said else "it said nothing"
    if "No module named" in last:
        _refuse_python(f"{python} says: {last}")
    ended = f"signal {-ran.returncode} ended it" if ran.returncode < 0 else "it failed"
    _refuse_render(f"{ended} ({last})")


def _refuse_render(came: str) -> NoReturn:
    refuse("Cycles", "to render the scene", came, "Try bpy 5.0, which this was made with")


def _refuse_python(came: str) -> NoReturn:
    refuse("Cycles", "a Python that has Blender's module bpy", came, _REMEDY)
