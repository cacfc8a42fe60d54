"""The truth of a scene: volumetric path tracing by Mitsuba, with the variance of each pixel."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject
from dermis.apps.truths.mitsuba_scene import (
    ROULETTE_DEPTH,
    Lambertian,
    check_traceable,
    emissive_skin,
    load_mitsuba,
    radiance_scene,
    coverage_scene,
    mitsuba_variant,
)
from dermis.base.disk import find, keep
from dermis.base.errors import refuse
from dermis.environment.panorama import load_panorama
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

__all__ = ["Lambertian", "PathTraced", "path_trace"]

Floats = NDArray[np.float32]
ProgressCallback = Callable[[int, int], None]
Variant = Literal["scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb"]

SAMPLES_PER_PASS = 4
_MIN_PASSES = 2
_MAX_SAMPLES = 2**20
_COVERAGE_SAMPLES = 64
_SAVE_INTERVAL_S = 30.0


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
    notes: tuple[str, ...] = ()


def path_trace(
    scene: Scene,
    medium: Medium | Lambertian,
    samples: int = 64,
    settings: Settings | None = None,
    *,
    variant: Variant = "scalar_rgb",
    keep: bool = True,
    report: ProgressCallback | None = None,
) -> PathTraced:
    """Return the scene with its skin filled by a medium; maps, profile and surface reflection are ignored.

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
    wanted = pass_count(samples)
    check_traceable(medium)
    mi, size = load_mitsuba(), (settings or Settings()).size
    form = f"{mi.__version__} {variant} {SAMPLES_PER_PASS} {ROULETTE_DEPTH}"
    key = scene_key(scene, medium, size, form) if keep else None
    return render_passes(
        mi,
        variant,
        wanted,
        size,
        key,
        lambda: radiance_scene(mi, scene, medium, size),
        lambda: coverage_scene(mi, scene.camera, size, emissive_skin(mi, scene.head)),
        report,
    )


def render_passes(
    mi: Mitsuba,
    variant: Variant,
    wanted: int,
    size: tuple[int, int],
    key: str | None,
    radiance: Callable[[], tuple[MitsubaObject, tuple[str, ...]]],
    share: Callable[[], MitsubaObject],
    report: ProgressCallback | None,
) -> PathTraced:
    """Return the mean of as many passes as wanted, those that are kept on disk included.

    key : name of the kept passes; None to keep none
    radiance, share : make the scenes of the radiance, with notes, and of the share of skin in each pixel
    """
    passes = load_passes(key, size) if key else None
    if passes is None or passes.count < wanted:
        with mitsuba_variant(mi, variant):
            built, notes = radiance()
            if passes is None:
                mask = np.array(mi.render(share(), spp=_COVERAGE_SAMPLES), np.float32)[..., 0]
                passes = Passes.none(size, np.clip(mask, 0.0, 1.0), notes)
            add_passes(mi, built, passes, wanted, key, report)
    return PathTraced(
        passes.mean.astype(np.float32),
        passes.variance.astype(np.float32),
        passes.mask,
        passes.count * SAMPLES_PER_PASS,
        passes.seconds,
        passes.notes,
    )


def pass_count(samples: int) -> int:
    """Return the number of passes for at least so many samples.

    Raises DermisError for none and for too many.
    """
    if not (isinstance(samples, int | np.integer) and 1 <= samples <= _MAX_SAMPLES):
        refuse("samples", f"a whole number from 1 to {_MAX_SAMPLES}", f"{samples} came", "Correct it")
    return max(_MIN_PASSES, -(-samples // SAMPLES_PER_PASS))


def add_passes(
    mi: Mitsuba, built: MitsubaObject, passes: Passes, wanted: int, key: str | None, report: ProgressCallback | None
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
            if key and ended - stored > _SAVE_INTERVAL_S and passes.count < wanted:
                save_passes(key, passes)
                stored = ended
    finally:
        if key and passes.count > 0:
            save_passes(key, passes)


Doubles = NDArray[np.float64]
_CACHE_FOLDER = "path-traced"
_CACHE_VERSION = 1  # raise when the same scene is traced in another way


@dataclass
class Passes:
    """Running moments of equal renderings.

    mean : (h, w, 3) of all passes
    spread : (h, w, 3) sum of their squared distances from the mean
    mask : (h, w) share of each pixel that skin fills
    seconds : that the passes took
    """

    mean: Doubles
    spread: Doubles
    mask: NDArray[np.float32]
    notes: tuple[str, ...]
    count: int = 0
    seconds: float = 0.0

    @classmethod
    def none(cls, size: tuple[int, int], mask: NDArray[np.floating], notes: tuple[str, ...]) -> Passes:
        """Return the start of the passes of an image (width, height)."""
        shape = (size[1], size[0], 3)
        return cls(np.zeros(shape), np.zeros(shape), np.asarray(mask, np.float32), notes)

    @property
    def variance(self) -> Doubles:
        """(h, w, 3) of the mean."""
        return self.spread / (self.count * (self.count - 1))

    def add(self, image: Doubles, seconds: float) -> None:
        """Add a pass (h, w, 3). Source: [Welford1962]."""
        self.count += 1
        self.seconds += seconds
        before = image - self.mean
        self.mean = self.mean + before / self.count
        self.spread = self.spread + before * (image - self.mean)


def hash_lighting(digest: hashlib._Hash, scene: Scene) -> None:
    """Add camera, lights and environment of a scene to a hash."""
    for part in (scene.camera, *scene.lights, *filter(None, [scene.environment])):
        digest.update(f"{type(part).__name__} {part.model_dump_json()}".encode())
    if scene.environment is not None:  # the file of that name may change
        digest.update(np.ascontiguousarray(load_panorama(scene.environment.name)).tobytes())


def scene_key(scene: Scene, medium: Medium | Lambertian, size: tuple[int, int], form: str) -> str:
    """Return a hash of all that the image depends on.

    form : versions, and how it is traced
    """
    digest = hashlib.sha256(f"{_CACHE_VERSION} {form} {size} {scene.head.centre_mm}".encode())
    hash_lighting(digest, scene)
    mesh = scene.head.mesh
    digest.update(repr([(material.kind, material.colour) for material in mesh.materials]).encode())
    for array in (mesh.positions, mesh.normals, mesh.point, mesh.triangles, mesh.material):
        digest.update(np.ascontiguousarray(array).tobytes())
    if isinstance(medium, Lambertian):
        digest.update(repr(medium).encode())
    else:
        for layer in medium.layers:
            digest.update(f"layer {layer.thickness_mm}".encode())
            digest.update(np.ascontiguousarray([layer.sigma_a, layer.sigma_s_prime], np.float64).tobytes())
    return digest.hexdigest()[:40]


def load_passes(key: str, size: tuple[int, int]) -> Passes | None:
    """Return the passes of that name, or None when there are none that can be read."""
    found = find(_CACHE_FOLDER, key, ("mean", "spread", "mask", "notes", "count", "seconds"))
    if found is None or found["mean"].shape != (size[1], size[0], 3):
        return None
    notes = tuple(str(note) for note in found["notes"])
    moments = found["mean"], found["spread"], found["mask"]
    return Passes(*moments, notes, int(found["count"]), float(found["seconds"]))


def save_passes(key: str, passes: Passes) -> None:
    """Keep passes under a name; the disk may fail without harm, and a file is whole or not there."""
    keep(_CACHE_FOLDER, key, {name: np.asarray(value) for name, value in vars(passes).items()})
