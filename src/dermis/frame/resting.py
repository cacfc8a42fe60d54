"""A head's surface where its person rests, whatever the pose."""

from __future__ import annotations

from typing import Any

from dermis.frame.geometry import HeadResources
from dermis.frame.passes.shape import rest_shape
from dermis.frame.shape import ShapeTables
from dermis.gpu import Device, Memo
from dermis.mesh.head import Head


def resting(
    memo: Memo, device: Device, held: HeadResources, tables: ShapeTables, head: Head, person: Any, index: int
) -> HeadResources:
    """The triangles of an atlas at rest.

    person : (p, 3) places of the head's control points where another person rests, None for the head's own
    index : of the atlas among several
    """
    own = person is None
    positions, of = (head.control.positions_mm, "head") if own else (person, "person")
    shape = memo.keep(rest_shape, device, tables, positions, of=of)
    return memo.keep(HeadResources.shaped, held, shape, of=f"{of} {index}")
