"""Write the table by which media of the Mitsuba export are found: where light leaves half-spaces.

python tools/mitsuba_walks.py --photons 2000000
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from cyclopts import run

from dermis.export.targets.mitsuba_walks import ETAS, SHARES, TABLE
from dermis.reference.half_space import diffuse_albedo
from dermis.reference.slab_mc import ScatteringLayer, trace_slab

ROOTS = np.array([0.01, 0.02, 0.035, 0.05, 0.075, *np.arange(0.1, 0.96, 0.05), 0.98])
"""Of 1 minus the albedo of single scattering: the light that comes back is nearly linear in them."""
_EDGES = np.concatenate([[0.0], np.geomspace(1e-3, 400.0, 400)])


def row(eta: float, root: float, photons: int) -> str:
    """A line of the table."""
    albedo = 1.0 - root**2
    result = trace_slab([ScatteringLayer(1.0 - albedo, albedo, eta=eta)], photons, 7, _EDGES)
    result = result.per_entering
    rings = result.reflectance * np.pi * np.diff(_EDGES**2)
    within = np.concatenate([[0.0], np.cumsum(rings)])
    energy = result.total_reflectance
    radii = np.interp(SHARES, within / energy, _EDGES)
    uniform = diffuse_albedo(albedo) if eta == 1.0 else energy
    return ",".join([f"{eta:g}", f"{root:g}", f"{energy:.5f}", f"{uniform:.5f}", *(f"{r:.4g}" for r in radii)])


def main(*, photons: int = 2_000_000) -> None:
    """Trace half-spaces of unit extinction, isotropic, under matched and refracting surfaces."""
    head = ",".join(["eta", "root", "albedo", "uniform", *(f"{share:g}" for share in SHARES)])
    lines = [head, *(row(eta, float(root), photons) for eta in ETAS for root in ROOTS)]
    (Path(__file__).resolve().parents[1] / "src/dermis/export/targets" / TABLE).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    run(main)
