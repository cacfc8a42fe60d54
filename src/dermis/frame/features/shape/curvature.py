"""Curvature of a head's surface, smoothed over the distance that light travels in skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.features.shape.shape import spans_of
from dermis.frame.programs import each, program
from dermis.gpu import Buffer, Device, Recorder
from dermis.mesh.geometry import edges
from dermis.mesh.mesh import Mesh

SMOOTH_MM = 3.0
"""Standard deviation of the smoothing, about the distance that light travels in skin."""

_MOST_STEPS = 256
Index = NDArray[np.int64]
_STAGE = "curvature"


@dataclass(frozen=True, eq=False)
class Curvature:
    """Root mean square of the two principal curvatures at each vertex, smoothed: 1/r on a sphere [1/mm].

    smoothed : buffer of it, one number for each vertex
    between : another, for the steps between
    tables : what lies around each vertex, by the names in curvature.wgsl and curvature_smooth.wgsl
    steps : of the smoothing, as many as reach `SMOOTH_MM` on the head at rest
    vertices : count
    """

    smoothed: Buffer
    between: Buffer
    tables: dict[str, Buffer]
    steps: int
    vertices: int


def make_curvature(device: Device, mesh: Mesh) -> Curvature:
    """Space for the curvature of a mesh, and its tables."""
    corners, count = mesh.point[mesh.triangles].astype(np.int64), len(mesh.positions)
    pairs, _, _ = edges(corners)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    order = np.argsort(corners.ravel(), kind="stable")
    spans = spans_of(corners.ravel()[order], mesh.point), spans_of(both[:, 0], mesh.point)
    a_vertex = np.zeros(int(mesh.point.max()) + 1, np.uint32)
    a_vertex[mesh.point] = np.arange(count)
    tables = {
        "around": np.concatenate(spans, axis=1),
        "triangles": (order // 3).astype(np.uint32),
        "neighbours": a_vertex[both[:, 1]],
    }
    space, between = (device.buffer(np.zeros(count, np.float32), "STORAGE") for _ in range(2))
    buffers = {name: device.buffer(table, "STORAGE") for name, table in tables.items()}
    return Curvature(space, between, buffers, _steps(mesh, pairs, both), count)


def no_curvature(device: Device) -> Buffer:
    """Placeholder for its buffer where nothing reads it."""
    return device.shared("no curvature", lambda: device.buffer(np.zeros(1, np.float32), "STORAGE"))


def _steps(mesh: Mesh, pairs: Index, both: Index) -> int:
    """Steps of averaging over neighbours until the smoothing reaches `SMOOTH_MM`."""
    place = mesh.points_mm
    square = ((place[pairs[:, 0]] - place[pairs[:, 1]]) ** 2).sum(axis=1)
    degree = 1.0 + np.bincount(both[:, 0], minlength=len(place))
    # A step moves a value by an edge or leaves it; its variance along each of the surface's two axes:
    step = 0.5 * float(np.median(square)) * (1.0 - 1.0 / float(np.median(degree)))
    return int(np.clip(np.ceil(SMOOTH_MM**2 / max(step, 1e-12)), 1, _MOST_STEPS))


def draw(graph: Recorder, head: HeadResources, curvature: Curvature) -> None:
    """Find the curvature of the head as it is posed."""
    device, groups = graph.device, each(curvature.vertices)
    # each step reads what the one before wrote; the last leaves its result where the shading reads it
    spaces = [curvature.smoothed, curvature.between]
    if curvature.steps % 2:
        spaces.reverse()
    bound = head.resources | curvature.tables | {"curvatures": spaces[0]}
    graph.dispatch(_STAGE, program(device, "shape/curvature.wgsl"), bound, groups)
    smooth = program(device, "shape/curvature_smooth.wgsl")
    for step in range(curvature.steps):
        before, after = spaces[step % 2], spaces[1 - step % 2]
        smoothing = curvature.tables | {"before": before, "curvatures": after}
        graph.dispatch(_STAGE, smooth, smoothing, groups)
