"""Causes of the error of texture space against the surface integral."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import energy_ratio, relative_rmse
from dermis.apps.truths.radial_table import GaussianSum as Profile
from dermis.apps.truths.surface_integral import integrate_exitance
from dermis.apps.validation.comparisons.compare import comparison_subject
from dermis.apps.validation.comparisons.scenes import default_region
from dermis.apps.validation.comparisons.references import ComparisonSubject, ReferenceImage, surface_heat_around, irradiance_samples, hit_positions, surface_integral
from dermis.frame.surface_points import surface_points
from dermis.human.regions.labels import known_landmarks
from dermis.mesh.head import Head
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
LIGHTS = ("front", "back", "laser")
ATLASES = (512, 1024, 2048)
RADIUS_MM = 14.0
MIN_UNIFORM = 1e-3
MIN_VARIANCE_MM2 = 1.0  # of Gaussians for which the surface and straight lines differ
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
"""Places that are visible under a light, each the mean of its landmarks."""


def tables(head: Head, settings: Settings, adapter: str) -> dict[str, str]:
    """Return the tables by their names in docs/templates/techniques.md."""
    found: dict[str, list[str]] = {"by_atlas": [], "zero_width": [], "places": [], "even": []}
    for light in LIGHTS:
        with comparison_subject(head, light, default_region(light), "skin1", settings, adapter, "layered") as subject:
            straight, even = surface_integral(subject, 0), uniform_light(subject)
            fair = replace(straight, image=straight.image / np.maximum(even, MIN_UNIFORM))
            found["by_atlas"] += atlas_rows(subject, straight, fair, light)
            found["zero_width"].append(zero_width_row(subject, light))
            found["places"] += region_rows(subject, straight, light) if light in LANDMARKS_BY_REGION else []
            if light == "front":
                found["even"].append(mean_and_percentile(even[straight.mask]))
    return {name: "\n".join(rows) for name, rows in found.items()}


def render_technique(subject: ComparisonSubject, technique: str, **changes: object) -> Floats:
    """Return linear radiance at one sample a pixel without interreflection, as the truths have it."""
    alike = {"technique": technique, "samples": 1, "interreflection": False}
    chosen = subject.settings.model_dump() | alike | changes
    return subject.renderer.draw(subject.scene, Settings(**chosen)).linear().astype(np.float64)


def atlas_rows(subject: ComparisonSubject, straight: ReferenceImage, fair: ReferenceImage, light: str) -> list[str]:
    """Return rows of texture space by the size of its map, compared with no scattering, by two truths."""
    none, rows = render_technique(subject, "none"), []
    for side in ATLASES:
        image, cells = render_technique(subject, "texture-space", atlas=side), [light, str(side)]
        for truth in (straight, fair):
            error, most = (relative_rmse(one, truth.image, truth.mask).value for one in (image, none))
            energy = energy_ratio(image, truth.image, truth.mask).value
            cells += [f"{error:.4f}", f"{error / most:.2f}", f"{energy:.4f}"]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def zero_width_row(subject: ComparisonSubject, light: str) -> str:
    """Return the error of the truth's sampling: a profile of no width against the light that enters."""
    narrow = GaussianSum("narrow", np.array([0.05**2]), np.ones((1, 3)))
    truth = surface_integral(replace(subject, profile=narrow), 0)
    entered = render_technique(subject, "none") / subject.profile.albedo
    pair = (entered, truth.image, truth.mask)
    return f"| {light} | {relative_rmse(*pair).value:.4f} | {energy_ratio(*pair).value:.4f} |"


def uniform_light(subject: ComparisonSubject) -> Floats:
    """Return (h, w, 3) of the integral of light that is 1 everywhere; 1 beside the head."""
    lit = irradiance_samples(subject)
    evenly = replace(lit, irradiance=np.ones_like(lit.irradiance))
    seen = surface_points(subject.renderer, subject.scene, subject.settings)
    profile = Profile(subject.profile.weight / subject.profile.albedo, subject.profile.variance_mm2)
    image = np.ones((*seen.mask.shape, 3))
    image[seen.mask] = integrate_exitance(hit_positions(subject, seen), evenly, profile)
    return image


def mean_and_percentile(even: Floats) -> str:
    """Return the mean and 95th percentile by channel."""
    pairs = zip(even.mean(axis=0), np.percentile(even, 95, axis=0), strict=True)
    return ", ".join(f"{mean:.3f} ({high:.3f})" for mean, high in pairs)


def region_rows(subject: ComparisonSubject, straight: ReferenceImage, light: str) -> list[str]:
    """Return rows of the error by place, and how much of it a perfect map would leave."""
    landmarks = known_landmarks(subject.scene.head)
    assert landmarks is not None
    none, ours = render_technique(subject, "none"), render_technique(subject, "texture-space")
    on_map = render_technique(subject, "texture-space", transmission="none")
    lit, total = irradiance_samples(subject), ((ours - straight.image)[straight.mask] ** 2).sum()
    rows = []
    for place, names in LANDMARKS_BY_REGION[light].items():
        middle = tuple(np.mean([landmarks[name] for name in names], axis=0))
        heat = surface_heat_around(subject, middle, RADIUS_MM, lit, MIN_VARIANCE_MM2)
        share = ((ours - straight.image)[heat.mask] ** 2).sum() / total
        pixels = heat.mask.sum() / straight.mask.sum()
        errors = [
            relative_rmse(image, truth.image, heat.mask).value
            for truth, images in ((straight, (none, ours, heat.image)), (heat, (none, on_map)))
            for image in images
        ]
        cells = " | ".join(f"{error:.3f}" for error in errors)
        rows.append(f"| {light} | {place} | {100 * pixels:.1f} % | {100 * share:.0f} % | {cells} |")
    return rows
