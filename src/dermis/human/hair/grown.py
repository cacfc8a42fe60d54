"""Hairs as they are grown, before they are joined."""

from __future__ import annotations

from typing import NamedTuple

from dermis.mesh.mesh import Floats
from dermis.mesh.strands import Doubles, Roots


class Grown(NamedTuple):
    """Hairs of one kind.

    ways : (n, k, 3) from the root, as `Strands.knots_mm` has them
    radius : (n, k) [mm]
    darker : factor of their pigments
    bundle : how many hairs each stands for
    cover : of roots by the hair around them
    """

    roots: Roots
    ways: Floats
    radius: Doubles
    darker: float
    bundle: float = 1.0
    cover: float = 0.0
