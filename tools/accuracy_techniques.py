"""Writes docs/techniques.md: scattering techniques on the scanned head against truths.

python tools/accuracy_techniques.py [ADAPTER] needs the sample data and Mitsuba. Traced paths are kept on
disk, so only the first run takes long.
"""

from __future__ import annotations

import sys
from pathlib import Path

import accuracy_direction as direction
import accuracy_error as error
import accuracy_half_space as half_space
import accuracy_surface as surface
import numpy as np

import dermis
from dermis.apps.truths.half_space import directional_albedo
from dermis.apps.validation.comparisons.compare import Comparison, Row, compare
from dermis.apps.validation.comparisons.profile_models import ModelName
from dermis.apps.validation.comparisons.report import cells
from dermis.apps.validation.comparisons.scenes import comparison_scene, usual_region
from dermis.frame.surface_points import irradiance_at, surface_points
from dermis.mesh.head import Head
from dermis.optics.media import media
from dermis.scene import DirectionalLight, Settings
from dermis.scene.techniques import TECHNIQUES

PAGE = Path(__file__).parent.parent / "docs" / "techniques.md"
LIGHTS = {"front": 64, "back": 256, "laser": 256}  # paths through each pixel
SETTINGS = Settings(size=(256, 256), atlas=1024)
HEAD = "|  | technique | relative RMSE | FLIP | energy ratio | ms |\n|---|---|---|---|---|---|"


def line(first: str, row: Row) -> str:
    return f"| {first} | " + " | ".join(cells(row)) + " |"


def table(
    head: Head, against: str, medium: str, adapter: str, model: ModelName | None = None
) -> tuple[str, dict[str, Comparison]]:
    """Rows of all techniques under each light, and the comparisons behind them.

    model : of the medium's profile
    """
    rows, made = [HEAD], {}
    for light, samples in LIGHTS.items():
        region = "ear" if against == "heat" else usual_region(light)
        techniques = ("none", "gpu-gems-3", "texture-space") if against == "heat" else TECHNIQUES.names
        made[light] = compare(
            head,
            against,
            techniques,
            light=light,
            region=region,
            medium=medium,
            settings=SETTINGS,
            model=model,
            samples=samples,
            adapter=adapter,
        )
        rows += [line(light, row) for row in made[light].rows]
    return "\n".join(rows), made


def finer_heat(head: Head, adapter: str) -> str:
    """The laser's stripe against heat on an atlas of 2048."""
    settings, only = SETTINGS.model_copy(update={"atlas": 2048}), ("texture-space",)
    made = compare(
        head, "heat", only, light="laser", region="ear", settings=settings, model="layered", adapter=adapter
    )
    return line("laser, atlas 2048", made.rows[0])


def counted(head: Head, traced: dict[str, dict[str, Comparison]], adapter: str) -> str:
    """Against path tracing, by how the medium's profile is known.

    traced : by medium and light, what counted photons' comes to
    """
    rows, techniques = [], ("texture-space", "screen-space")
    for light, samples in LIGHTS.items():
        for medium, by_photons in traced.items():
            layered = compare(
                head,
                "path-traced",
                techniques,
                light=light,
                region=usual_region(light),
                medium=medium,
                model="layered",
                settings=SETTINGS,
                samples=samples,
                adapter=adapter,
            )
            for model, made in (("layered", layered), ("counted", by_photons[light])):
                by_technique = [_told(made, row) for row in made.rows if row.technique in techniques]
                rows.append(f"| {light} | {medium} | {model} | {' | '.join(by_technique)} |")
    return "\n".join(rows)


def _told(made: Comparison, row: Row) -> str:
    """Error, and energy in red, green and blue."""
    _, energy = direction.by_channel(made.images[row.technique], made.truth, made.truth.mask)
    return f"{row.relrmse:.4f} | {energy}"


def floor(head: Head, medium: str, traced: Comparison, adapter: str) -> str:
    """The front light on lambertian skin with the albedo of a half-space for light from its direction."""
    renderer = dermis.Renderer(adapter)
    scene = comparison_scene(head, "front", usual_region("front"), "gpu-gems-3")
    seen = surface_points(renderer, scene, SETTINGS)
    mesh = head.mesh

    def at(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.einsum("nk,nkc->nc", seen.barycentric, values[mesh.triangles[seen.triangle]]))

    normal, place = at(mesh.normals), at(mesh.positions) - np.array(head.centre_mm)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    (light,) = scene.lights
    assert not isinstance(light, DirectionalLight)
    towards = np.array(light.position) - place
    cosine = np.clip((normal * towards).sum(axis=1) / np.linalg.norm(towards, axis=1), 0.0, 1.0)
    layer = media()[medium].layers[0]
    single = layer.sigma_s_prime / (layer.sigma_a + layer.sigma_s_prime)
    albedo = np.stack([directional_albedo(cosine, one) for one in single], axis=-1)
    entered = irradiance_at(renderer, scene, SETTINGS, seen.triangle, seen.barycentric)
    image = np.zeros((*seen.mask.shape, 3))
    image[seen.mask] = entered * albedo / np.pi
    error, energy = direction.by_channel(image, traced.truth, traced.truth.mask & seen.mask)
    return f"relative RMSE {error} and energy {energy} in red, green and blue"


def main() -> None:
    adapter = sys.argv[1] if len(sys.argv) > 1 else "auto"
    head = dermis.load_head("lee_perry_smith", subdivide=0)
    found: dict[str, str] = {}
    traced: dict[str, dict[str, Comparison]] = {}
    for medium in ("skin1", "skin2"):
        found[f"traced_{medium}"], made = table(head, "path-traced", medium, adapter)
        found[f"floor_{medium}"], traced[medium] = floor(head, medium, made["front"], adapter), made
    found["direction"] = direction.table(head, LIGHTS, SETTINGS, adapter)
    found["counted"] = counted(head, traced, adapter)
    found["half_space"] = half_space.table(head, adapter)
    found["integral"], _ = table(head, "surface-integral", "skin1", adapter, "layered")
    found["heat"], _ = table(head, "heat", "skin1", adapter, "layered")
    found["heat"] += "\n" + finer_heat(head, adapter)
    found |= error.tables(head, SETTINGS, adapter) | surface.tables(adapter)
    text = (PAGE.parent / "techniques.in.md").read_text(encoding="utf-8")
    PAGE.write_text(text.format(adapter=made["front"].adapter, **found), encoding="utf-8")


if __name__ == "__main__":
    main()
