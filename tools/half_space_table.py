"""Makes src/dermis/export/data/half_space.csv: profiles of homogeneous half-spaces by Monte Carlo.

python tools/half_space_table.py [PHOTONS], minutes on two cores. Scattering is isotropic, and lengths are
in mean free paths, so that a profile depends on the albedo alone, the surface and how light enters.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from dermis.outputs import replacing
from dermis.reference.slab import ScatteringLayer
from dermis.reference.slab_mc import trace_slab

OUT = Path(__file__).parent.parent / "src" / "dermis" / "export" / "data" / "half_space.csv"
KINDS = {"skin": (1.4, False), "matched": (1.0, False), "walk": (1.0, True)}
"""Index of refraction of the surface, and whether light enters by the cosine of all directions."""
ABSORBED = np.concatenate([np.geomspace(1e-5, 0.2, 25), np.linspace(0.25, 0.95, 15), [0.98]])
EDGES = np.concatenate([[0.0], np.geomspace(1e-3, 3e3, 96)])
COUNTED = 2_000_000  # photons that leave
MOST = 64_000_000
HEAD = """\
# quantity: cumulative share of the light leaving a homogeneous half-space around a thin beam, of all that
#   leaves; total is that of what enters; kind skin has a smooth surface of index 1.4 lit at right angles,
#   matched an index-matched one, walk an index-matched one that light enters by the cosine of all
#   directions; albedo is that of a scattering
# unit: radii in mean free paths; shares dimensionless
# source: tools/half_space_table.py, by the package's Monte Carlo with isotropic scattering
# licence: Apache-2.0
"""


def main() -> int:
    """Trace all and write the table."""
    counted = int(sys.argv[1]) if len(sys.argv) > 1 else COUNTED
    lines = [HEAD + ",".join(["kind", "albedo", "total", *(f"{edge:.5g}" for edge in EDGES[1:])])]
    for kind, (eta, diffuse) in KINDS.items():
        lines += [_line(kind, eta, diffuse, float(absorbed), counted) for absorbed in ABSORBED]
    with replacing(OUT) as trial:
        trial.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return 0


def _line(kind: str, eta: float, diffuse: bool, absorbed: float, counted: int) -> str:
    layer = [ScatteringLayer(absorbed, 1.0 - absorbed, np.inf, 0.0, eta)]
    first = trace_slab(layer, counted // 20, 1, EDGES, diffuse=diffuse).per_entering.total_reflectance
    photons = int(min(MOST, counted / max(first, 1e-4)))
    found = trace_slab(layer, photons, 0, EDGES, diffuse=diffuse)
    share = np.cumsum(found.reflectance * np.pi * np.diff(EDGES**2)) / found.total_reflectance
    total = found.per_entering.total_reflectance
    return ",".join([kind, f"{1.0 - absorbed:.6g}", f"{total:.6g}", *(f"{x:.5f}" for x in share)])


if __name__ == "__main__":
    sys.exit(main())
