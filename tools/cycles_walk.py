"""Simulate the random walk of Cycles in a half-space and write `cycles_walk.csv` of the Blender export.

Takes a minute for 4 million photons. Photons are never absorbed: one that leaves after n scattering events
counts with albedo^n for each albedo, so that all columns use the same walks and are smooth in the albedo.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.photon import RandomState, random_uniform, scatter_direction
from dermis.base.command_line import run_script
from dermis.base.compiled import compiled

Floats = NDArray[np.float64]
ROOTS = (0.01, 0.02, 0.04, 0.07, 0.1, 0.14, 0.19, 0.25, 0.32, 0.4, 0.48, 0.56, 0.64, 0.72, 0.8, 0.8945)
"""Values of sqrt(1 - albedo); Cycles accepts no albedo below 0.2."""
RADII = np.concatenate([[0.0], np.geomspace(0.03, 200.0, 32)])
"""Radii within which light is counted [mean free paths]."""
MAX_STEPS = 256
"""Number of steps after which Cycles ends a walk."""
ETA = 1.4
ENTRIES = ("straight", "skin")  # initial directions of walks, as in HEADER
OUT = Path(__file__).resolve().parents[1] / "src/dermis/apps/export/targets/blender/cycles_walk.csv"
HEADER = """\
# quantity: fraction of the light that leaves a half-space along its normal and entered within a radius of
#   that point: isotropic random walks of Cycles, of at most {most} steps, leaving an index-matched surface.
#   entry: first direction of walks, "straight" down, or that of RANDOM_WALK_SKIN: half of them diffuse, half
#   refracted at index {eta} by facets of GGX with roughness 1. root: sqrt(1 - single-scattering albedo)
# unit: radius in mean free paths; within: dimensionless
# source: {photons} photons for each entry, computed by tools/cycles_walk.py (seed 7)
# licence: Apache-2.0
entry,root,radius,within
"""


@compiled
def _entering(skin: bool, rng: RandomState) -> tuple[float, float, float]:
    """Return the initial direction of a walk, with z downwards."""
    if not skin:
        return 0.0, 0.0, 1.0
    facing = math.sqrt(random_uniform(rng))  # for facets of roughness 1 and diffuse light
    turn = 2.0 * math.pi * random_uniform(rng)
    angle = math.acos(facing)
    if random_uniform(rng) >= 0.5:
        angle -= math.asin(math.sin(angle) / ETA)
    return math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), math.cos(angle)


@compiled
def _walks(photons: int, skin: bool, powers: Floats, radii: Floats, rng: RandomState, tally: Floats) -> None:
    """Trace photons, and add the weights of those that leave to their ring in `tally` (albedos, radii + 1).

    powers : (albedos, MAX_STEPS) albedo^n
    """
    for _ in range(photons):
        x = y = z = 0.0
        ux, uy, uz = _entering(skin, rng)
        for step in range(MAX_STEPS):
            path = -math.log(random_uniform(rng))
            if z + path * uz < 0.0:
                path = -z / uz
                ring = np.searchsorted(radii, math.hypot(x + path * ux, y + path * uy))
                tally[:, ring] += powers[:, step]
                break
            x, y, z = x + path * ux, y + path * uy, z + path * uz
            ux, uy, uz = scatter_direction(ux, uy, uz, 0.0, rng)


def main(photons: int = 4_000_000) -> None:
    """Simulate both entry distributions and write the table."""
    albedo = 1.0 - np.array(ROOTS) ** 2
    powers = albedo[:, None] ** np.arange(MAX_STEPS)
    lines = []
    for number, entry in enumerate(ENTRIES):
        tally = np.zeros((len(ROOTS), len(RADII) + 1))
        words = np.random.default_rng([7, number]).integers(0, 2**64, 4, np.uint64)
        _walks(photons, entry == "skin", powers, RADII, words, tally)
        within = np.cumsum(tally, axis=1)[:, 1:-1] / photons
        for root, row in zip(ROOTS, within, strict=True):
            lines += [
                f"{entry},{root:g},{r:.5g},{share:.5f}" for r, share in zip(RADII[1:], row, strict=True)
            ]
    header = HEADER.format(photons=f"{photons:,}", most=MAX_STEPS, eta=ETA)
    OUT.write_text(header + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    run_script(main)
