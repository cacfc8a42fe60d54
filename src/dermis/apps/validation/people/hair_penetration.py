"""Depth of knots of hair inside the skin of people."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.hair.skin_surface import SkinSurface
from dermis.human.person import Human
from dermis.mesh.grown_strands import grow_strands

_MAX_DEPTH_MM = 40.0  # knots deeper than this are on the other side of a thin part or below the bust


class HairPenetration(NamedTuple):
    """Knots of hair inside the skin.

    knots : number of knots, without those at the roots
    inside : number of knots deeper inside the skin than the limit
    deepest_mm : depth of the deepest of them, 0 if there is none [mm]
    """

    knots: int
    inside: int
    deepest_mm: float


def with_style(person: Human, style: str) -> Human:
    """Return a person who wears another hair style, at its usual length."""
    look = replace(person.hair_look, style=style, length_mm=None, fade=None)  # type: ignore[arg-type]  # defaults
    return replace(person, hair=look)


def hair_penetration(person: Human, limit_mm: float, max_strands: int = 3000) -> HairPenetration:
    """Count the knots of a person's hair that are deeper inside the skin than a limit, in the rest pose.

    The depth of a knot is its distance below the tangent planes of the nearest vertices of the skin.

    limit_mm : depth above which knots are counted [mm]
    max_strands : number of strands that are checked
    """
    head = person.head()
    if head.hair is None:
        return HairPenetration(0, 0, 0.0)
    mesh = head.mesh
    skin = np.unique(mesh.triangles[mesh.material == 0])
    strands = grow_strands(head.hair, mesh, mesh.points_mm, max_strands)
    knots = strands.knot_positions_mm(mesh, mesh.points_mm)[:, 1:].reshape(-1, 3)
    depth = _depths(SkinSurface(mesh.positions[skin], mesh.normals[skin]), knots)
    inside = depth[(depth > limit_mm) & (depth < _MAX_DEPTH_MM)]
    return HairPenetration(len(knots), len(inside), float(inside.max(initial=0.0)))


def _depths(surface: SkinSurface, points_mm: Doubles) -> Doubles:
    """Return the depths (n,) of points below the skin; depths are negative outside [mm]."""
    base, normal = surface.project(points_mm)
    return np.asarray(((base - points_mm) * normal).sum(axis=1))
