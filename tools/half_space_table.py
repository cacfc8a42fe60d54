"""Compute profiles of homogeneous half-spaces by Monte Carlo for src/dermis/optics/data/half_space.csv.

Takes some minutes. Scattering is isotropic and lengths are in mean free paths, so a profile depends only on
the albedo, the surface and the incident directions. Photons are never absorbed: one that leaves after n
scattering events counts with albedo^n for all albedos at once.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.photon import random_uniform, refract, scatter_direction
from dermis.base.atomic_write import atomic_file
from dermis.base.command_line import run_script
from dermis.base.compiled import compiled

Floats = NDArray[np.float64]
Words = NDArray[np.uint64]

OUT = Path(__file__).parent.parent / "src" / "dermis" / "optics" / "data" / "half_space.csv"
KINDS = {"skin": (1.4, False), "matched": (1.0, False), "walk": (1.0, True)}
"""For each kind of profile: index of refraction of the surface, and whether light enters from all directions,
weighted by their cosines, instead of along the normal."""
ABSORPTIONS = np.concatenate([np.geomspace(1e-5, 0.2, 25), np.linspace(0.25, 0.95, 15), [0.98]])
EDGES = np.concatenate([[0.0], np.geomspace(1e-3, 3e3, 96)])
PHOTONS, BATCHES = 3_000_000, 40
DARK_ABSORPTION, DARK_PHOTON_FACTOR = 0.2, 8  # absorption from which few photons leave, so more are traced
EVENTS, DARK_EVENTS = 200_000, 200  # limits of paths; weights are then negligible, or 1/7 for absorption 1e-5
HEAD = """\
# quantity: cumulative share of the light leaving a homogeneous half-space around a thin beam, of all that
#   leaves; total is that of what enters; kind skin has a smooth surface of index 1.4 lit at right angles,
#   matched an index-matched one, walk an index-matched one that light enters by the cosine of all
#   directions; albedo is that of a scattering
# unit: radii in mean free paths; shares dimensionless
# source: tools/half_space_table.py, by the package's Monte Carlo with isotropic scattering
# licence: Apache-2.0
"""


def main(photons: int = PHOTONS) -> None:
    """Trace all photons and write the table."""
    lines = [HEAD + ",".join(["kind", "albedo", "total", *(f"{edge:.5g}" for edge in EDGES[1:])])]
    for kind, (eta, diffuse) in KINDS.items():
        dark = ABSORPTIONS >= DARK_ABSORPTION
        bright_left = trace_photons(eta, diffuse, ABSORPTIONS[~dark], photons, EVENTS)
        dark_left = trace_photons(eta, diffuse, ABSORPTIONS[dark], DARK_PHOTON_FACTOR * photons, DARK_EVENTS)
        escaped = np.hstack([bright_left, dark_left])
        total, within = escaped.sum(axis=0), np.cumsum(escaped[:-1], axis=0)
        for i, absorbed in enumerate(ABSORPTIONS):
            shares = ",".join(f"{share:.5f}" for share in within[:, i] / total[i])
            lines.append(f"{kind},{1.0 - absorbed:.6g},{total[i]:.6g},{shares}")
    with atomic_file(OUT) as trial:
        trial.write_text("\n".join([*lines, ""]), encoding="utf-8")


def trace_photons(eta: float, diffuse: bool, absorbed: Floats, photons: int, events: int) -> Floats:
    """Return the light (k, m) that leaves through each ring and outside the last, for each albedo [-].

    diffuse : whether light enters from all directions
    events : scattering events after which a path ends
    """

    def batch(seeds: np.random.SeedSequence) -> Floats:
        escaped = np.zeros((len(EDGES), len(absorbed)))
        rng = seeds.generate_state(4, np.uint64).astype(np.uint64)
        _walk(photons // BATCHES, events, eta, diffuse, EDGES**2, np.log1p(-absorbed), rng, escaped)
        return escaped

    with ThreadPoolExecutor() as pool:
        parts = list(pool.map(batch, np.random.SeedSequence(0).spawn(BATCHES)))
    return np.asarray(np.sum(parts, axis=0) / (photons // BATCHES * BATCHES))


@compiled
def _walk(
    photons: int,
    events: int,
    eta: float,
    diffuse: bool,
    edges2: Floats,
    log_albedo: Floats,
    rng: Words,
    escaped: Floats,
) -> None:
    for _ in range(photons):
        x = y = z = ux = uy = 0.0
        uz = math.sqrt(random_uniform(rng)) if diffuse else 1.0
        ux = math.sqrt(1.0 - uz * uz)  # rings are symmetric, so one azimuth suffices
        scatterings = 0
        path = -math.log(random_uniform(rng))
        for _event in range(events):
            to_face = -z / uz if uz < 0.0 else path
            if path <= to_face:
                x, y, z = x + path * ux, y + path * uy, z + path * uz
                ux, uy, uz = scatter_direction(ux, uy, uz, 0.0, rng)
                scatterings += 1
                path = -math.log(random_uniform(rng))
                continue
            x, y, z = x + to_face * ux, y + to_face * uy, 0.0
            path -= to_face
            if eta == 1.0 or random_uniform(rng) >= refract(-uz, eta)[0]:
                ring = int(np.searchsorted(edges2, x * x + y * y, side="right")) - 1
                for k in range(len(log_albedo)):
                    escaped[ring, k] += math.exp(scatterings * log_albedo[k])
                break
            uz = -uz


if __name__ == "__main__":
    run_script(main)
