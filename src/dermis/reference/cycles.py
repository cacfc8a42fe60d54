"""The same head by Cycles, as what a user of Blender would pick instead: random walk or Burley's profile."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.optics.media import Medium
from dermis.reference.cycles_process import CyclesPass, blender_python, read_passes, run_cycles, write_scene
from dermis.reference.cycles_scene import FALLOFFS, describe
from dermis.reference.mitsuba_skin import Lambertian
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
Method = Literal["random-walk", "burley"]
_PASSES = 4


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
    """The scene by Cycles on the CPU: the mean of passes; arguments and refusals as of `cycles_passes`.

    samples : at least so many paths through each pixel, in 4 passes
    """
    _check_samples(samples)
    each = -(-int(samples) // _PASSES)
    passes = cycles_passes(scene, medium, [each] * _PASSES, settings, method=method, python=python)
    images = np.stack([one.image for one in passes]).astype(np.float64)
    coverage = np.stack([one.coverage for one in passes]).astype(np.float64)
    return CyclesRendered(
        images.mean(axis=0).astype(np.float32),
        (images.var(axis=0, ddof=1) / _PASSES).astype(np.float32),
        coverage.mean(axis=0).astype(np.float32),
        each * _PASSES,
        sum(one.seconds for one in passes),
    )


def cycles_passes(
    scene: Scene,
    medium: Medium | Lambertian,
    samples: Sequence[int],
    settings: Settings | None = None,
    *,
    method: Method = "random-walk",
    seed: int = 0,
    python: str | Path | None = None,
) -> list[CyclesPass]:
    """The scene by Cycles on the CPU, once for each count of samples, in one process.

    There is no clamping, denoising or surface reflection.

    medium : of one layer; its eta plays no part, for Cycles' walks end at an index-matched surface. Its
        colour in Cycles is what it reflects of diffuse light, its radius 4 pi mean free paths. Or a
        `Lambertian`
    samples : paths through each pixel, of each pass
    settings : only the size counts
    seed : of the first pass; each further one has the next
    python : of an environment with `bpy`; DERMIS_BLENDER_PYTHON when left out

    Raises DermisError when there is no such Python, when Cycles fails, and for layers.
    """
    for count in samples:
        _check_samples(count)
    if method not in FALLOFFS:
        refuse("method", f"one of {', '.join(FALLOFFS)}", f"{method!r} came", "Correct it")
    size = (settings or Settings()).size
    described, arrays = describe(scene, medium, method, size)
    described["passes"] = [{"samples": int(n), "seed": seed + k} for k, n in enumerate(samples)]
    interpreter = blender_python(python)
    with tempfile.TemporaryDirectory(prefix="dermis-cycles-") as name:
        folder = Path(name)
        write_scene(folder, described, arrays)
        run_cycles(interpreter, folder, paths=size[0] * size[1] * sum(samples))
        return read_passes(folder, samples, size)


def _check_samples(samples: int) -> None:
    if not (isinstance(samples, int | np.integer) and samples >= 1):
        refuse("samples", "a whole number from 1", f"{samples} came", "Correct it")
