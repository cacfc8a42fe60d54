"""Measure the errors of mixed profiles at the border of two media.

Monte Carlo through two adjacent half-spaces is the reference; `unmixing_page.py` writes the figures to
docs/fit.md. With --cost it prints the times of frames with one, two and three profiles.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

import dermis
from dermis.apps.inverse.unmixing.profile_widths import profile_mixture
from dermis.apps.inverse.unmixing.skin_model import skin_model
from dermis.apps.inverse.unmixing.unmix import unmix
from dermis.apps.truths.two_media import strip_transfer
from dermis.apps.validation.pages import JsonObject, write_results
from dermis.base.command_line import run_script
from dermis.base.console import print_lines
from dermis.frame.renderer import Renderer
from dermis.images.io import write_png

RESULTS = Path(__file__).parent / "results" / "widths.json"
Floats = NDArray[np.float64]
PAIRS: dict[str, tuple[tuple[float, float], tuple[float, float]]] = {
    "skin1 beside skin2, red": ((0.032, 0.013), (0.74, 1.09)),
    "skin1 beside skin2, green": ((0.17, 0.07), (0.88, 1.59)),
    "four times the absorption": ((0.03, 0.12), (1.0, 1.0)),
    "twice the scattering": ((0.05, 0.05), (1.0, 2.0)),
    "half the width, same colour": ((0.05, 0.1), (1.0, 2.0)),
}
"""Absorption and reduced scattering coefficients of the left and the right medium [1/mm]."""
HALF_MM, STRIPS, PHOTONS, SEED = 14.0, 140, 40_000, 3
_COMPARED, _SUMMED = slice(40, 100), slice(20, 120)  # strips for RMS errors, and for errors of the total
_FRAMES = 12


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = RESULTS,
    adapter: str = "auto",
    cost_only: Annotated[bool, Parameter(name="--cost", negative="")] = False,
    atlas: int = 2048,
) -> int:
    """Measure, and write the figures.

    Parameters
    ----------
    output:
        JSON file with the figures.
    cost_only:
        Print only the times of frames, and write nothing.
    atlas:
        Side of the atlas of those frames [texel].
    """
    if cost_only:
        print_lines(json.dumps(cost(adapter, atlas)))
        return 0
    results = {"pairs": {name: border(*pair) for name, pair in PAIRS.items()}, "grid": grid(adapter)}
    write_results(output, results | {"photons": PHOTONS}, 3)
    return 0


def border(sigma_a: tuple[float, float], sigma_s: tuple[float, float]) -> JsonObject:
    """Return the errors of each mixing rule at the border of two media.

    "rms" and "worst" are RMS errors relative to the true maximum, means and largest over light patterns."""
    edges = np.linspace(-HALF_MM, HALF_MM, STRIPS + 1)
    a, s = np.array(sigma_a), np.array(sigma_s)
    true = strip_transfer(a, s, edges, PHOTONS, SEED)
    alone = [
        light_by_distance(strip_transfer(np.full(2, a[k]), np.full(2, s[k]), edges, PHOTONS, SEED))
        for k in (0, 1)
    ]
    colour = [one[0] + 2.0 * one[1:].sum() for one in alone]
    right = edges[:-1] >= 0.0
    apart = np.abs(np.subtract.outer(np.arange(STRIPS), np.arange(STRIPS)))
    white = [one[apart] / total for one, total in zip(alone, colour, strict=True)]
    tint = np.sqrt(np.where(right, colour[1], colour[0]))
    results = {}
    for name, kernel in rules(white, right).items():
        off = [errors(light, kernel, tint, true) for light in patterns(edges)]
        rms, energy, kept = np.abs(np.array(off)).T
        results[name] = {"rms": rms.mean(), "worst": rms.max(), "energy": energy.max(), "white": kept.max()}
    return {"albedo": colour, "rules": results}


def light_by_distance(matrix: Floats) -> Floats:
    """Return the mean light (n,) at a distance of 0 to n - 1 strips from a lit strip, in one medium."""
    found = np.zeros(STRIPS)
    for k in range(STRIPS):
        pairs = [matrix[i, j] for i in range(STRIPS)[_COMPARED] for j in (i - k, i + k) if 0 <= j < STRIPS]
        found[k] = np.mean(pairs) if pairs else 0.0
    return found


def rules(white: list[Floats], right: NDArray[np.bool_]) -> dict[str, Floats]:
    """Return the kernel of each mixing rule for white skin: light from strips (rows) to strips (columns)."""
    leaves = np.where(right[None], white[1], white[0])
    enters = np.where(right[:, None], white[1], white[0])
    return {
        "one profile": white[0],
        "where it leaves": leaves,
        "where it enters": enters,
        "half of each": 0.5 * (leaves + enters),
        "geometric mean": np.sqrt(leaves * enters),
    }


def patterns(edges: Floats) -> Iterator[Floats]:
    """Yield illumination patterns of the strips: uniform, an edge near the border, and lines of 0.5 mm."""
    x = 0.5 * (edges[:-1] + edges[1:])
    yield np.ones(STRIPS)
    for edge in (-1.0, 0.0, 1.0):
        yield np.where(x < edge, 1.0, 0.0)
        yield np.where(x > edge, 1.0, 0.0)
    for middle in (-1.5, -0.5, 0.5, 1.5):
        yield np.where(np.abs(x - middle) < 0.25, 1.0, 0.0)


def errors(light: Floats, kernel: Floats, tint: Floats, true: Floats) -> tuple[float, float, float]:
    """Return RMS error relative to the maximum, error of the total, and error of the total of white skin."""
    made, wanted = tint * ((light * tint) @ kernel), light @ true
    off = np.sqrt(((made - wanted)[_COMPARED] ** 2).mean()) / wanted[_COMPARED].max()
    energy = made[_SUMMED].sum() / wanted[_SUMMED].sum() - 1.0
    near = light[_COMPARED]  # far from the outer edges of the strips
    return float(off), float(energy), float((near @ kernel[_COMPARED]).sum() / near.sum() - 1.0)


def grid(adapter: str) -> JsonObject:
    """Return errors of profile widths with one and with three profiles, on a grid of melanin and blood."""
    m, b = np.meshgrid(np.geomspace(0.01, 0.15, 64), np.geomspace(0.002, 0.06, 64))
    colours = skin_model().colours(m.ravel(), b.ravel()).reshape(64, 64, 3)
    return profile_mixture(unmix(colours, adapter=adapter)).summary()


def cost(adapter: str, atlas: int) -> JsonObject:
    """Return the median frame times of the human under changing light, by number of profiles [ms]."""
    renderer, head = Renderer(adapter), dermis.load_head("human")
    settings = dermis.Settings(size=(1920, 1080), atlas=atlas)
    results: JsonObject = {"adapter": renderer.device.adapter.name, "atlas": atlas}
    with TemporaryDirectory() as folder:
        mask = Path(folder) / "mask.png"
        write_png(mask, np.random.default_rng(SEED).integers(0, 127, (64, 64, 3)).astype(np.uint8))
        one = dermis.Skin(profile="skin1")
        for others in ((), ("skin2",), ("skin2", "dj3")):
            skin = one.replace(profile_map=str(mask), other_profiles=others) if others else one
            took = [_frame_ms(renderer, dermis.Scene(head, skin=skin), settings, k) for k in range(_FRAMES)]
            results[f"profiles {1 + len(others)}"] = float(np.median(took[2:]))
    return results


def _frame_ms(renderer: Renderer, scene: dermis.Scene, settings: dermis.Settings, number: int) -> float:
    """Return the time of a frame with new light, measured by the device if possible [ms]."""
    bright = 3.0 + 0.01 * number
    lamp = dermis.PointLight(position=(-300, 300, 700), irradiance=(bright, bright, bright))
    drawn = renderer.draw(replace(scene, lights=(lamp,)), settings, timed="whole")
    return drawn.gpu_ms["total"] if drawn.gpu_ms else drawn.frame_ms


if __name__ == "__main__":
    run_script(main)
