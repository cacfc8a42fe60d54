"""Photons that walk through a half-space without a boundary, counted: `optics/data/matched_walk.csv`.

    python tools/matched_walk.py [PHOTONS]   # some minutes for 4 million

The random walk of renderers whose medium has the index of the air: diffuse light enters at a point, scatters
alike in all directions, and leaves where it comes back to the plane.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.machine_code import compiled
from dermis.reference.photon import MAX_EVENTS, Words, deflect, uniform

Floats = NDArray[np.float64]
ROOTS = (0.005, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97)
"""sqrt(1 - albedo) of the walks [-]."""
RADII = np.geomspace(0.01, 3000.0, 56)
"""Within which light is counted [mean free paths]."""
PLACE = Path(__file__).resolve().parents[1] / "src" / "dermis" / "optics" / "data" / "matched_walk.csv"
HEADER = """\
# quantity: share of the light which leaves a half-space within a radius of the point where it entered, index-matched and isotropic,
#   for diffuse light; root is sqrt(1 - albedo of single scattering), radius in mean free paths
# unit: dimensionless
# source: {photons} photons a walk, counted by tools/matched_walk.py
# licence: Apache-2.0
root,radius,within
"""


@compiled
def _walks(photons: int, albedo: float, radii: Floats, rng: Words, counts: NDArray[np.int64]) -> None:
    for _ in range(photons):
        x = y = z = 0.0
        ux, uy, uz = 0.0, 0.0, math.sqrt(uniform(rng))
        ux = math.sqrt(1.0 - uz * uz)
        for _ in range(MAX_EVENTS):
            path = -math.log(uniform(rng))
            if z + path * uz < 0.0:
                path = -z / uz
                radius = math.hypot(x + path * ux, y + path * uy)
                counts[np.searchsorted(radii, radius)] += 1
                break
            x, y, z = x + path * ux, y + path * uy, z + path * uz
            if uniform(rng) > albedo:
                break
            ux, uy, uz = deflect(ux, uy, uz, 0.0, rng)


def main() -> None:
    """Walk for each albedo and write the table."""
    photons = int(sys.argv[1]) if len(sys.argv) > 1 else 4_000_000
    lines = []
    for number, root in enumerate(ROOTS):
        counts = np.zeros(len(RADII) + 1, np.int64)
        words = np.random.default_rng([7, number]).integers(0, 2**64, 4, np.uint64)
        _walks(photons, 1.0 - root**2, RADII, words, counts)
        within = np.cumsum(counts[:-1]) / photons
        lines += [f"{root:g},{r:.5g},{share:.5f}" for r, share in zip(RADII, within, strict=True)]
    PLACE.write_text(HEADER.format(photons=f"{photons:,}") + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
