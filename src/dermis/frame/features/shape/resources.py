"""Resources of the shape of a head: buffers of the mesh and rig, the posed vertices, and the curvature."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.shape.curvature import Curvature, make_curvature
from dermis.frame.features.shape.shape import Shape, ShapeTables, make_rest_shape, make_shape, shape_tables
from dermis.frame.request import FrameRequest
from dermis.gpu import Device, Memo


@dataclass(frozen=True, eq=False)
class Resources:
    """Buffers of a head's shape, which each frame's pose moves.

    shape : buffers of the posed shape
    tables : buffers that are constant for a mesh
    rest_shape : buffers of the person at rest. They are None if the person has the control points of the mesh
        itself, which several people can share
    curvature : buffers of the surface's curvature, None unless the technique reads it
    """

    shape: Shape
    tables: ShapeTables
    rest_shape: Shape | None
    curvature: Curvature | None


def make_resources(memo: Memo, device: Device, request: FrameRequest) -> Resources:
    """Return the buffers from which the shape of the requested head is computed."""
    cached, mesh = memo.get, request.topology_head.mesh
    tables = cached(
        shape_tables, device, request.topology_head, caller_name="shared" if request.has_shared_mesh else ""
    )
    return Resources(
        shape=cached(make_shape, device, tables),
        tables=tables,
        rest_shape=cached(make_rest_shape, device, tables) if request.rest_positions_mm is not None else None,
        curvature=cached(make_curvature, device, mesh) if request.technique.needs_curvature else None,
    )
