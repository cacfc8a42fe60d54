"""The shape: control points moved, refined, and the vertices of the surface that they span."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.passes import each, program
from dermis.frame.shape import LEAST_ACROSS, Shape, make_shape
from dermis.gpu import Device, Frame, Graph, Recorder
from dermis.gpu.program import Resources
from dermis.mesh.geometry import MIN_UV_CROSS
from dermis.mesh.head import Head
from dermis.mesh.rig import Rig, no_targets


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


def rest_shape(device: Device, head: Head, person: NDArray[np.float32] | None = None) -> Shape:
    """A head's shape as it rests, evaluated in resources of its own.

    person : (p, 3) other places of its control points, those of another person [mm]
    """
    rig = replace(head.control, targets=no_targets(), skeleton=None)
    made, frame = make_shape(device, replace(head, rig=rig)), Frame(device, timed=False)
    draw(frame, made, Motion((rig.positions_mm if person is None else person).tobytes()))
    frame.submit()
    return made


def resting(rig: Rig) -> Motion:
    """The motion that leaves a rig where it is."""
    weights, matrices, positions = (array.tobytes() for array in rig.rest)
    return Motion(positions, weights, matrices)


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
