"""Reference images for scattering techniques, each computed under its own assumptions."""

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
from dermis.scene.skin import DiffuseDirectionName

if TYPE_CHECKING:
    from dermis.apps.truths.irradiance_samples import IrradianceSamples
    from dermis.apps.truths.path_traced import PathTraced

Floats = NDArray[np.float64]

# Spacing of irradiance samples, and the least spacing, at sharp edges. At twice the spacing, a laser's stripe
# loses 1.5 % of its light.
_SAMPLE_SPACING_MM, _MIN_SAMPLE_SPACING_MM = 3.0, 0.2
_HEAT_PATCH_RADIUS_MM = 10.0
_MIN_VARIANCE_MM2 = 0.25  # for narrower Gaussians the surface is nearly flat
_FULL_COVERAGE = 0.999  # fraction of a pixel from which it counts as covered
SAMPLES_PER_PIXEL = 16


@dataclass(frozen=True)
class ComparisonSubject:
    """Scene in which techniques are compared, with its renderer and settings.

    profile : diffusion profile of the skin
    medium : scattering medium of the skin, which has this profile
    """

    renderer: Renderer
    scene: Scene
    profile: GaussianSum
    medium: Medium
    settings: Settings


@dataclass(frozen=True)
class ReferenceImage:
    """Reference image, the variance of its noise, and the assumptions under which it was computed.

    image : (h, w, 3) linear radiance
    variance : (h, w, 3) variance of the noise of `image`
    mask : (h, w) pixels to compare
    samples : samples per pixel at which techniques must be rendered for the comparison with this image
    seconds : duration of the computation [s]
    notes : sentences for the report
    has_translucency : whether the image includes light transmitted through ears and other thin parts
    has_interreflection : whether the image includes light that one part of the head reflects to another
    direction : angular distribution of the light that leaves the skin, as in `Skin`
    """

    image: Floats
    variance: Floats
    mask: NDArray[np.bool_]
    samples: int
    seconds: float
    notes: tuple[str, ...] = ()
    has_translucency: bool = True
    has_interreflection: bool = True
    direction: DiffuseDirectionName = "lambertian"


def surface_integral(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Return the reference image in which the product of irradiance and profile is integrated.

    At each pixel, the integral extends over the whole surface of the head.

    The profile is a function of Euclidean distance.

    samples : ignored, because the integral has no noise
    """
    started = time.perf_counter()
    visible = surface_points(subject.renderer, subject.scene, subject.settings)
    light, profile = irradiance_samples(subject), subject.profile
    exitance = _integrate_gaussians(
        hit_positions(subject, visible), light, profile.weight, profile.variance_mm2
    )
    return _image_of_points(visible, exitance, started, f"{len(light.positions):,} irradiance samples")


def heat_equation_reference(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Return the reference image in which the irradiance diffuses according to the heat equation.

    Light diffuses along the surface. Only the skin around the camera's target is computed.

    samples : ignored, because the solution has no noise
    """
    target = subject.scene.camera.target
    return heat_equation_patch_reference(subject, target, _HEAT_PATCH_RADIUS_MM, irradiance_samples(subject))


def heat_equation_patch_reference(
    subject: ComparisonSubject,
    target_mm: tuple[float, float, float],
    radius_mm: float,
    surface_irradiance: IrradianceSamples,
    min_variance_mm2: float = _MIN_VARIANCE_MM2,
) -> ReferenceImage:
    """Return the reference image in which light diffuses according to the heat equation, in a round patch.

    For each Gaussian of the profile, light diffuses along the surface for a time proportional to the variance
    of the Gaussian. The results are added with the weights of the Gaussians.

    target_mm : point relative to the head's centre; the nearest visible point is the centre of the patch [mm]
    radius_mm : radius of the patch in which pixels are compared [mm]
    surface_irradiance : samples of the irradiance on the whole head, see `irradiance_samples`
    min_variance_mm2 : variance below which Gaussians are integrated by Euclidean distance instead [mm2]
    """
    from dermis.apps.truths.surface_diffusion import diffuse_on_surface
    from dermis.apps.truths.surface_patch import mesh_patch

    started = time.perf_counter()
    narrow = subject.profile.variance_mm2 < min_variance_mm2
    variances, weight = subject.profile.variance_mm2, subject.profile.weight
    visible = surface_points(subject.renderer, subject.scene, subject.settings)
    points = hit_positions(subject, visible)
    target = np.array(target_mm) + subject.scene.head.centre_mm
    centre = points[np.linalg.norm(points - target, axis=1).argmin()]
    patch = mesh_patch(subject.scene.head.mesh, centre, radius_mm, variances[~narrow])
    irradiance = _irradiance_at_points(subject, *patch.vertex_barycentrics())
    levels = diffuse_on_surface(patch.positions, patch.triangles, irradiance, variances[~narrow])
    fine, weights = patch.locate(visible.triangle, visible.barycentric)
    inside = (fine >= 0) & patch.contains(points)
    diffused = np.einsum("knc,kc->nc", levels, weight[~narrow])
    exitance = patch.interpolate(diffused, fine[inside], weights[inside])
    exitance += _integrate_gaussians(points[inside], surface_irradiance, weight[narrow], variances[narrow])
    mask = visible.mask.copy()
    mask[visible.mask] = inside
    compared = SurfacePoints(mask, visible.triangle[inside], visible.barycentric[inside])
    note = f"{radius_mm:g} mm around the middle; {narrow.sum()} Gaussians under {min_variance_mm2:g} mm2 "
    note += "by Euclidean distance"
    return replace(_image_of_points(compared, exitance, started, note), has_translucency=False)


def irradiance_samples(subject: ComparisonSubject) -> IrradianceSamples:
    """Return samples of the irradiance on the whole head, as dense as the references need."""
    from dermis.apps.truths.irradiance_samples import MeshPoints, sample_irradiance

    def irradiance_at_points(points: MeshPoints) -> Floats:
        return _irradiance_at_points(subject, points.face, points.barycentric)

    return sample_irradiance(
        subject.scene.head.mesh, irradiance_at_points, _SAMPLE_SPACING_MM, _MIN_SAMPLE_SPACING_MM
    )


def path_traced_reference(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Return the reference image obtained by path tracing in the medium, without a diffusion profile.

    samples : paths per pixel
    """
    from dermis.apps.truths.path_traced import path_trace

    traced = path_trace(subject.scene, subject.medium, samples, subject.settings)
    return replace(_reference_image(traced, f"{traced.samples} paths per pixel"), direction="half-space")


def cycles_reference(subject: ComparisonSubject, samples: int) -> ReferenceImage:
    """Return the image that Cycles renders with random walks through the medium.

    samples : paths per pixel
    """
    from dermis.apps.truths.cycles import cycles_render

    traced = cycles_render(subject.scene, subject.medium, samples, subject.settings)
    return _reference_image(traced, f"{traced.samples} paths per pixel, random walk")


REFERENCES: dict[str, Callable[[ComparisonSubject, int], ReferenceImage]] = {
    "surface-integral": surface_integral,
    "heat": heat_equation_reference,
    "path-traced": path_traced_reference,
    "cycles": cycles_reference,
}


def _reference_image(path_traced_picture: PathTraced, *notes: str) -> ReferenceImage:
    image, variance = (
        path_traced_picture.image.astype(np.float64),
        path_traced_picture.variance.astype(np.float64),
    )
    mask, notes = path_traced_picture.mask > _FULL_COVERAGE, (*notes, *path_traced_picture.notes)
    return ReferenceImage(image, variance, mask, SAMPLES_PER_PIXEL, path_traced_picture.seconds, notes)


def _irradiance_at_points(
    subject: ComparisonSubject, triangle: NDArray[np.int64], barycentric: Floats
) -> Floats:
    return irradiance_at(subject.renderer, subject.scene, subject.settings, triangle, barycentric)


def _integrate_gaussians(
    points: Floats, irradiance: IrradianceSamples, gaussian_weight: Floats, variance_mm2: Floats
) -> Floats:
    """Return the radiant exitance (n, 3) at points by integrating Gaussians of the Euclidean distance.

    points : (n, 3) positions [mm]
    irradiance : irradiance on the surface
    gaussian_weight : (k, 3) weights of the Gaussians
    variance_mm2 : (k,) variances of the Gaussians [mm^2]
    """
    from dermis.apps.truths.radial_table import GaussianSum as Profile
    from dermis.apps.truths.surface_integral import integrate_exitance

    if not len(variance_mm2):
        return np.zeros_like(points)
    return integrate_exitance(points, irradiance, Profile(gaussian_weight, variance_mm2))


def hit_positions(subject: ComparisonSubject, visible_points: SurfacePoints) -> Floats:
    """Return the positions (n, 3) where rays through pixel centres meet the head [mm].

    visible_points : triangle and barycentric weights of each position
    """
    mesh = subject.scene.head.mesh
    corners = mesh.positions[mesh.triangles[visible_points.triangle]].astype(np.float64)
    return np.asarray(np.einsum("nk,nkc->nc", visible_points.barycentric, corners))


def _image_of_points(
    visible_points: SurfacePoints, exitance: Floats, start_time_s: float, assumption: str
) -> ReferenceImage:
    image = np.zeros((*visible_points.mask.shape, 3))
    image[visible_points.mask] = exitance / np.pi
    seconds, noise = time.perf_counter() - start_time_s, np.zeros_like(image)
    return ReferenceImage(
        image, noise, visible_points.mask, 1, seconds, (assumption,), has_interreflection=False
    )


def require_visible_pixels(mask: NDArray[np.bool_]) -> None:
    """Raise DermisError when no pixel can be compared.

    mask : (h, w) pixels that show nothing but the head
    """
    if not mask.any():
        expected = "a pixel that shows nothing but the head"
        refuse("the picture", expected, "there is none", "Choose a larger size or another region")
