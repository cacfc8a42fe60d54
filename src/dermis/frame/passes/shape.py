"""The shape: control points moved, refined, and the vertices of the surface that they span."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.passes import each, program
from dermis.frame.shape import LEAST_ACROSS, Shape, ShapeTables, displacements, make_shape
from dermis.gpu import Bindings, CommandList, Device, Graph, Recorder
from dermis.mesh.geometry import MIN_UV_CROSS
from dermis.mesh.rig import Rig


class MotionBytes(NamedTuple):
    """What moves a shape, as the shaders read it.

    positions : three floats for each control point at rest [mm]
    weights : a float for each morph target
    matrices : twelve floats for each bone, row by row, from rest to pose [mm]
    displacements : by morph targets, from `frame.shape.displacements`, of a person whose tables are shared
    """

    positions: bytes
    weights: bytes = b""
    matrices: bytes = b""
    displacements: bytes = b""

    @property
    def at_rest(self) -> MotionBytes:
        """That of a shape which nothing moves."""
        return MotionBytes(self.positions)


def draw(graph: CommandList | Graph, shape: Shape, motion: MotionBytes) -> None:
    """Put the shape where the motion has it."""
    graph.write("shape", shape.rest, motion.positions)
    if motion.weights:
        graph.write("shape", shape.weights, motion.weights)
    if motion.matrices:
        graph.write("shape", shape.matrices, motion.matrices)
    if motion.displacements:
        graph.write("shape", shape.morphs["displacements"], motion.displacements)
    graph.repeat(_evaluate, shape)


def still_shape(device: Device, tables: ShapeTables) -> Shape:
    """Space for the shape of a person at rest."""
    return make_shape(device, tables, moves=False)


def rest_shape(device: Device, tables: ShapeTables, positions_mm: NDArray[np.float32]) -> Shape:
    """The shape of a person at rest, evaluated at once.

    positions_mm : (p, 3) of the control points
    """
    made, frame = still_shape(device, tables), CommandList(device, timed=False)
    draw(frame, made, MotionBytes(positions_mm.tobytes()))
    frame.submit()
    return made


def resting(rig: Rig) -> MotionBytes:
    """The motion that leaves a rig where it is."""
    weights, matrices, positions = (array.tobytes() for array in rig.rest)
    if rig.template is None or not rig.targets.names:
        return MotionBytes(positions, weights, matrices)
    own = displacements(rig.targets, rig.template.targets)
    return MotionBytes(positions, weights, matrices, own.tobytes())


def _evaluate(graph: Recorder, shape: Shape) -> None:
    tables = shape.tables
    if shape.morphs:
        moving = ("BONED", tables.bones > 0), ("SLIDES", tables.slides)
        _each(graph, "shape_pose.wgsl", shape.morphs, tables.control, moving)
    if shape.stencils:
        _each(graph, "shape_refine.wgsl", shape.stencils, tables.points)
    least = (("LEAST_UV", MIN_UV_CROSS), ("LEAST_ACROSS", LEAST_ACROSS))
    _each(graph, "shape_vertices.wgsl", shape.surface, tables.vertices, least)


def _each(graph: Recorder, name: str, bound: Bindings, count: int, constants: Any = ()) -> None:
    """A pass of one invocation for each of `count`."""
    graph.dispatch("shape", program(graph.device, name, constants), bound, each(count))
