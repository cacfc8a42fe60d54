"""The shape: control points moved, refined, and the vertices of the surface that they span."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dermis.atlas.atlas import Atlas
from dermis.frame.geometry import HeadResources, upload_geometry
from dermis.frame.passes import each, program
from dermis.frame.shape import LEAST_ACROSS, Shape, make_shape
from dermis.gpu import Frame, Graph, Recorder
from dermis.gpu.program import Resources
from dermis.mesh.geometry import MIN_UV_CROSS
from dermis.mesh.head import Head
from dermis.mesh.rig import Rig


class Motion(NamedTuple):
    """What moves a shape, as the shaders read it.

    positions : three floats for each control point at rest [mm]
    weights : a float for each morph target
    matrices : twelve floats for each bone, row by row, from rest to pose [mm]
    """

    positions: bytes
    weights: bytes = b""
    matrices: bytes = b""


def draw(graph: Frame | Graph, shape: Shape, motion: Motion) -> None:
    """Put the shape where the motion has it."""
    graph.write("shape", shape.rest, motion.positions)
    if motion.weights:
        graph.write("shape", shape.weights, motion.weights)
    if motion.matrices:
        graph.write("shape", shape.matrices, motion.matrices)
    graph.repeat(_evaluate, shape)


def at_rest(frame: Frame, head: Head, atlas: Atlas) -> HeadResources:
    """A head's surface as it rests, in resources of its own."""
    made = make_shape(frame.device, head)
    draw(frame, made, resting(head.control))
    return upload_geometry(frame.device, head.mesh, atlas, made)


def resting(rig: Rig) -> Motion:
    """The motion that leaves a rig where it is."""
    matrices = b"" if rig.skeleton is None else rig.skeleton.matrices().astype(np.float32).tobytes()
    weights = np.zeros(len(rig.targets.names), np.float32).tobytes()
    return Motion(rig.positions_mm.tobytes(), weights, matrices)


def _evaluate(graph: Recorder, shape: Shape) -> None:
    control, points, vertices = shape.counts
    if shape.morphs:
        _each(graph, "shape_pose.wgsl", shape.morphs, control, (("BONED", shape.boned),))
    if shape.stencils:
        _each(graph, "shape_refine.wgsl", shape.stencils, points)
    least = (("LEAST_UV", MIN_UV_CROSS), ("LEAST_ACROSS", LEAST_ACROSS))
    _each(graph, "shape_vertices.wgsl", shape.surface, vertices, least)


def _each(graph: Recorder, name: str, bound: Resources, count: int, constants: Any = ()) -> None:
    """A pass of one invocation for each of `count`."""
    graph.dispatch("shape", program(graph.device, name, constants), bound, each(count))
