"""Half-space of a medium as a head for path tracing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.path_traced import PathTraced, path_trace
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane
from dermis.optics.media import Layer, Medium
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]


def pan(side_mm: float, depth_mm: float, segments: int = 48) -> Head:
    """Return a square that faces +Z with a rim bent back by a depth and open behind."""
    flat = plane(side_mm, segments)
    rim = np.abs(flat.positions[:, :2]).max(axis=1) > 0.499 * side_mm
    places = flat.positions - np.outer(rim * np.float32(depth_mm), [0, 0, 1])
    return Head("pan", build_mesh(places, flat.uv, flat.triangles, flat.material, SKIN_MATERIALS), Maps())


def traced(
    head: Head, layers: tuple[Layer, ...], samples: int, *, degrees: float = 0.0, around: bool = False
) -> PathTraced:
    """Path-trace the middle of a pan lit along -Z with irradiance 1, or uniformly with radiance 1.

    degrees : of the view from the normal
    """
    middle = -np.array(head.centre_mm)
    view = np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])
    camera = Camera(position=tuple(middle + 300.0 * view), target=tuple(middle), frame_mm=1.0)
    lights = () if around else (DirectionalLight(direction=(0, 0, -1), irradiance=(1, 1, 1)),)
    environment = Environment(name="uniform") if around else None
    scene = Scene(head, lights=lights, camera=camera, environment=environment)
    return path_trace(scene, Medium("pan", layers, eta=1.0), samples, Settings(size=(16, 16)))


def mean_and_error(image: PathTraced) -> tuple[Floats, Floats]:
    """Return the mean (3,) of an image whose pixels all show the same, and its standard error."""
    count = image.mask.size
    variance = image.variance.astype(np.float64).sum(axis=(0, 1)) / count**2
    return image.image.astype(np.float64).mean(axis=(0, 1)), np.sqrt(variance)
