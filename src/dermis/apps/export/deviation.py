"""How wrong a target's skin is against the true one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.optics.curve import Curve
from dermis.optics.media import Floats
from dermis.optics.radial import TINY

_FARTHEST, _DISTANCES = 12.0, 97  # of an edge's distances, in median radii


@dataclass(frozen=True)
class Deviation:
    """What a target shows against what is true, in red, green and blue.

    cdf : (3,) largest difference of the share of light that leaves within a radius [-]
    edge : (3,) largest difference of what leaves beside a straight edge of light: a shadow's [-]
    energy : (3,) light that leaves in all over the true one's, less 1 [-]
    """

    cdf: Floats
    edge: Floats
    energy: Floats

    def as_json(self) -> dict[str, list[float]]:
        """Plain lists of three by name."""
        return {name: [round(float(x), 6) for x in getattr(self, name)] for name in ("cdf", "edge", "energy")}


def deviation(true: Curve, shown: Curve) -> Deviation:
    """How far what is shown is from what is true."""
    steps = np.geomspace(1e-3, 1.0, _DISTANCES)
    widest = _FARTHEST * np.maximum(true.radius_of(0.5), shown.radius_of(0.5))
    edge = np.zeros(3)
    for i in range(3):
        x = widest[i] * steps
        edge[i] = np.abs(shown.edge(x) - true.edge(x))[:, i].max()
    return Deviation(
        cdf=np.abs(shown.within(true.radii_mm) - true.share).max(axis=0),
        edge=edge,
        energy=shown.energy / np.maximum(true.energy, TINY) - 1.0,
    )
