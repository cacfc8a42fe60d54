"""Cosines between normal, light, view and half vector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Cosines:
    """Cosines between normal n, light l, view v and half vector h = (l + v) / |l + v|, of equal shape.

    They suffice for isotropic microfacet lobes, as l.v is 2 v_h^2 - 1.
    """

    n_l: Floats
    n_v: Floats
    n_h: Floats
    v_h: Floats

    @property
    def above(self) -> NDArray[np.bool_]:
        """Return the mask of light and view directions that are both above the surface."""
        return (self.n_l > 0.0) & (self.n_v > 0.0)


def cosines(n: Floats, l: Floats, v: Floats) -> Cosines:
    """Return the cosines of unit vectors (..., 3): normal, direction to the light, and to the viewer."""
    h = l + v
    unit = h / np.sqrt(np.maximum((h * h).sum(-1), 1e-12))[..., None]
    n_l, n_v, n_h, v_h = ((a * b).sum(-1) for a, b in ((n, l), (n, v), (n, unit), (v, unit)))
    return Cosines(n_l, n_v, n_h, v_h)
