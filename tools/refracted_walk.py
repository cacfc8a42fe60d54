"""Walks through a half-space under a refracting surface: writes `export/data/refracted_walk.csv`.

    python tools/refracted_walk.py [PHOTONS]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from dermis.optics.media import SKIN_ETA
from dermis.reference.slab import ScatteringLayer
from dermis.reference.slab_mc import trace_slab

ROOTS = (0.01, 0.03, 0.06, 0.09, 0.13, 0.17, 0.22, 0.27, 0.33, 0.39, 0.46, 0.54, 0.63, 0.73, 0.84, 0.95)
"""sqrt(1 - albedo of single scattering)."""
RADII = np.concatenate([[0.0], np.geomspace(0.02, 400.0, 40)])
"""Within which light is counted [mean free paths]."""
PLACE = Path(__file__).resolve().parents[1] / "src" / "dermis" / "export" / "data" / "refracted_walk.csv"
HEADER = """\
# quantity: share of the light that enters a half-space straight down and leaves it within a radius: isotropic walks under a smooth
#   surface of index {eta}. root: sqrt(1 - albedo of single scattering)
# unit: radius in mean free paths; within: dimensionless
# source: {photons} photons an albedo, counted by tools/refracted_walk.py (seed 11)
# licence: Apache-2.0
root,radius,within
"""


def main(photons: int) -> None:
    """Count and write."""
    lines = [HEADER.format(eta=SKIN_ETA, photons=f"{photons:,}")]
    for root in ROOTS:
        albedo = 1.0 - root**2
        found = trace_slab([ScatteringLayer(1.0 - albedo, albedo)], photons, 11, RADII)
        ring = np.pi * np.diff(found.edges_mm**2)
        within = np.concatenate([[0.0], np.cumsum(found.reflectance * ring)]) / (1.0 - found.specular)
        lines += [f"{root:g},{r:.4g},{share:.5f}\n" for r, share in zip(RADII, within, strict=True)]
        sys.stdout.write(f"{albedo:.4f}  {within[-1]:.4f}  beyond {found.overflow_reflectance:.5f}\n")
    PLACE.write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
