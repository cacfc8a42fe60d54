"""Images to judge techniques by, each with its own assumptions."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.renderer import Renderer
from dermis.frame.surface_points import SurfacePoints, irradiance_at, surface_points
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import DirectionName

if TYPE_CHECKING:
    from dermis.apps.truths.irradiance_samples import IrradianceSamples
    from dermis.apps.truths.path_traced import PathTraced

Floats = NDArray[np.float64]

_SPACING_MM, _FINEST_MM = 3.0, 0.2  # twice as coarse, a laser's stripe loses 1.5 % of its light
_HEAT_RADIUS_MM = 10.0
_MIN_VARIANCE_MM2 = 0.25  # for narrower Gaussians the surface is as good as flat
_FULL_COVERAGE = 0.999  # share of a pixel
SAMPLES_PER_PIXEL = 16


@dataclass(frozen=True)
class ComparisonSubject:
    """What is judged: a scene, its skin's profile and medium, and the settings of its image."""

    renderer: Renderer
    scene: Scene
    profile: GaussianSum
    medium: Medium
    settings: Settings


@dataclass(frozen=True)
class ReferenceImage:
    """An image and how far it may be trusted.

    image, variance : (h, w, 3) radiance and the variance of its noise
    mask : (h, w) pixels to judge
    subpixels : samples of each pixel that a technique's image needs for a fair comparison
    seconds : that it took
    notes : for the reader
    through : whether it includes light through thin parts
    between : whether it includes light from skin to skin through the air
    direction : of `Skin`, by which light enters and leaves in it
    """

    image: Floats
    variance: Floats
    mask: NDArray[np.bool_]
    subpixels: int
    seconds: float
    notes: tuple[str, ...] = ()
    through: bool = True
    between: bool = True
    direction: DirectionName = "lambertian"


def surface_integral(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Integrate the same profile of straight-line distance over the surface: shows the error of the map.

    samples : ignored
    """
    started = time.perf_counter()
    seen = surface_points(subject.renderer, subject.scene, subject.settings)
    lit = irradiance_samples(subject)
    exitance = _euclidean_exitance(hit_positions(subject, seen), lit, subject.profile.weight, subject.profile.variance_mm2)
    return _image_of_points(seen, exitance, started, f"{len(lit.positions):,} samples of irradiance")


def surface_heat(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Diffuse the same Gaussians along the surface like heat, around the camera's target.

    samples : ignored
    """
    return surface_heat_around(subject, subject.scene.camera.target, _HEAT_RADIUS_MM, irradiance_samples(subject))


def surface_heat_around(
    subject: ComparisonSubject,
    place: tuple[float, float, float],
    radius_mm: float,
    lit: IrradianceSamples,
    least_mm2: float = _MIN_VARIANCE_MM2,
) -> ReferenceImage:
    """Diffuse the same Gaussians along the surface like heat, around the visible point nearest to a place.

    place : from the head's centre [mm]
    lit : of the whole head, see `irradiance_samples`
    least_mm2 : variance below which Gaussians are integrated by straight-line distance
    """
    from dermis.apps.truths.surface_diffusion import diffuse_on_surface
    from dermis.apps.truths.surface_patch import mesh_patch

    started = time.perf_counter()
    narrow = subject.profile.variance_mm2 < least_mm2
    variances, weight = subject.profile.variance_mm2, subject.profile.weight
    seen = surface_points(subject.renderer, subject.scene, subject.settings)
    places = hit_positions(subject, seen)
    middle = np.array(place) + subject.scene.head.centre_mm
    centre = places[np.linalg.norm(places - middle, axis=1).argmin()]
    patch = mesh_patch(subject.scene.head.mesh, centre, radius_mm, variances[~narrow])
    entered = _incident_irradiance(subject, *patch.vertex_barycentrics())
    levels = diffuse_on_surface(patch.positions, patch.triangles, entered, variances[~narrow])
    fine, weights = patch.locate(seen.triangle, seen.barycentric)
    on = (fine >= 0) & patch.contains(places)
    spread = np.einsum("knc,kc->nc", levels, weight[~narrow])
    exitance = patch.interpolate(spread, fine[on], weights[on])
    exitance += _euclidean_exitance(places[on], lit, weight[narrow], variances[narrow])
    mask = seen.mask.copy()
    mask[seen.mask] = on
    judged = SurfacePoints(mask, seen.triangle[on], seen.barycentric[on])
    straight = f"{narrow.sum()} Gaussians under {least_mm2:g} mm2 by straight lines"
    made = _image_of_points(judged, exitance, started, f"{radius_mm:g} mm around the middle; {straight}")
    return replace(made, through=False)


def irradiance_samples(subject: ComparisonSubject) -> IrradianceSamples:
    """Return the light that enters all of the skin, sampled as finely as the truths need it."""
    from dermis.apps.truths.irradiance_samples import MeshPoints, sample_irradiance

    def light(places: MeshPoints) -> Floats:
        return _incident_irradiance(subject, places.face, places.barycentric)

    return sample_irradiance(subject.scene.head.mesh, light, _SPACING_MM, _FINEST_MM)


def path_traced_reference(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Trace paths through the medium itself, free of errors of the profile and of diffuse surfaces.

    samples : paths through each pixel
    """
    from dermis.apps.truths.path_traced import path_trace

    made = path_trace(subject.scene, subject.medium, samples, subject.settings)
    truth = _reference_image(made, f"{made.samples} paths a pixel")
    return replace(truth, direction="half-space")


def cycles_reference(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Render by Cycles with random walks through the medium: a peer, not the truth.

    samples : paths through each pixel
    """
    from dermis.apps.truths.cycles import cycles_render

    made = cycles_render(subject.scene, subject.medium, samples, subject.settings)
    return _reference_image(made, f"{made.samples} paths a pixel, random walk")


REFERENCES: dict[str, Callable[[ComparisonSubject, int], ReferenceImage]] = {
    "surface-integral": surface_integral,
    "heat": surface_heat,
    "path-traced": path_traced_reference,
    "cycles": cycles_reference,
}


def _reference_image(made: PathTraced, *notes: str) -> ReferenceImage:
    image, variance = made.image.astype(np.float64), made.variance.astype(np.float64)
    return ReferenceImage(image, variance, made.mask > _FULL_COVERAGE, SAMPLES_PER_PIXEL, made.seconds, (*notes, *made.notes))


def _incident_irradiance(subject: ComparisonSubject, triangle: NDArray[np.int64], barycentric: Floats) -> Floats:
    return irradiance_at(subject.renderer, subject.scene, subject.settings, triangle, barycentric)


def _euclidean_exitance(points: Floats, lit: IrradianceSamples, weight: Floats, variance_mm2: Floats) -> Floats:
    """Return (n, 3) radiant exitance at points by Gaussians of the straight-line distance."""
    from dermis.apps.truths.radial_table import GaussianSum as Profile
    from dermis.apps.truths.surface_integral import integrate_exitance

    if not len(variance_mm2):
        return np.zeros_like(points)
    return integrate_exitance(points, lit, Profile(weight, variance_mm2))


def hit_positions(subject: ComparisonSubject, seen: SurfacePoints) -> Floats:
    """Return (n, 3) where rays through the pixels' centres meet the head [mm]."""
    mesh = subject.scene.head.mesh
    corners = mesh.positions[mesh.triangles[seen.triangle]].astype(np.float64)
    return np.asarray(np.einsum("nk,nkc->nc", seen.barycentric, corners))


def _image_of_points(seen: SurfacePoints, exitance: Floats, started: float, note: str) -> ReferenceImage:
    image = np.zeros((*seen.mask.shape, 3))
    image[seen.mask] = exitance / np.pi
    return ReferenceImage(
        image, np.zeros_like(image), seen.mask, 1, time.perf_counter() - started, (note,), between=False
    )


def check_visible(mask: NDArray[np.bool_]) -> None:
    """Raises DermisError when there is no pixel to judge."""
    if not mask.any():
        expected = "a pixel that shows nothing but the head"
        refuse("the picture", expected, "there is none", "Choose a larger size or another region")
