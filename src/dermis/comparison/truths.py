"""Images to judge techniques by, each with assumptions of its own."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.frame.renderer import Renderer
from dermis.frame.surface_points import SurfacePoints, irradiance_at, surface_points
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

if TYPE_CHECKING:
    from dermis.reference.irradiance_samples import IrradianceSamples

Floats = NDArray[np.float64]

_SPACING_MM, _FINEST_MM = 3.0, 0.2  # twice as coarse, a laser's stripe loses 1.5 % of its light
_HEAT_RADIUS_MM = 10.0
_LEAST_VARIANCE_MM2 = 0.25  # narrower Gaussians see no difference between straight lines and the surface
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
    started = time.perf_counter()
    seen = surface_points(subject.renderer, subject.scene, subject.settings)
    lit = irradiance_samples(subject)
    exitance = _straight(positions(subject, seen), lit, subject.profile.weight, subject.profile.variance_mm2)
    return _by_pixel(seen, exitance, started, f"{len(lit.positions):,} samples of irradiance")


def heat(subject: Subject, samples: int) -> Truth:
    """The same Gaussians as heat that spreads along the surface, around what the camera aims at.

    samples : of no account
    """
    return heat_around(subject, subject.scene.camera.target, _HEAT_RADIUS_MM, irradiance_samples(subject))


def heat_around(
    subject: Subject,
    place: tuple[float, float, float],
    radius_mm: float,
    lit: IrradianceSamples,
    least_mm2: float = _LEAST_VARIANCE_MM2,
) -> Truth:
    """The same Gaussians as heat that spreads along the surface, around what is seen nearest to a place.

    place : from the head's centre [mm]
    lit : of the whole head, see `irradiance_samples`
    least_mm2 : variance under which Gaussians are integrated by straight-line distance
    """
    from dermis.reference.refine import patch_of
    from dermis.reference.surface_diffusion import diffuse_on_surface

    started = time.perf_counter()
    narrow = subject.profile.variance_mm2 < least_mm2
    variances, weight = subject.profile.variance_mm2, subject.profile.weight
    seen = surface_points(subject.renderer, subject.scene, subject.settings)
    places = positions(subject, seen)
    middle = np.array(place) + subject.scene.head.centre_mm
    centre = places[np.linalg.norm(places - middle, axis=1).argmin()]
    patch = patch_of(subject.scene.head.mesh, centre, radius_mm, variances[~narrow])
    entered = _entered(subject, *patch.vertex_places())
    levels = diffuse_on_surface(patch.positions, patch.triangles, entered, variances[~narrow])
    fine, weights = patch.find(seen.triangle, seen.barycentric)
    on = (fine >= 0) & patch.holds(places)
    spread = np.einsum("knc,kc->nc", levels, weight[~narrow])
    exitance = patch.interpolate(spread, fine[on], weights[on])
    exitance += _straight(places[on], lit, weight[narrow], variances[narrow])
    mask = seen.mask.copy()
    mask[seen.mask] = on
    judged = SurfacePoints(mask, seen.triangle[on], seen.barycentric[on])
    straight = f"{narrow.sum()} Gaussians under {least_mm2:g} mm2 by straight lines"
    made = _by_pixel(judged, exitance, started, f"{radius_mm:g} mm around the middle; {straight}")
    return replace(made, through=False)


def irradiance_samples(subject: Subject) -> IrradianceSamples:
    """The light that enters all of the skin, as finely as the truths take it."""
    from dermis.reference.irradiance_samples import Places, sample_irradiance

    def light(places: Places) -> Floats:
        return _entered(subject, places.face, places.barycentric)

    return sample_irradiance(subject.scene.head.mesh, light, _SPACING_MM, _FINEST_MM)


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


def _entered(subject: Subject, triangle: NDArray[np.int64], barycentric: Floats) -> Floats:
    return irradiance_at(subject.renderer, subject.scene, subject.settings, triangle, barycentric)


def _straight(points: Floats, lit: IrradianceSamples, weight: Floats, variance_mm2: Floats) -> Floats:
    """(n, 3) what leaves at points under some Gaussians of the straight-line distance."""
    from dermis.reference.surface_integral import GaussianSum as Profile
    from dermis.reference.surface_integral import integrate

    if not len(variance_mm2):
        return np.zeros_like(points)
    return integrate(points, lit, Profile(weight, variance_mm2))


def positions(subject: Subject, seen: SurfacePoints) -> Floats:
    """(n, 3) where the pixels' middles meet the head [mm]."""
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
