"""Causes of the difference between texture-space diffusion and the surface integral.

The surface integral is a reference for scattered light: at each pixel, the product of irradiance and
diffusion profile is integrated over the surface of the head.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import energy_ratio, relative_rmse
from dermis.apps.truths.radial_table import GaussianSum as Profile
from dermis.apps.truths.surface_integral import integrate_exitance
from dermis.apps.validation.comparisons.compare import comparison_subject
from dermis.apps.validation.comparisons.references import (
    ComparisonSubject,
    ReferenceImage,
    heat_equation_patch_reference,
    hit_positions,
    irradiance_samples,
    surface_integral,
)
from dermis.apps.validation.comparisons.scenes import default_region
from dermis.frame.surface_points import surface_points
from dermis.human.regions.labels import known_landmarks
from dermis.mesh.head import Head
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
COMPARED_LIGHTS = ("front", "back", "laser")
ATLAS_SIDES = (512, 1024, 2048)
REGION_RADIUS_MM = 14.0
MIN_UNIFORM_LIGHT_INTEGRAL = 1e-3
MIN_VARIANCE_MM2 = 1.0  # of Gaussians for which Euclidean and surface distance differ
LANDMARKS_BY_REGION: dict[str, dict[str, tuple[str, ...]]] = {
    "front": {
        "closed lid": ("left inner eye corner", "left outer eye corner"),
        "ear": ("left ear top", "left ear lobe", "left tragus"),
        "nostril": ("left nose wing",),
        "mouth": ("stomion",),
        "chin": ("pogonion",),
    },
    "back": {"ear": ("left ear top", "left ear lobe", "left ear back")},
}
"""Landmarks of each region, by light and then by region; the mean of the landmarks is the region's centre.

The regions are visible in the pictures rendered under the light.
"""


def texture_space_error_tables(head: Head, settings: Settings, adapter: str) -> dict[str, str]:
    """Return texts on errors of texture-space diffusion and of its reference, the surface integral.

    The texts are keyed by the placeholders of docs/templates/techniques.md that they replace.
    """
    rows: dict[str, list[str]] = {"by_atlas": [], "zero_width": [], "places": [], "even": []}
    for light in COMPARED_LIGHTS:
        region = default_region(light)
        with comparison_subject(head, light, region, "skin1", settings, adapter, "layered") as subject:
            integral, uniform = surface_integral(subject, 0), uniform_light_integral(subject)
            normalised = replace(
                integral, image=integral.image / np.maximum(uniform, MIN_UNIFORM_LIGHT_INTEGRAL)
            )
            rows["by_atlas"] += atlas_rows(subject, integral, normalised, light)
            rows["zero_width"].append(narrow_profile_row(subject, light))
            rows["places"] += region_rows(subject, integral, light) if light in LANDMARKS_BY_REGION else []
            if light == "front":
                rows["even"].append(mean_and_percentile_text(uniform[integral.mask]))
    return {name: "\n".join(lines) for name, lines in rows.items()}


def render_technique(subject: ComparisonSubject, technique: str, **changed_settings: object) -> Floats:
    """Render the subject's scene with a scattering technique, and return the linear radiance (h, w, 3).

    Like the reference images with which it is compared, the image has one sample per pixel and no
    interreflection.

    changed_settings : settings that replace those of the subject
    """
    fixed_settings = {"technique": technique, "samples": 1, "interreflection": False}
    values = subject.settings.model_dump() | fixed_settings | changed_settings
    image = subject.renderer.draw(subject.scene, Settings(**values)).linear()
    return np.asarray(image, np.float64)


def atlas_rows(
    subject: ComparisonSubject,
    integral_image: ReferenceImage,
    normalised_image: ReferenceImage,
    light_name: str,
) -> list[str]:
    """Return Markdown rows with errors of texture-space diffusion by atlas size, against two references.

    Each error is also given as a ratio to the error of an image without scattering.

    integral_image : surface integral
    normalised_image : surface integral divided by the surface integral under uniform light
    """
    unscattered, rows = render_technique(subject, "none"), []
    for side in ATLAS_SIDES:
        image, cells = render_technique(subject, "texture-space", atlas=side), [light_name, str(side)]
        for reference in (integral_image, normalised_image):
            pair = reference.image, reference.mask
            error, worst = (relative_rmse(one, *pair).value for one in (image, unscattered))
            cells += [f"{error:.4f}", f"{error / worst:.2f}", f"{energy_ratio(image, *pair).value:.4f}"]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def narrow_profile_row(subject: ComparisonSubject, light_name: str) -> str:
    """Return a Markdown row with the sampling error of the surface integral.

    With a very narrow profile, the exact integral equals the irradiance. The row therefore compares the
    sampled integral with the irradiance.
    """
    narrow_profile = GaussianSum("narrow", np.array([0.05**2]), np.ones((1, 3)))
    reference = surface_integral(replace(subject, profile=narrow_profile), 0)
    incident = render_technique(subject, "none") / subject.profile.albedo
    pair = (incident, reference.image, reference.mask)
    return f"| {light_name} | {relative_rmse(*pair).value:.4f} | {energy_ratio(*pair).value:.4f} |"


def uniform_light_integral(subject: ComparisonSubject) -> Floats:
    """Return the surface integral at each pixel (h, w, 3) for an irradiance and an albedo of 1.

    On a flat surface, it would be 1.
    """
    samples = irradiance_samples(subject)
    uniform_samples = replace(samples, irradiance=np.ones_like(samples.irradiance))
    visible = surface_points(subject.renderer, subject.scene, subject.settings)
    profile = Profile(subject.profile.weight / subject.profile.albedo, subject.profile.variance_mm2)
    image = np.ones((*visible.mask.shape, 3))
    image[visible.mask] = integrate_exitance(hit_positions(subject, visible), uniform_samples, profile)
    return image


def mean_and_percentile_text(uniform_integral: Floats) -> str:
    """Return text with the mean and the 95th percentile of each channel.

    uniform_integral : (n, 3) result of `uniform_light_integral` at n pixels
    """
    pairs = zip(uniform_integral.mean(axis=0), np.percentile(uniform_integral, 95, axis=0), strict=True)
    return ", ".join(f"{mean:.3f} ({high:.3f})" for mean, high in pairs)


def region_rows(subject: ComparisonSubject, integral_image: ReferenceImage, light_name: str) -> list[str]:
    """Return Markdown rows with errors of texture-space diffusion, one row per region of the face.

    For comparison, each row also has the error of the heat equation on the surface.
    """
    landmarks = known_landmarks(subject.scene.head)
    assert landmarks is not None
    none, ours = render_technique(subject, "none"), render_technique(subject, "texture-space")
    opaque = render_technique(subject, "texture-space", transmission="none")
    samples, total = (
        irradiance_samples(subject),
        ((ours - integral_image.image)[integral_image.mask] ** 2).sum(),
    )
    rows = []
    for region, names in LANDMARKS_BY_REGION[light_name].items():
        centre = tuple(np.mean([landmarks[name] for name in names], axis=0))
        heat = heat_equation_patch_reference(subject, centre, REGION_RADIUS_MM, samples, MIN_VARIANCE_MM2)
        fraction = ((ours - integral_image.image)[heat.mask] ** 2).sum() / total
        pixels = heat.mask.sum() / integral_image.mask.sum()
        errors = [
            relative_rmse(image, reference.image, heat.mask).value
            for reference, images in ((integral_image, (none, ours, heat.image)), (heat, (none, opaque)))
            for image in images
        ]
        cells = " | ".join(f"{error:.3f}" for error in errors)
        rows.append(f"| {light_name} | {region} | {100 * pixels:.1f} % | {100 * fraction:.0f} % | {cells} |")
    return rows
