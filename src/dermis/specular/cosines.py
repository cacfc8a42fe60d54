"""Cosines between normal, light, view and half vector, from which lobes are evaluated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.renamed import renamed_attribute

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Cosines:
    """Cosines n.l, n.v, n.h and v.h of normal n, light l, view v and half vector h, as arrays of equal shape.

    The half vector is (l + v) / |l + v|. These cosines suffice for isotropic microfacet lobes; the cosine l.v
    follows from v.h as 2 (v.h)^2 - 1.
    """

    n_l: Floats
    n_v: Floats
    n_h: Floats
    v_h: Floats

    @property
    def is_above(self) -> NDArray[np.bool_]:
        """Return the mask of array elements for which light and viewer are both above the surface."""
        return (self.n_l > 0.0) & (self.n_v > 0.0)

    above = renamed_attribute("above", "is_above")


def cosines(n: Floats, l: Floats, v: Floats) -> Cosines:
    """Return the cosines for a normal n, a direction l to the light and a direction v to the viewer.

    n, l, v : (..., 3) unit vectors
    """
    h = l + v
    unit = h / np.sqrt(np.maximum((h * h).sum(-1), 1e-12))[..., None]
    n_l, n_v, n_h, v_h = ((a * b).sum(-1) for a, b in ((n, l), (n, v), (n, unit), (v, unit)))
    return Cosines(n_l, n_v, n_h, v_h)
