"""Reflection of a half-space with index of refraction 1.4, by direction, for docs/techniques.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.half_space import reflected_radiance
from dermis.base.console import print_lines
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.optics.angular_response import (
    angular_response,
    critical_cosine,
    directional_reflectance,
    gauss_legendre,
    internal_reflectance,
    mean_single_scattering_kernel,
    refracted_cosine,
)
from dermis.optics.media import published_media
from dermis.scene import Scene, Settings, Skin
from dermis.scene.heads import load_head

Floats = NDArray[np.float64]
SKIN_IOR, OBLIQUE_COSINE = 1.4, 0.15  # cosine of 81 degrees
PHOTON_COUNT = 200_000
FORWARD_G = 0.8  # mean cosine of scattering in real skin
_MIN_PHOTON_WEIGHT = 0.01
_QUADRATURE_NODE_COUNT = 48


def print_half_space_table(adapter: str = "auto") -> None:
    """Print a table that shows how the reflection of skin depends on the directions of light and view."""
    print_lines(direction_table(load_head("lee_perry_smith", subdivide=0), adapter))


def direction_table(head: Head, adapter: str) -> str:
    """Return a Markdown table that shows how the reflection of skin depends on direction.

    The table also has the errors of the directional models "lambertian" and "half-space".

    head : head that is rendered in studio light for the last two rows
    """
    layer = published_media()["skin1"].layers[0]
    albedo = layer.sigma_s_prime / (layer.sigma_a + layer.sigma_s_prime)
    forward = layer.sigma_s_prime / (layer.sigma_a * (1.0 - FORWARD_G) + layer.sigma_s_prime)
    median, high = _studio_brightness_ratios(head, adapter)
    oblique, errors = "light from 81° over light from above", "relative RMSE over all pairs of directions"
    photons = f"photons of mean cosine {FORWARD_G:g}"
    rows: dict[str, Sequence[float]] = {
        f"{oblique}, index-matched": [_oblique_to_normal_ratio(one, 1.0) for one in albedo],
        f"{oblique}, index {SKIN_IOR:g}": [_oblique_to_normal_ratio(one, SKIN_IOR) for one in albedo],
        "the same, photons": [_monte_carlo_oblique_ratio(one, 0.0, SKIN_IOR) for one in albedo],
        f"the same, {photons}": [_monte_carlo_oblique_ratio(one, FORWARD_G, SKIN_IOR) for one in forward],
        f"index-matched, {photons}": [_monte_carlo_oblique_ratio(one, FORWARD_G, 1.0) for one in forward],
        f"{errors}, lambertian": [_direction_errors(one)[0] for one in albedo],
        f"{errors}, half-space": [_direction_errors(one)[1] for one in albedo],
        "default skin in the studio over lambertian, median": median,
        "the same, a hundredth of it more than": high,
    }
    lines = ["|  | red | green | blue |", "|---|---|---|---|"]
    for name, row in rows.items():
        lines.append(f"| {name} | " + " | ".join(f"{value:.3f}" for value in row) + " |")
    return "\n".join(lines)


def _oblique_to_normal_ratio(albedo: float, eta: float) -> float:
    oblique, above = directional_reflectance([OBLIQUE_COSINE, 1.0], albedo, eta)
    return float(oblique / above)


def _direction_errors(albedo: float) -> tuple[float, float]:
    """Return the relative RMS errors of the directional models "lambertian" and "half-space" [-].

    The errors are averaged over the directions of light and view. The reference starts from the exact
    solution for a half-space without a reflecting surface. It then accounts for refraction and for all
    orders of internal reflection at the surface.

    albedo : single-scattering albedo [-]
    """
    critical = critical_cosine(SKIN_IOR)
    trapped, escaping = (
        gauss_legendre(*ends, _QUADRATURE_NODE_COUNT) for ends in ((0.0, critical), (critical, 1.0))
    )
    mu, weight = (np.concatenate(both) for both in zip(trapped, escaping, strict=True))
    reflectance, flux = internal_reflectance(mu, SKIN_IOR), 2.0 * weight * mu
    index_matched = np.pi * reflected_radiance(mu[None], mu[:, None], albedo)
    inside = np.linalg.solve(np.eye(len(mu)) - index_matched * flux * reflectance, index_matched)
    free = slice(_QUADRATURE_NODE_COUNT, None)  # nodes of directions that leave, of both light and view
    transmittance, area = (1.0 - reflectance)[free], flux[free] / flux[free].sum()
    exact = inside[free, free] * transmittance[:, None] / SKIN_IOR**2
    above = float(directional_reflectance(1.0, albedo, SKIN_IOR))
    lambertian = np.outer(transmittance / (area @ transmittance), np.full(_QUADRATURE_NODE_COUNT, above))
    response = angular_response([above], SKIN_IOR)
    cosine = np.sqrt(1.0 - SKIN_IOR**2 * (1.0 - mu[free] ** 2))
    entering = directional_reflectance(cosine, albedo, SKIN_IOR) / above
    single = 1.0 / (mu[free, None] + mu[free]) - mean_single_scattering_kernel(cosine, SKIN_IOR)
    half_space = lambertian * (entering + response.single_scattering[0] * single)
    importance = np.outer(area, area)

    def relative_rmse(radiance: Floats) -> float:
        return float(np.sqrt((importance * (radiance - exact) ** 2).sum() / (importance * exact**2).sum()))

    return relative_rmse(lambertian), relative_rmse(half_space)


def _monte_carlo_oblique_ratio(albedo: float, mean_cosine: float, eta: float) -> float:
    """Return the ratio of reflectance at 81 degrees of incidence to that at 0 degrees, by Monte Carlo [-].

    albedo : single-scattering albedo [-]
    mean_cosine : mean cosine of the scattering angle [-]
    eta : index of refraction
    """
    oblique = _reflected_fraction(OBLIQUE_COSINE, albedo, mean_cosine, eta)
    return oblique / _reflected_fraction(1.0, albedo, mean_cosine, eta)


def _reflected_fraction(cosine: float, albedo: float, mean_cosine: float, eta: float) -> float:
    """Return the fraction of incident photons that a half-space reflects, by Monte Carlo [-].

    cosine : cosine of the angle of incidence in air
    albedo : single-scattering albedo [-]
    mean_cosine : mean cosine of the scattering angle [-]
    eta : index of refraction
    """
    rng = np.random.default_rng(1)
    depth, weight, reflected = np.zeros(PHOTON_COUNT), np.ones(PHOTON_COUNT), 0.0
    down = np.full(PHOTON_COUNT, float(refracted_cosine(cosine, eta)))
    while len(depth):
        depth = depth - np.log(rng.random(len(depth))) * down
        leaves = (depth < 0.0) & (rng.random(len(depth)) > internal_reflectance(np.abs(down), eta))
        reflected += float(weight[leaves].sum())
        down = np.where(depth < 0.0, -down, down)  # reflected internally
        inside = ~leaves
        depth, down, weight = np.abs(depth[inside]), down[inside], albedo * weight[inside]
        down = _scattered_cosines(down, mean_cosine, rng)
        survives = (weight > _MIN_PHOTON_WEIGHT) | (rng.random(len(weight)) < 0.1)
        weight = np.where(weight > _MIN_PHOTON_WEIGHT, weight, 10.0 * weight)
        depth, down, weight = depth[survives], down[survives], weight[survives]
    return reflected / PHOTON_COUNT


def _scattered_cosines(downward_cosines: Floats, mean_cosine: float, rng: np.random.Generator) -> Floats:
    """Return cosines (n,) of the angles between photon directions and the downward axis, after scattering.

    Scattering angles are distributed according to [HenyeyGreenstein1941].

    downward_cosines : (n,) cosines before scattering
    mean_cosine : mean cosine of the scattering angle [-]
    """
    uniform = rng.random(len(downward_cosines))
    if mean_cosine == 0.0:
        return 2.0 * uniform - 1.0
    cosine = (
        1.0
        + mean_cosine**2
        - ((1.0 - mean_cosine**2) / (1.0 - mean_cosine + 2.0 * mean_cosine * uniform)) ** 2
    ) / (2.0 * mean_cosine)
    sines = np.sqrt(np.maximum((1.0 - cosine**2) * (1.0 - downward_cosines**2), 0.0))
    deflected = downward_cosines * cosine + sines * np.cos(2.0 * np.pi * rng.random(len(downward_cosines)))
    return np.asarray(np.clip(deflected, -1.0, 1.0))


def _studio_brightness_ratios(head: Head, adapter: str) -> tuple[list[float], list[float]]:
    """Return how much brighter skin is if `Skin.direction` is "half-space" instead of "lambertian" [-].

    `Skin.direction` sets how diffuse light depends on the directions of light and view. The brightness ratio
    is computed for each pixel that shows a head in studio light. The two lists are the medians and the 99th
    percentiles of these ratios, each in red, green and blue.
    """
    renderer, settings = Renderer(adapter), Settings(size=(256, 298), atlas=1024)

    def render_picture(direction: Literal["lambertian", "half-space"]) -> Floats:
        return renderer.draw(Scene(head, skin=Skin(direction=direction)), settings).linear().astype(float)

    lambertian, half_space = render_picture("lambertian"), render_picture("half-space")
    visible = lambertian.min(axis=-1) > 0.02
    middle, high = np.percentile(half_space[visible] / lambertian[visible], (50.0, 99.0), axis=0)
    return middle.tolist(), high.tolist()
