"""Relation of a head to the vertices of its mesh file."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.base.arrays import Doubles, Ints
from dermis.base.summary import ShortRepr


@dataclass(frozen=True, eq=False, repr=False)
class FileVertices(ShortRepr):
    """Vertices of a mesh file from which the points of a head come, for mesh sequences.

    A vertex of the file may be at several points, where sheets are separated, or at none.

    count : number of vertices of the file that its triangles use
    vertex, point : (n,) vertices of the file, and the point of the head at each
    triangles : (f, 3) triangles of the head before any subdivision, as indices in `vertex`
    to_head : (3, 3) rotation from the axes of the file to those of the head
    """

    count: int
    vertex: Ints
    point: Ints
    triangles: Ints
    to_head: Doubles
