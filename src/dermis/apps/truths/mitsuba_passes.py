"""Independent renderings of one scene: their mean and its variance, kept on disk."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.mitsuba_scene import Lambertian
from dermis.base.disk import find, keep
from dermis.environment.panorama import load_panorama
from dermis.optics.media import Medium
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
_FOLDER = "path-traced"
_FORM = 1  # raise when the same scene is traced in another way


@dataclass
class Passes:
    """Running moments of equal renderings.

    mean : (h, w, 3) of all passes
    spread : (h, w, 3) sum of their squared distances from the mean
    mask : (h, w) share of each pixel that skin fills
    seconds : that the passes took
    """

    mean: Floats
    spread: Floats
    mask: NDArray[np.float32]
    notes: tuple[str, ...]
    count: int = 0
    seconds: float = 0.0

    @classmethod
    def none(cls, size: tuple[int, int], mask: Any, notes: tuple[str, ...]) -> Passes:
        """No pass yet of an image (width, height)."""
        shape = (size[1], size[0], 3)
        return cls(np.zeros(shape), np.zeros(shape), np.asarray(mask, np.float32), notes)

    @property
    def variance(self) -> Floats:
        """(h, w, 3) of the mean."""
        return self.spread / (self.count * (self.count - 1))

    def add(self, image: Floats, seconds: float) -> None:
        """Another pass (h, w, 3). Source: [Welford1962]."""
        self.count += 1
        self.seconds += seconds
        before = image - self.mean
        self.mean = self.mean + before / self.count
        self.spread = self.spread + before * (image - self.mean)


def digest_surroundings(digest: Any, scene: Scene) -> None:
    """Add camera, lights and environment of a scene to a hash."""
    for part in (scene.camera, *scene.lights, *filter(None, [scene.environment])):
        digest.update(f"{type(part).__name__} {part.model_dump_json()}".encode())
    if scene.environment is not None:  # the file of that name may change
        digest.update(np.ascontiguousarray(load_panorama(scene.environment.name)).tobytes())


def scene_key(scene: Scene, medium: Medium | Lambertian, size: tuple[int, int], form: str) -> str:
    """A hash of all that the image depends on.

    form : versions, and how it is traced
    """
    digest = hashlib.sha256(f"{_FORM} {form} {size} {scene.head.centre_mm}".encode())
    digest_surroundings(digest, scene)
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


def kept_passes(key: str, size: tuple[int, int]) -> Passes | None:
    """The passes of that name, or None when there are none that can be read."""
    found = find(_FOLDER, key, ("mean", "spread", "mask", "notes", "count", "seconds"))
    if found is None or found["mean"].shape != (size[1], size[0], 3):
        return None
    notes = tuple(str(note) for note in found["notes"])
    moments = found["mean"], found["spread"], found["mask"]
    return Passes(*moments, notes, int(found["count"]), float(found["seconds"]))


def store_passes(key: str, passes: Passes) -> None:
    """Keep passes under a name; the disk may fail without harm, and a file is whole or not there."""
    keep(_FOLDER, key, {name: np.asarray(value) for name, value in vars(passes).items()})
