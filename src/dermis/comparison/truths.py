"""Images to judge techniques by, each with assumptions of its own."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Medium
from dermis.rendering.renderer import Renderer
from dermis.rendering.surface_points import SurfacePoints, irradiance_at, surface_points
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]

_SPACING_MM, _FINEST_MM = 3.0, 0.4
_HEAT_RADIUS_MM = 10.0
_LEAST_VARIANCE_MM2 = 0.25  # narrower Gaussians are taken to leave the light where it is
SUBPIXELS = 16


@dataclass(frozen=True)
class Subject:
    """What is judged: a scene, what its skin is made of, and how large its image is."""

    renderer: Renderer
    scene: Scene
    profile: GaussianSum
    medium: Medium
    settings: Settings


@dataclass(frozen=True)
class Truth:
    """An image and how far it may be trusted.

    image, variance : (h, w, 3) radiance and the variance of its noise
    mask : (h, w) pixels to judge
    subpixels : samples of each pixel that an image should have to be compared with it
    seconds : that it took
    notes : for the reader
    through : whether light also takes the way through thin parts
    """

    image: Floats
    variance: Floats
    mask: NDArray[np.bool_]
    subpixels: int
    seconds: float
    notes: tuple[str, ...] = ()
    through: bool = True


def surface_integral(subject: Subject, samples: int) -> Truth:
    """The same profile by distance in space, integrated over the surface: what is left is the map's error.

    samples : of no account
    """
    from dermis.reference.surface_integral import GaussianSum as Profile
    from dermis.reference.surface_integral import Places, integrate, sample_irradiance

    started = time.perf_counter()
    renderer, scene, settings = subject.renderer, subject.scene, subject.settings
    mesh = scene.head.mesh

    def light(places: Places) -> Floats:
        return irradiance_at(renderer, scene, settings, places.face, places.barycentric)

    lit = sample_irradiance(mesh, light, _SPACING_MM, _FINEST_MM)
    seen = surface_points(renderer, scene, settings)
    profile = Profile(subject.profile.weight, subject.profile.variance_mm2)
    exitance = integrate(_positions(subject, seen), lit, profile)
    return _by_pixel(seen, exitance, started, f"{len(lit.positions):,} samples of irradiance")


def heat(subject: Subject, samples: int) -> Truth:
    """The same Gaussians as heat that spreads along the surface, around what the camera aims at.

    samples : of no account
    """
    from dermis.reference.map_error import patch_of
    from dermis.reference.surface_diffusion import diffuse_on_surface

    started = time.perf_counter()
    renderer, scene, settings = subject.renderer, subject.scene, subject.settings
    narrow = subject.profile.variance_mm2 < _LEAST_VARIANCE_MM2
    variances, weight = subject.profile.variance_mm2[~narrow], subject.profile.weight
    seen = surface_points(renderer, scene, settings)
    check_seen(seen.mask)
    places = _positions(subject, seen)
    target = np.array(scene.camera.target) + scene.head.centre_mm
    centre = places[np.linalg.norm(places - target, axis=1).argmin()]
    patch = patch_of(scene.head.mesh, centre, _HEAT_RADIUS_MM, variances)
    entered = irradiance_at(renderer, scene, settings, *patch.vertex_places())
    levels = diffuse_on_surface(patch.positions, patch.triangles, entered, variances)
    exitance = weight[narrow].sum(axis=0) * entered + np.einsum("knc,kc->nc", levels, weight[~narrow])
    fine, weights = patch.find(seen.triangle, seen.barycentric)
    on = (fine >= 0) & patch.holds(places)
    mask = seen.mask.copy()
    mask[seen.mask] = on
    judged = SurfacePoints(mask, seen.triangle[on], seen.barycentric[on])
    kept = f"{narrow.sum()} Gaussians under {_LEAST_VARIANCE_MM2:g} mm2 kept in place"
    note = f"{_HEAT_RADIUS_MM:g} mm around the middle; {kept}"
    made = _by_pixel(judged, patch.interpolate(exitance, fine[on], weights[on]), started, note)
    return replace(made, through=False)


def path_traced(subject: Subject, samples: int) -> Truth:
    """Light through the medium itself: the profile's and the diffuse surface's error included.

    samples : paths through each pixel
    """
    from dermis.reference.path_traced import path_trace

    traced = path_trace(subject.scene, subject.medium, samples, subject.settings)
    covered = traced.mask > 0.999
    notes = (f"{traced.samples} paths a pixel", *traced.notes)
    image, variance = traced.image.astype(np.float64), traced.variance.astype(np.float64)
    return Truth(image, variance, covered, SUBPIXELS, traced.seconds, notes)


def cycles(subject: Subject, samples: int) -> Truth:
    """What Blender's Cycles makes of the medium by random walks: a peer, not the truth.

    samples : paths through each pixel
    """
    from dermis.reference.cycles import cycles_render

    made = cycles_render(subject.scene, subject.medium, samples, subject.settings)
    image, variance = made.image.astype(np.float64), made.variance.astype(np.float64)
    note = f"{made.samples} paths a pixel, random walk"
    return Truth(image, variance, made.coverage > 0.999, SUBPIXELS, made.seconds, (note,))


TRUTHS: dict[str, Callable[[Subject, int], Truth]] = {
    "surface-integral": surface_integral,
    "heat": heat,
    "path-traced": path_traced,
    "cycles": cycles,
}


def _positions(subject: Subject, seen: SurfacePoints) -> Floats:
    mesh = subject.scene.head.mesh
    corners = mesh.positions[mesh.triangles[seen.triangle]].astype(np.float64)
    return np.asarray(np.einsum("nk,nkc->nc", seen.barycentric, corners))


def _by_pixel(seen: SurfacePoints, exitance: Floats, started: float, note: str) -> Truth:
    image = np.zeros((*seen.mask.shape, 3))
    image[seen.mask] = exitance / np.pi
    return Truth(image, np.zeros_like(image), seen.mask, 1, time.perf_counter() - started, (note,))


def check_seen(mask: NDArray[np.bool_]) -> None:
    """Raises DermisError when there is no pixel to judge."""
    if not mask.any():
        expected = "a pixel that shows nothing but the head"
        refuse("the picture", expected, "there is none", "Choose a larger size or another region")


def matched(medium: Medium) -> Medium:
    """The medium without a surface that refracts, as all truths take it."""
    return replace(medium, eta=1.0)
