"""Reference image of a scene by volumetric path tracing in Mitsuba, with the variance of each pixel."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.mitsuba_scene import (
    RUSSIAN_ROULETTE_DEPTH,
    Lambertian,
    check_traceable,
    coverage_scene,
    emissive_skin,
    load_mitsuba,
    mitsuba_variant,
    radiance_scene,
)
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject
from dermis.base.disk import load_arrays, try_save_arrays
from dermis.base.errors import refuse
from dermis.environment.panorama import load_panorama
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

__all__ = ["Lambertian", "PathTraced", "path_trace"]

Floats = NDArray[np.float32]
ProgressCallback = Callable[[int, int], None]
MitsubaVariant = Literal["scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb"]

SAMPLES_PER_PASS = 4
"""Paths per pixel in each pass on a CPU."""
_GPU_SAMPLES_PER_PASS = 16  # small pictures do not occupy a GPU
_MIN_PASS_COUNT = 2
_MAX_SAMPLES_PER_PIXEL = 2**20
_COVERAGE_SAMPLES_PER_PIXEL = 64
_CACHE_SAVE_INTERVAL_S = 30.0


@dataclass(frozen=True, eq=False)
class PathTraced:
    """Path-traced image, black outside the head.

    image : (h, w, 3) radiance, linear Rec. 709
    variance : (h, w, 3) variance of each value of the image
    mask : (h, w) fraction of each pixel's area that is covered by visible skin
    samples : paths per pixel
    seconds : duration of tracing all paths [s]
    notes : changes that were made to the head
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
    variant: MitsubaVariant = "scalar_rgb",
    use_cache: bool = True,
    progress: ProgressCallback | None = None,
) -> PathTraced:
    """Return the path-traced image of a scene with a medium inside its skin.

    Maps, diffusion profile and surface reflection of the scene are ignored. Light passes the surface without
    refraction, so that paths can connect to point lights from inside the medium. The image is comparable with
    an image of the real-time renderer if the renderer's diffusion profile has an index of refraction of 1.
    Lights are invisible and cast no shadows on one another.

    medium : index-matched (eta 1), isotropically scattering medium with three channels; the interfaces
        between its layers are copies of the skin, offset inwards by the depths of the layers. A
        `Lambertian` gives directly lit skin without subsurface scattering
    samples : smallest number of paths per pixel; each pass traces 4, or 16 on a GPU. Passes are cached on
        disk under a hash of the scene, so a later call with more samples only adds the missing passes
    settings : settings of the frame, of which only the size is used
    variant : variant of Mitsuba; "llvm_ad_rgb" takes half the time for many samples but needs a recent LLVM
        (versions 14 and 15 crash), and "cuda_ad_rgb" needs an NVIDIA GPU
    use_cache : whether to read and write passes on disk; without the cache, `PathTraced.seconds` is the
        duration of this call
    progress : function called with the number of finished passes and the number of all passes

    Raises DermisError when Mitsuba is missing, or when it cannot trace the scene: for a skin surface that
    encloses no volume, a medium under a refracting surface, or a light without shadows.

    Sources: [Jakob2022], [Miller2019].
    """
    target_count = pass_count(samples, variant)
    check_traceable(medium)
    mi, size = load_mitsuba(), (settings or Settings()).size
    trace_settings = f"{mi.__version__} {variant} {samples_per_pass(variant)} {RUSSIAN_ROULETTE_DEPTH}"
    key = scene_cache_key(scene, medium, size, trace_settings) if use_cache else None
    return render_passes(
        mi,
        variant,
        target_count,
        size,
        key,
        lambda: radiance_scene(mi, scene, medium, size),
        lambda: coverage_scene(mi, scene.camera, size, emissive_skin(mi, scene.head)),
        progress,
    )


def render_passes(
    mi: Mitsuba,
    variant: MitsubaVariant,
    min_pass_count: int,
    picture_size: tuple[int, int],
    cache_key: str | None,
    build_radiance_scene: Callable[[], tuple[MitsubaObject, tuple[str, ...]]],
    build_coverage_scene: Callable[[], MitsubaObject],
    progress: ProgressCallback | None,
) -> PathTraced:
    """Return the mean of at least `min_pass_count` passes of Mitsuba, including cached ones.

    cache_key : name of the cached passes; None for no cache
    build_radiance_scene : function that returns the Mitsuba scene for radiance, and notes on changes made to
        the head
    build_coverage_scene : function that returns the Mitsuba scene whose image is the skin's coverage of each
        pixel
    """
    passes = load_passes(cache_key, picture_size) if cache_key else None
    if passes is None or passes.count < min_pass_count:
        with mitsuba_variant(mi, variant):
            built_scene, notes = build_radiance_scene()
            if passes is None:
                mask = np.array(
                    mi.render(build_coverage_scene(), spp=_COVERAGE_SAMPLES_PER_PIXEL), np.float32
                )[..., 0]
                passes = PassStatistics.empty(picture_size, np.clip(mask, 0.0, 1.0), notes)
            add_passes(
                mi, built_scene, passes, min_pass_count, samples_per_pass(variant), cache_key, progress
            )
    return PathTraced(
        passes.mean.astype(np.float32),
        passes.variance.astype(np.float32),
        passes.mask,
        passes.count * samples_per_pass(variant),
        passes.seconds,
        passes.notes,
    )


def samples_per_pass(variant: MitsubaVariant) -> int:
    """Return the number of paths per pixel in each pass."""
    return _GPU_SAMPLES_PER_PASS if variant == "cuda_ad_rgb" else SAMPLES_PER_PASS


def pass_count(samples_per_pixel: int, variant: MitsubaVariant) -> int:
    """Return the number of passes needed for at least `samples_per_pixel` paths per pixel in total.

    Raises DermisError when `samples_per_pixel` is below 1 or too large.
    """
    if not (
        isinstance(samples_per_pixel, int | np.integer) and 1 <= samples_per_pixel <= _MAX_SAMPLES_PER_PIXEL
    ):
        refuse(
            "samples",
            f"a whole number from 1 to {_MAX_SAMPLES_PER_PIXEL}",
            f"got {samples_per_pixel}",
            "Correct it",
        )
    return max(_MIN_PASS_COUNT, -(-samples_per_pixel // samples_per_pass(variant)))


def add_passes(
    mi: Mitsuba,
    loaded_scene: MitsubaObject,
    passes: PassStatistics,
    min_pass_count: int,
    paths_per_pixel: int,
    cache_key: str | None,
    progress: ProgressCallback | None,
) -> None:
    """Render passes of a Mitsuba scene until there are `min_pass_count`, and cache them.

    paths_per_pixel : number of paths per pixel in each pass
    cache_key : name of the cached passes; None for no cache
    """
    last_save = time.perf_counter()
    try:
        while passes.count < min_pass_count:
            started = time.perf_counter()
            image = np.array(mi.render(loaded_scene, spp=paths_per_pixel, seed=passes.count), np.float64)
            ended = time.perf_counter()
            passes.add_pass(image, ended - started)
            if progress is not None:
                progress(passes.count, min_pass_count)
            if cache_key and ended - last_save > _CACHE_SAVE_INTERVAL_S and passes.count < min_pass_count:
                save_passes(cache_key, passes)
                last_save = ended
    finally:
        if cache_key and passes.count > 0:
            save_passes(cache_key, passes)


Doubles = NDArray[np.float64]
_CACHE_FOLDER = "path-traced"
_CACHE_VERSION = 1  # increase when the result for the same scene changes


@dataclass
class PassStatistics:
    """Running mean and variance of passes with equal settings.

    mean : (h, w, 3) mean of all passes
    spread : (h, w, 3) sum of the passes' squared deviations from the mean
    mask : (h, w) fraction of each pixel's area that is covered by visible skin
    notes : changes that were made to the head
    count : number of passes
    seconds : duration of all passes [s]
    """

    mean: Doubles
    spread: Doubles
    mask: NDArray[np.float32]
    notes: tuple[str, ...]
    count: int = 0
    seconds: float = 0.0

    @classmethod
    def empty(
        cls, picture_size: tuple[int, int], mask: NDArray[np.floating], notes: tuple[str, ...]
    ) -> PassStatistics:
        """Return the statistics of a rendering before its first pass.

        picture_size : width and height of the image [pixel]
        """
        shape = (picture_size[1], picture_size[0], 3)
        return cls(np.zeros(shape), np.zeros(shape), np.asarray(mask, np.float32), notes)

    @property
    def variance(self) -> Doubles:
        """Return the variance (h, w, 3) of the mean of all passes."""
        return self.spread / (self.count * (self.count - 1))

    def add_pass(self, image: Doubles, seconds: float) -> None:
        """Add the image (h, w, 3) of a pass to the mean and to the squared deviations, by [Welford1962]."""
        self.count += 1
        self.seconds += seconds
        delta = image - self.mean
        self.mean = self.mean + delta / self.count
        self.spread = self.spread + delta * (image - self.mean)


def hash_lighting(digest: hashlib._Hash, scene: Scene) -> None:
    """Update a hash with the camera, lights and environment of a scene."""
    for part in (scene.camera, *scene.lights, *filter(None, [scene.environment])):
        digest.update(f"{type(part).__name__} {part.model_dump_json()}".encode())
    if scene.environment is not None:  # the content of the file may change
        digest.update(np.ascontiguousarray(load_panorama(scene.environment.name)).tobytes())


def hash_medium(digest: hashlib._Hash, medium: Medium) -> None:
    """Update a hash with the layers and the index of refraction of a medium."""
    digest.update(f"index {medium.eta}".encode())
    for layer in medium.layers:
        digest.update(f"layer {layer.thickness_mm}".encode())
        digest.update(np.ascontiguousarray([layer.sigma_a, layer.sigma_s_prime], np.float64).tobytes())


def scene_cache_key(
    scene: Scene, medium: Medium | Lambertian, picture_size: tuple[int, int], trace_settings: str
) -> str:
    """Return a hash of all inputs of a path-traced image, used as the name of its cached passes.

    trace_settings : versions and settings of the path tracer
    """
    digest = hashlib.sha256(
        f"{_CACHE_VERSION} {trace_settings} {picture_size} {scene.head.centre_mm}".encode()
    )
    hash_lighting(digest, scene)
    mesh = scene.head.mesh
    digest.update(repr([(material.kind, material.colour) for material in mesh.materials]).encode())
    for array in (mesh.positions, mesh.normals, mesh.point, mesh.triangles, mesh.material):
        digest.update(np.ascontiguousarray(array).tobytes())
    if isinstance(medium, Lambertian):
        digest.update(repr(medium).encode())
    else:
        hash_medium(digest, medium)
    return digest.hexdigest()[:40]


def load_passes(cache_key: str, picture_size: tuple[int, int]) -> PassStatistics | None:
    """Return the cached passes for a key and a picture size, or None if the cache has no such passes."""
    found = load_arrays(_CACHE_FOLDER, cache_key, ("mean", "spread", "mask", "notes", "count", "seconds"))
    if found is None or found["mean"].shape != (picture_size[1], picture_size[0], 3):
        return None
    notes = tuple(str(note) for note in found["notes"])
    moments = found["mean"], found["spread"], found["mask"]
    return PassStatistics(*moments, notes, int(found["count"]), float(found["seconds"]))


def save_passes(cache_key: str, passes: PassStatistics) -> None:
    """Write passes to the cache, and ignore errors of the file system."""
    try_save_arrays(
        _CACHE_FOLDER, cache_key, {name: np.asarray(value) for name, value in vars(passes).items()}
    )
