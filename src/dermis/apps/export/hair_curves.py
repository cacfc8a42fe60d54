"""Hair of a head as curves, for renderers that have curve shapes and hair materials."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from dermis.apps.truths.person.shapes import MAX_HAIR_GROUPS, group_by_optical_depth
from dermis.base.arrays import Doubles, Floats
from dermis.mesh.grown_strands import grow_strands
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands

MAX_CURVES = 16_000
"""Largest number of curves of scalp hair and beard; larger numbers of hairs become fewer, wider curves."""
HAIR_LIMITATIONS = (
    f"Scalp hair and beard are at most {MAX_CURVES:,} curves in the rest pose, which are wider if a head has "
    f"more hairs. The absorption of hairs is averaged in {MAX_HAIR_GROUPS} groups."
)
"""Sentences about hair in `limitations` of export targets that write curves."""


class CurveGroup(NamedTuple):
    """Hairs with similar absorption.

    name : name of the group, such as "hair_3"
    knots_mm : (n, k, 3) points through which the curves pass, relative to the centre of the head [mm]
    radius_mm : (n, k) radii of the fibres at these points [mm]
    optical_depth : (3,) mean absorption coefficient of the fibres times their radius [-]
    """

    name: str
    knots_mm: Doubles
    radius_mm: Floats
    optical_depth: Doubles


def curve_groups(head: Head) -> Iterator[CurveGroup]:
    """Yield the brows, lashes and hair of a head in groups; nothing for a head without hair."""
    groom, mesh = head.hair, head.mesh
    hair = None if groom is None else grow_strands(groom, mesh, mesh.points_mm, MAX_CURVES).without_hidden
    for name, strands in (("brows_and_lashes", head.strands), ("hair", hair)):
        if strands is not None and len(strands):
            yield from _groups_of(name, head, strands)


def _groups_of(name: str, head: Head, strands: Strands) -> Iterator[CurveGroup]:
    knots = strands.knot_positions_mm(head.mesh, head.mesh.points_mm) - np.array(head.centre_mm)
    optical_depth = strands.absorption.astype(np.float64) * strands.radius_mm.max(axis=1, keepdims=True)
    for number, group in enumerate(group_by_optical_depth(optical_depth)):
        mean = optical_depth[group].mean(axis=0)
        yield CurveGroup(f"{name}_{number}", knots[group], strands.radius_mm[group], mean)
