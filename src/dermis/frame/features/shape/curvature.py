"""Curvature of the head's surface, smoothed over the distance that light travels in skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.shape.shape import run_bounds
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Buffer, Device, Recorder
from dermis.mesh.geometry import edges
from dermis.mesh.mesh import Mesh

SMOOTHING_SIGMA_MM = 3.0
"""Standard deviation of the smoothing [mm], about the distance that light travels in skin."""

_MAX_SMOOTHING_STEPS = 256
Index = NDArray[np.int64]
_CURVATURE_STAGE = "curvature"


@dataclass(frozen=True, eq=False)
class Curvature:
    """Smoothed root mean square of the two principal curvatures at each vertex [1/mm].

    On a sphere of radius r, this curvature is 1/r.

    smoothed : buffer of the smoothed curvature, one float per vertex
    scratch : buffer for intermediate results of the smoothing
    tables : dictionary from names in the shaders to buffers of the triangles and neighbours of each vertex
    steps : number of smoothing steps. On the head at rest, all steps together smooth with the standard
        deviation `SMOOTHING_SIGMA_MM`
    vertices : number of vertices
    """

    smoothed: Buffer
    scratch: Buffer
    tables: dict[str, Buffer]
    steps: int
    vertices: int


def make_curvature(device: Device, mesh: Mesh) -> Curvature:
    """Create the buffers that are needed to compute the curvature of a mesh."""
    corners, count = mesh.point[mesh.triangles].astype(np.int64), len(mesh.positions)
    pairs, _, _ = edges(corners)
    directed = np.concatenate([pairs, pairs[:, ::-1]])
    directed = directed[np.argsort(directed[:, 0], kind="stable")]
    order = np.argsort(corners.ravel(), kind="stable")
    spans = run_bounds(corners.ravel()[order], mesh.point), run_bounds(directed[:, 0], mesh.point)
    vertex_of_point = np.zeros(int(mesh.point.max()) + 1, np.uint32)
    vertex_of_point[mesh.point] = np.arange(count)
    tables = {
        "around": np.concatenate(spans, axis=1),
        "triangles": (order // 3).astype(np.uint32),
        "neighbours": vertex_of_point[directed[:, 1]],
    }
    smoothed, scratch = (device.buffer(np.zeros(count, np.float32), "STORAGE") for _ in range(2))
    buffers = {name: device.buffer(table, "STORAGE") for name, table in tables.items()}
    return Curvature(smoothed, scratch, buffers, _smoothing_step_count(mesh, pairs, directed), count)


def placeholder_curvature(device: Device) -> Buffer:
    """Return a placeholder for the curvature buffer, for frames whose technique does not read it."""
    return device.cached("no curvature", lambda: device.buffer(np.zeros(1, np.float32), "STORAGE"))


def _smoothing_step_count(mesh: Mesh, edge_points: Index, directed_edges: Index) -> int:
    """Return the number of smoothing steps whose combined standard deviation is `SMOOTHING_SIGMA_MM`.

    edge_points : (e, 2) indices of the two points of each edge of the mesh
    directed_edges : (2 e, 2) the edges in both directions, sorted by their first point
    """
    points = mesh.points_mm
    square = ((points[edge_points[:, 0]] - points[edge_points[:, 1]]) ** 2).sum(axis=1)
    degree = 1.0 + np.bincount(directed_edges[:, 0], minlength=len(points))
    # One step moves a value along an edge, or not at all. Its variance along each of the surface's two axes:
    step = 0.5 * float(np.median(square)) * (1.0 - 1.0 / float(np.median(degree)))
    return int(np.clip(np.ceil(SMOOTHING_SIGMA_MM**2 / max(step, 1e-12)), 1, _MAX_SMOOTHING_STEPS))


def draw(graph: Recorder, head: HeadGeometry, curvature: Curvature) -> None:
    """Declare the passes that compute the curvature of the posed head."""
    device, groups = graph.device, workgroup_grid(curvature.vertices)
    # the buffers alternate as source and target, so that the last step writes to `smoothed`
    buffers = [curvature.smoothed, curvature.scratch]
    if curvature.steps % 2:
        buffers.reverse()
    bound = head.resources | curvature.tables | {"curvatures": buffers[0]}
    graph.dispatch(_CURVATURE_STAGE, program(device, "shape/curvature.wgsl"), bound, groups)
    smooth = program(device, "shape/curvature_smooth.wgsl")
    for step in range(curvature.steps):
        before, after = buffers[step % 2], buffers[1 - step % 2]
        smoothing = curvature.tables | {"before": before, "curvatures": after}
        graph.dispatch(_CURVATURE_STAGE, smooth, smoothing, groups)
