"""Hairs as they are grown, before they are joined."""

from __future__ import annotations

from typing import NamedTuple

from dermis.mesh.strands import Doubles, Roots


class Grown(NamedTuple):
    """Hairs of one kind; all but `roots` in the space of the person.

    knots, radius : (n, k, 3) and (n, k) [mm]
    darker : factor of their pigments
    bundle : how many hairs each stands for
    cover : of roots by the hair around them
    """

    roots: Roots
    knots: Doubles
    radius: Doubles
    darker: float
    bundle: float = 1.0
    cover: float = 0.0
