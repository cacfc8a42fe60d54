"""Correspondence between the points of a head and the vertices of its mesh file."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.base.arrays import Doubles, Ints
from dermis.base.summary import ShortRepr


@dataclass(frozen=True, eq=False, repr=False)
class FileVertices(ShortRepr):
    """Correspondence between the vertices of a mesh file and the points of a head, for mesh sequences.

    If the mesh was repaired, a vertex of the file may have no point, or may have several points where two
    layers of the surface were separated.

    count : number of vertices that the triangles of the file use
    vertex : (n,) vertex indices in the file
    point : (n,) index of the head's point at each of these vertices
    triangles : (f, 3) triangles of the head before any subdivision, as indices into `vertex`
    to_head : (3, 3) rotation from the axes of the file to the axes of the head
    """

    count: int
    vertex: Ints
    point: Ints
    triangles: Ints
    to_head: Doubles
