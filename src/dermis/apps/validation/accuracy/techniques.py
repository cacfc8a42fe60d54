"""Scattering techniques on the head "lee_perry_smith", compared with references, for docs/techniques.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.apps.truths.half_space import directional_albedo
from dermis.apps.truths.metrics import energy_ratio, relative_rmse
from dermis.apps.validation.accuracy import blur, half_space, texture_space
from dermis.apps.validation.comparisons.compare import Comparison, ComparisonRow, compare
from dermis.apps.validation.comparisons.references import ReferenceImage
from dermis.apps.validation.comparisons.report import error_cells
from dermis.apps.validation.comparisons.scenes import ModelName, comparison_scene, default_region
from dermis.apps.validation.pages import DOCS, add_tests_to_path, fill_page, require_in_checkout
from dermis.frame.surface_points import irradiance_at, surface_points
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.optics.media import published_media
from dermis.scene import Settings
from dermis.scene.lights import DirectionalLight
from dermis.scene.techniques import TECHNIQUES

PAGE = DOCS / "techniques.md"
Floats = NDArray[np.floating]
SAMPLES_BY_LIGHT = {"front": 64, "back": 256, "laser": 256}  # paths per pixel
SETTINGS = Settings(size=(256, 256), atlas=1024)
TABLE_HEADER = "|  | technique | relative RMSE | FLIP | energy ratio | ms |\n|---|---|---|---|---|---|"

DIRECTION_TABLE_HEADER = (
    "|  |  |  | relative RMSE | in red, green, blue | FLIP | energy ratio | in red, green, blue |\n"
    "|---|---|---|---|---|---|---|---|"
)
BALL = Head("ball", uv_sphere(100.0, 512, 256), Maps())
BALL_SAMPLES_BY_LIGHT = {"front": 64, "back": 64}  # paths per pixel


def write_techniques_page(adapter: str = "auto") -> None:
    """Compare scattering techniques with reference solutions, and write docs/techniques.md.

    Needs the sample data, Mitsuba, and a checkout of the project with its folder `tests`. The path-traced
    reference images are cached on disk, so only the first run takes long.
    """
    require_in_checkout(PAGE)
    add_tests_to_path()
    head = dermis.load_head("lee_perry_smith", subdivide=0)
    parts: dict[str, str] = {}
    path_traced: dict[str, dict[str, Comparison]] = {}
    for medium in ("skin1", "skin2"):
        parts[f"traced_{medium}"], comparison = technique_rows(head, "path-traced", medium, adapter)
        parts[f"floor_{medium}"] = lambertian_limit_text(head, medium, comparison["front"], adapter)
        path_traced[medium] = comparison
    parts["direction"] = direction_rows(head, SAMPLES_BY_LIGHT, SETTINGS, adapter)
    parts["counted"] = profile_model_rows(head, path_traced, adapter)
    parts["half_space"] = half_space.direction_table(head, adapter)
    parts["integral"], _ = technique_rows(head, "surface-integral", "skin1", adapter, "layered")
    parts["heat"], _ = technique_rows(head, "heat", "skin1", adapter, "layered")
    parts["heat"] += "\n" + fine_atlas_row(head, adapter)
    parts |= texture_space.texture_space_error_tables(
        head, SETTINGS, adapter
    ) | blur.curvature_and_seam_tables(adapter)
    fill_page(PAGE, adapter=comparison["front"].adapter, **parts)


def _compare_under_light(
    head: Head, reference_name: str, techniques: Sequence[str], light_name: str, adapter: str, **options: Any
) -> Comparison:
    """Return a comparison of techniques with a reference under one light.

    reference_name : key of `comparisons.references.REFERENCES`, such as "path-traced"
    options : further arguments of `compare`; the default region and number of samples depend on the light
    """
    defaults: dict[str, Any] = {"region": default_region(light_name), "samples": SAMPLES_BY_LIGHT[light_name]}
    defaults["settings"] = SETTINGS
    return compare(
        head, reference_name, techniques, light=light_name, adapter=adapter, **(defaults | options)
    )


def technique_row(first_cell: str, comparison_row: ComparisonRow) -> str:
    """Return a Markdown row with `first_cell` and the errors of a technique."""
    return f"| {first_cell} | " + " | ".join(error_cells(comparison_row)) + " |"


def technique_rows(
    head: Head, reference_name: str, medium: str, adapter: str, model: ModelName | None = None
) -> tuple[str, dict[str, Comparison]]:
    """Return a Markdown table with the errors of techniques under each light, and the comparisons by light.

    If the reference is "heat", only three techniques are compared; otherwise, all techniques are compared.

    reference_name : key of `comparisons.references.REFERENCES`, such as "path-traced"
    medium : published medium of the skin, such as "skin1"
    model : scattering model of the medium's profile; see `medium_gaussians` for the default
    """
    rows, comparison = [TABLE_HEADER], {}
    for light in SAMPLES_BY_LIGHT:
        region = "ear" if reference_name == "heat" else default_region(light)
        techniques = ("none", "gpu-gems-3", "texture-space") if reference_name == "heat" else TECHNIQUES.names
        comparison[light] = _compare_under_light(
            head, reference_name, techniques, light, adapter, region=region, medium=medium, model=model
        )
        rows += [technique_row(light, row) for row in comparison[light].rows]
    return "\n".join(rows), comparison


def fine_atlas_row(head: Head, adapter: str) -> str:
    """Return a Markdown row with the errors of texture-space diffusion on an atlas of 2048 by 2048 texels.

    The head is lit by a narrow stripe of light, as from a laser. In the reference, light diffuses along the
    surface according to the heat equation.
    """
    settings, only = SETTINGS.model_copy(update={"atlas": 2048}), ("texture-space",)
    comparison = _compare_under_light(
        head, "heat", only, "laser", adapter, region="ear", settings=settings, model="layered"
    )
    return technique_row("laser, atlas 2048", comparison.rows[0])


def profile_model_rows(
    head: Head, comparisons_by_medium: dict[str, dict[str, Comparison]], adapter: str
) -> str:
    """Return Markdown rows with errors against path tracing, for profiles of two scattering models.

    The models are "layered", which is layered diffusion, and "counted", which is tabulated counts of traced
    photons.

    comparisons_by_medium : comparisons for profiles of the model "counted", keyed by medium, then by light
    """
    rows, techniques = [], ("texture-space", "screen-space")
    for light in SAMPLES_BY_LIGHT:
        for medium, by_photons in comparisons_by_medium.items():
            layered = _compare_under_light(
                head, "path-traced", techniques, light, adapter, medium=medium, model="layered"
            )
            for model, comparison in (("layered", layered), ("counted", by_photons[light])):
                compared = (row for row in comparison.rows if row.technique in techniques)
                cells = " | ".join(_error_and_energy_cells(comparison, row) for row in compared)
                rows.append(f"| {light} | {medium} | {model} | {cells} |")
    return "\n".join(rows)


def _error_and_energy_cells(comparison: Comparison, comparison_row: ComparisonRow) -> str:
    """Return table cells with the relative RMSE and with the energy ratios in red, green and blue."""
    reference = comparison.reference
    _, energy = error_cells_by_channel(comparison.images[comparison_row.technique], reference, reference.mask)
    return f"{comparison_row.relrmse:.4f} | {energy}"


def lambertian_limit_text(head: Head, medium: str, path_traced_comparison: Comparison, adapter: str) -> str:
    """Return text with the errors of an ideal Lambertian skin against path tracing, under the front light.

    The errors are the relative RMSE and the energy ratio. The ideal skin reflects as much light as a
    half-space does for the same angle of incidence. Its errors show how small the errors of Lambertian
    skin can become.

    path_traced_comparison : comparison with path tracing under the front light
    """
    renderer = dermis.Renderer(adapter)
    scene = comparison_scene(head, "front", default_region("front"), "gpu-gems-3")
    visible = surface_points(renderer, scene, SETTINGS)
    mesh = head.mesh

    def interpolate_to_pixels(vertex_values: Floats) -> Floats:
        corners = vertex_values[mesh.triangles[visible.triangle]]
        return np.asarray(np.einsum("nk,nkc->nc", visible.barycentric, corners))

    normal, position = (
        interpolate_to_pixels(mesh.normals),
        interpolate_to_pixels(mesh.positions) - np.array(head.centre_mm),
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    (light,) = scene.lights
    assert not isinstance(light, DirectionalLight)
    to_light = np.array(light.position) - position
    cosine = np.clip((normal * to_light).sum(axis=1) / np.linalg.norm(to_light, axis=1), 0.0, 1.0)
    layer = published_media()[medium].layers[0]
    single_albedo = layer.sigma_s_prime / (layer.sigma_a + layer.sigma_s_prime)
    albedo = np.stack([directional_albedo(cosine, one) for one in single_albedo], axis=-1)
    irradiance = irradiance_at(renderer, scene, SETTINGS, visible.triangle, visible.barycentric)
    image = np.zeros((*visible.mask.shape, 3))
    image[visible.mask] = irradiance * albedo / np.pi
    error, energy = error_cells_by_channel(
        image, path_traced_comparison.reference, path_traced_comparison.reference.mask & visible.mask
    )
    return f"relative RMSE {error} and energy {energy} in red, green and blue"


def direction_rows(head: Head, samples_by_light: dict[str, int], settings: Settings, adapter: str) -> str:
    """Return a Markdown table that compares the values "lambertian" and "half-space" of `Skin.direction`.

    `Skin.direction` sets how diffuse light depends on the directions of light and view. For each value, the
    table has the errors of skin against path tracing, for the head under each light and for a ball.

    samples_by_light : dictionary from the name of a light to the number of paths per pixel
    """
    lines = [DIRECTION_TABLE_HEADER]
    for light, samples in samples_by_light.items():
        lines += _direction_rows_under_light(head, light, default_region(light), samples, settings, adapter)
    for light, samples in BALL_SAMPLES_BY_LIGHT.items():
        small = settings.model_copy(update={"size": (96, 96)})
        lines += _direction_rows_under_light(BALL, light, "ear", samples, small, adapter)
    return "\n".join(lines)


def _direction_rows_under_light(
    head: Head, light_name: str, region: str, samples_per_pixel: int, settings: Settings, adapter: str
) -> list[str]:
    prefix = "ball, " if head is BALL else ""
    lines = []
    for medium in ("skin1", "skin2"):
        for direction in ("lambertian", "half-space"):
            values = {
                "region": region,
                "medium": medium,
                "direction": direction,
                "samples": samples_per_pixel,
            }
            comparison = _compare_under_light(
                head,
                "path-traced",
                ("texture-space",),
                light_name,
                adapter,
                settings=settings,
                model="layered",
                **values,
            )
            _, error, flip, energy, _ = error_cells(comparison.rows[0])
            image, reference = comparison.images["texture-space"], comparison.reference
            errors, energies = error_cells_by_channel(image, reference, reference.mask)
            figures = (error, errors, flip, energy, energies)
            lines.append(f"| {prefix}{light_name} | {medium} | {direction} | " + " | ".join(figures) + " |")
    return lines


def error_cells_by_channel(
    rendered_image: Floats, reference: ReferenceImage, mask: NDArray[np.bool_]
) -> list[str]:
    """Return table cells with relative RMSE and energy ratio, each in red, green and blue.

    mask : (h, w) pixels to compare
    """
    parts = [
        (rendered_image[..., c], reference.image[..., c], mask, reference.variance[..., c]) for c in range(3)
    ]
    measures = (relative_rmse, energy_ratio)
    return [" / ".join(f"{measure(*part).value:.3f}" for part in parts) for measure in measures]
