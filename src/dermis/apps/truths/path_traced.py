"""The truth of a scene: volumetric path tracing by Mitsuba, with the variance of each pixel."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.mitsuba_passes import Passes, kept_passes, scene_key, store_passes
from dermis.apps.truths.mitsuba_scene import (
    ROULETTE_DEPTH,
    Lambertian,
    check_traceable,
    load_mitsuba,
    mask_scene,
    radiance_scene,
    variant_of,
)
from dermis.base.errors import refuse
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

__all__ = ["Lambertian", "PathTraced", "path_trace"]

Floats = NDArray[np.float32]
Report = Callable[[int, int], None]
Variant = Literal["scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb"]

SAMPLES_PER_PASS = 4
_LEAST_PASSES = 2
_MOST_SAMPLES = 2**20
_MASK_SAMPLES = 64
_STORE_SECONDS = 30.0


@dataclass(frozen=True, eq=False)
class PathTraced:
    """A path-traced image, black where there is no head.

    image : (h, w, 3) radiance, linear Rec. 709
    variance : (h, w, 3) of each value of the image, as a mean
    mask : (h, w) share of the pixel that visible skin fills
    samples : paths through each pixel
    seconds : that they took
    notes : what had to be done to the head
    """

    image: Floats
    variance: Floats
    mask: Floats
    samples: int
    seconds: float
    notes: tuple[str, ...]


def path_trace(
    scene: Scene,
    medium: Medium | Lambertian,
    samples: int = 64,
    settings: Settings | None = None,
    *,
    variant: Variant = "scalar_rgb",
    keep: bool = True,
    report: Report | None = None,
) -> PathTraced:
    """The scene with its skin filled by a medium; its maps, profile and surface reflection are ignored.

    medium : index-matched (eta 1), isotropic, with three channels; layers become nested bodies, each face the
        skin moved inwards by its depth. Or a `Lambertian`, for directly lit skin without scattering
    samples : at least this many paths through each pixel, in passes of 4. Passes are kept on disk by the
        scene's content, so a later call with more samples adds to them
    settings : only the size counts
    variant : of Mitsuba; "llvm_ad_rgb" takes half the time for many samples but needs a recent LLVM (14 and
        15 end the process), "cuda_ad_rgb" needs an NVIDIA GPU
    keep : whether to use and keep passes on disk; without it `seconds` is that of this call
    report : called with the number of passes done, and of all

    Raises DermisError when Mitsuba is missing, and for what it cannot trace: a surface without volume, media
    under a refracting surface, lights without shadows.

    Light passes the surface unbent, so point lights connect to what lies below it; compare with profiles for
    eta 1. Lights are invisible and do not shadow one another.

    Sources: [Jakob2022], [Miller2019].
    """
    wanted = passes_for(samples)
    check_traceable(medium)
    mi, size = load_mitsuba(), (settings or Settings()).size
    form = f"{mi.__version__} {variant} {SAMPLES_PER_PASS} {ROULETTE_DEPTH}"
    key = scene_key(scene, medium, size, form) if keep else None
    passes = kept_passes(key, size) if key else None
    if passes is None or passes.count < wanted:
        with variant_of(mi, variant):
            built, notes = radiance_scene(mi, scene, medium, size)
            passes = passes or Passes.none(size, _mask(mi, scene, size), notes)
            add_passes(mi, built, passes, wanted, key, report)
    return traced(passes)


def traced(passes: Passes) -> PathTraced:
    """The mean of some passes, as an image."""
    return PathTraced(
        passes.mean.astype(np.float32),
        passes.variance.astype(np.float32),
        passes.mask,
        passes.count * SAMPLES_PER_PASS,
        passes.seconds,
        passes.notes,
    )


def passes_for(samples: int) -> int:
    """How many passes have at least so many samples.

    Raises DermisError for none and for too many.
    """
    if not (isinstance(samples, int | np.integer) and 1 <= samples <= _MOST_SAMPLES):
        refuse("samples", f"a whole number from 1 to {_MOST_SAMPLES}", f"{samples} came", "Correct it")
    return max(_LEAST_PASSES, -(-samples // SAMPLES_PER_PASS))


def _mask(mi: Any, scene: Scene, size: tuple[int, int]) -> Floats:
    share = np.array(mi.render(mask_scene(mi, scene, size), spp=_MASK_SAMPLES), np.float32)[..., 0]
    return np.clip(share, 0.0, 1.0)


def add_passes(
    mi: Any, built: Any, passes: Passes, wanted: int, key: str | None, report: Report | None
) -> None:
    """Add passes of Mitsuba's scene up to the number wanted; with a key those done are stored in any case."""
    stored = time.perf_counter()
    try:
        while passes.count < wanted:
            began = time.perf_counter()
            image = np.array(mi.render(built, spp=SAMPLES_PER_PASS, seed=passes.count), np.float64)
            ended = time.perf_counter()
            passes.add(image, ended - began)
            if report is not None:
                report(passes.count, wanted)
            if key and ended - stored > _STORE_SECONDS and passes.count < wanted:
                store_passes(key, passes)
                stored = ended
    finally:
        if key and passes.count > 0:
            store_passes(key, passes)
