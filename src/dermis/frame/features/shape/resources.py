"""Resources of a head's shape."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.shape.curvature import Curvature, make_curvature
from dermis.frame.features.shape.shape import Shape, ShapeTables, make_shape, shape_tables, still_shape
from dermis.frame.request import FrameRequest
from dermis.gpu import Device, Memo
from dermis.mesh.head import Head


@dataclass(frozen=True, eq=False)
class Resources:
    """The shape of a head, which the motion of each frame moves.

    tables : what the shape is made by
    person : the shape of another person at rest, None for the head's own
    curvature : the surface's, None where nothing reads it
    """

    shape: Shape
    tables: ShapeTables
    person: Shape | None
    curvature: Curvature | None


def make(memo: Memo, device: Device, request: FrameRequest) -> Resources:
    """Return the resources of the shape of the requested head."""
    keep = memo.keep
    tables = keep(shape_tables, device, request.topology, of="shared" if request.shares else "")
    return Resources(
        shape=keep(make_shape, device, tables),
        tables=tables,
        person=keep(still_shape, device, tables) if request.person is not None else None,
        curvature=keep(_curvature, device, request.topology) if request.technique.curved else None,
    )


def _curvature(device: Device, head: Head) -> Curvature:
    return make_curvature(device, head.mesh)
