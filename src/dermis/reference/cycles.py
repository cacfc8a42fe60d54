"""The same head by Cycles, as what a user of Blender would pick instead: random walk or Burley's profile."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.images.io import read_image
from dermis.optics.media import Medium
from dermis.reference.cycles_scene import FALLOFFS, describe
from dermis.reference.mitsuba_skin import Lambertian
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
Method = Literal["random-walk", "burley"]
PYTHON_VARIABLE = "DERMIS_BLENDER_PYTHON"
_PASSES = 4
_REMEDY = (
    f"Set {PYTHON_VARIABLE} to a Python with bpy, kept apart since bpy wants numpy below 2: "
    'python3.11 -m venv blender && blender/bin/pip install bpy "numpy<2"'
)


@dataclass(frozen=True, eq=False)
class CyclesRendered:
    """An image by Cycles, black where there is no head.

    image : (h, w, 3) radiance, linear Rec. 709
    variance : (h, w, 3) of each value of the image, from passes with seeds of their own
    coverage : (h, w) share of the pixel that the head fills
    samples : paths through each pixel
    seconds : that Cycles took for them, scene and acceleration structure included
    """

    image: Floats
    variance: Floats
    coverage: Floats
    samples: int
    seconds: float


def cycles_render(
    scene: Scene,
    medium: Medium | Lambertian,
    samples: int = 64,
    settings: Settings | None = None,
    *,
    method: Method = "random-walk",
    python: str | Path | None = None,
) -> CyclesRendered:
    """The scene by Cycles on the CPU, without clamping, denoising or surface reflection.

    medium : of one layer; its eta plays no part, for Cycles' walks end at an index-matched surface. Its
        colour in Cycles is what it reflects of diffuse light, its radius 4 pi mean free paths. Or a
        `Lambertian`
    samples : at least so many paths through each pixel, in 4 passes
    settings : only the size counts
    python : of an environment with `bpy`; DERMIS_BLENDER_PYTHON when left out

    Raises DermisError when there is no such Python, when Cycles fails, and for layers.
    """
    if not (isinstance(samples, int | np.integer) and samples >= 1):
        refuse("samples", "a whole number from 1", f"{samples} came", "Correct it")
    if method not in FALLOFFS:
        refuse("method", f"one of {', '.join(FALLOFFS)}", f"{method!r} came", "Correct it")
    each, size = -(-int(samples) // _PASSES), (settings or Settings()).size
    described, arrays = describe(scene, medium, method, size, each, _PASSES)
    interpreter = _interpreter(python)
    with tempfile.TemporaryDirectory(prefix="dermis-cycles-") as name:
        folder = Path(name)
        (folder / "scene.json").write_text(json.dumps(described), encoding="utf-8")
        np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]  # its last parameter is no array
        _run(interpreter, folder)
        passes = np.stack([read_image(folder / f"pass_{k}.exr") for k in range(_PASSES)]).astype(np.float64)
        seconds = float(sum(json.loads((folder / "seconds.json").read_text(encoding="utf-8"))))
    return CyclesRendered(
        passes[..., :3].mean(axis=0).astype(np.float32),
        (passes[..., :3].var(axis=0, ddof=1) / _PASSES).astype(np.float32),
        passes[..., 3].mean(axis=0).astype(np.float32),
        each * _PASSES,
        seconds,
    )


def _interpreter(python: str | Path | None) -> Path:
    named = python or os.environ.get(PYTHON_VARIABLE) or ""
    if not named:
        _refuse_python("none is named")
    if not Path(named).is_file():
        _refuse_python(f"there is no file {named}")
    return Path(named)


def _run(python: Path, folder: Path) -> None:
    script = Path(__file__).with_name("cycles_script.py")
    # Isolated: our packages are for another numpy, and the `cycles` beside the script is not Blender's.
    command = [str(python), "-I", str(script), str(folder)]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as fault:
        _refuse_python(f"{python} cannot be run ({fault.strerror})")
    if ran.returncode == 0 and (folder / "seconds.json").is_file():
        return
    last = (ran.stderr.strip() or ran.stdout.strip() or "it said nothing").splitlines()[-1]
    if "No module named 'bpy'" in last:
        _refuse_python(f"{python} says: {last}")
    refuse("Cycles", "to render the scene", f"it failed ({last})", "Try bpy 5.0, which this was made with")


def _refuse_python(came: str) -> NoReturn:
    refuse("Cycles", "a Python that has Blender's module bpy", came, _REMEDY)
