"""Points that slide over eyeballs: lids, which no motion takes into the eye."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.summary import Summarised
from dermis.mesh.eyeball import SCLERA_MM, apex_mm, clearance_mm

Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False, repr=False)
class Contact(Summarised):
    """Control points that stay off the eyeballs of a head, cornea included, wherever these look.

    point : (n,) control points of lids
    ball : (n,) which of the eyeballs each slides over
    clear_mm : (n,) least distance from its surface, in mm of a usual eye
    apex, back : (k,) control points of each eyeball: the cornea's apex and the one opposite
    edge : (k, r) those of the lids' edges, which touch the eye, once around each opening
    """

    point: Ints
    ball: Ints
    clear_mm: NDArray[np.float32]
    apex: Ints
    back: Ints
    edge: Ints

    def kept_off(self, points_mm: Doubles) -> Doubles:
        """(p, 3) all control points of a posed head, with those of the lids pushed out of the eyes [mm]."""
        apex, back = points_mm[self.apex], points_mm[self.back]
        length = np.linalg.norm(apex - back, axis=1, keepdims=True)
        scale, axis = length / (apex_mm() + SCLERA_MM), (apex - back) / length
        middle, scale = (back + SCLERA_MM * scale * axis)[self.ball], scale[self.ball]
        off = (points_mm[self.point] - middle) / scale
        far, surface = clearance_mm(off, axis[self.ball])
        out = np.maximum(1.0, (surface + self.clear_mm) / np.maximum(far, 1e-6))
        found = points_mm.copy()
        found[self.point] = middle + scale * off * out[:, None]
        return found
