"""Skin by directions against path tracing: on the scanned head and on a ball, for docs/techniques.md."""

from __future__ import annotations

import numpy as np

from dermis.apps.truths.metrics import energy_ratio, relative_rmse
from dermis.apps.validation.comparisons.compare import compare
from dermis.apps.validation.comparisons.report import cells
from dermis.apps.validation.comparisons.scenes import usual_region
from dermis.apps.validation.comparisons.truths import Truth
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene import Settings

HEAD = """|  |  |  | relative RMSE | in red, green, blue | FLIP | energy ratio | in red, green, blue |
|---|---|---|---|---|---|---|---|"""
BALL = Head("ball", uv_sphere(100.0, 512, 256), Maps())
ON_BALL = {"front": 64, "back": 64}  # paths through each pixel


def table(head: Head, lights: dict[str, int], settings: Settings, adapter: str) -> str:
    """Texture space with lambertian skin and with half-spaces, on a head and on a ball."""
    lines = [HEAD]
    for light, samples in lights.items():
        lines += _rows(head, light, usual_region(light), samples, settings, adapter)
    for light, samples in ON_BALL.items():
        lines += _rows(BALL, light, "ear", samples, settings.model_copy(update={"size": (96, 96)}), adapter)
    return "\n".join(lines)


def _rows(head: Head, light: str, region: str, samples: int, settings: Settings, adapter: str) -> list[str]:
    place = "ball, " if head is BALL else ""
    lines = []
    for medium in ("skin1", "skin2"):
        for direction in ("lambertian", "half-space"):
            made = compare(
                head,
                "path-traced",
                ("texture-space",),
                light=light,
                region=region,
                medium=medium,
                settings=settings,
                direction=direction,
                model="layered",
                samples=samples,
                adapter=adapter,
            )
            _, error, flip, energy, _ = cells(made.rows[0])
            errors, energies = by_channel(made.images["texture-space"], made.truth, made.truth.mask)
            figures = (error, errors, flip, energy, energies)
            lines.append(f"| {place}{light} | {medium} | {direction} | " + " | ".join(figures) + " |")
    return lines


def by_channel(image: np.ndarray, truth: Truth, mask: np.ndarray) -> list[str]:
    """Relative RMSE, and energy ratio, in red, green and blue."""
    parts = [(image[..., c], truth.image[..., c], mask, truth.variance[..., c]) for c in range(3)]
    measures = (relative_rmse, energy_ratio)
    return [" / ".join(f"{measure(*part).value:.3f}" for part in parts) for measure in measures]
