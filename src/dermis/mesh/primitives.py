"""Meshes of simple shapes for tests, material spheres and calibration pictures."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Ints
from dermis.base.errors import refuse
from dermis.mesh.mesh import Material, Mesh, build_mesh

SKIN_MATERIALS = (Material("skin"),)
# Faces of a box. For each: its corners (x, y, z) in 0..1, clockwise from the top left as seen from outside;
# and the left, top and side length of its chart in uv.
_WEDGE_FACES = (
    (((0, 1, 1), (1, 1, 1), (1, 0, 1), (0, 0, 1)), (0.02, 0.02, 0.45)),
    (((1, 1, 0), (0, 1, 0), (0, 0, 0), (1, 0, 0)), (0.52, 0.02, 0.45)),
    (((1, 1, 1), (1, 1, 0), (1, 0, 0), (1, 0, 1)), (0.02, 0.52, 0.2)),
    (((0, 1, 0), (0, 1, 1), (0, 0, 1), (0, 0, 0)), (0.27, 0.52, 0.2)),
    (((0, 1, 0), (1, 1, 0), (1, 1, 1), (0, 1, 1)), (0.52, 0.52, 0.2)),
    (((0, 0, 1), (1, 0, 1), (1, 0, 0), (0, 0, 0)), (0.77, 0.52, 0.2)),
)


def _grid_triangles(column_count: int, row_count: int) -> tuple[Ints, Ints]:
    """Return the upper and the lower triangle of each cell of a grid, (rows * columns, 3) each.

    Vertices are numbered row by row from the top, columns + 1 in each row.
    """
    row, column = np.mgrid[:row_count, :column_count].astype(np.int32)
    top_left = (row * (column_count + 1) + column).ravel()
    below = top_left + column_count + 1
    upper = np.column_stack((top_left, below + 1, top_left + 1))
    lower = np.column_stack((top_left, below, below + 1))
    return upper, lower


def plane(size_mm: float, segments: int = 1, uv_scale: float = 1.0) -> Mesh:
    """Return a square in the XY plane, centred at the origin, that faces +Z; u is along +X and v along -Y.

    size_mm : length of a side [mm]
    segments : number of cells along each side
    uv_scale : largest u and v, at most 1; the smallest are 0
    """
    if not (size_mm > 0 and segments >= 1 and 0 < uv_scale <= 1):
        actual = f"got {size_mm} mm, {segments} and {uv_scale}"
        refuse("plane", "a size above 0, a segment and a uv_scale in (0, 1]", actual, "Correct the arguments")
    along = np.linspace(0, 1, segments + 1)
    v, u = (axis.ravel() for axis in np.meshgrid(along, along, indexing="ij"))
    positions = size_mm * np.column_stack((u - 0.5, 0.5 - v, np.zeros_like(u)))
    triangles = np.vstack(_grid_triangles(segments, segments))
    uv = uv_scale * np.column_stack((u, v))
    return build_mesh(positions, uv, triangles, np.zeros(len(triangles)), SKIN_MATERIALS)


def uv_sphere(radius_mm: float, segments: int = 64, rings: int = 32) -> Mesh:
    """Return a sphere about the origin with latitude-longitude uv; v is 0 at +Y, the north pole.

    u runs around +Y, from the seam at -Z via -X, so u = 0.5 faces +Z. Each triangle at a pole has a separate
    apex vertex, with u at the middle of the triangle's base, so that no triangle is degenerate in uv.

    radius_mm : radius [mm]
    segments : number of cells around the axis, at least 3
    rings : number of cells from pole to pole, at least 2
    """
    if not (radius_mm > 0 and segments >= 3 and rings >= 2):
        actual = f"got {radius_mm} mm, {segments} and {rings}"
        refuse("uv_sphere", "a radius above 0, 3 segments and 2 rings", actual, "Correct the arguments")
    row, column = (axis.ravel() for axis in np.mgrid[: rings + 1, : segments + 1])
    # the last column has exactly the numbers of the first, so that both are welded
    phi, theta = 2 * np.pi * (column % segments) / segments, np.pi * row / rings
    north, south = row == 0, row == rings
    sine = np.where(north | south, 0.0, np.sin(theta))
    normals = np.column_stack((-sine * np.sin(phi), np.cos(theta), -sine * np.cos(phi)))
    u = (column + 0.5 * north - 0.5 * south) / segments
    uv = np.column_stack((u, row / rings))
    upper, lower = _grid_triangles(segments, rings)
    triangles = np.vstack((upper[segments:], lower[:-segments]))
    used, compact = np.unique(triangles, return_inverse=True)
    corners = compact.reshape(-1, 3)
    material = np.zeros(len(corners))
    return build_mesh(radius_mm * normals[used], uv[used], corners, material, SKIN_MATERIALS, normals[used])


def wedge(side_mm: float, thin_mm: float, thick_mm: float, cells_per_side: int = 4) -> Mesh:
    """Return a closed slab, centred at the origin, that gets thicker along +X, with one uv chart per face.

    side_mm : length along X and Y [mm]
    thin_mm, thick_mm : thickness along Z at -X and at +X [mm]
    cells_per_side : number of cells along each side
    """
    if not (side_mm > 0 and min(thin_mm, thick_mm) > 0 and cells_per_side >= 1):
        actual = f"got {side_mm}, {thin_mm} and {thick_mm} mm and {cells_per_side}"
        refuse("wedge", "sides above 0 and a cell", actual, "Correct the arguments")
    v, u = (axis.ravel() for axis in np.mgrid[: cells_per_side + 1, : cells_per_side + 1] / cells_per_side)
    row, column = (axis.ravel() for axis in np.mgrid[:cells_per_side, :cells_per_side])
    a = row * (cells_per_side + 1) + column
    quads = np.column_stack(
        (a, a + cells_per_side + 1, a + cells_per_side + 2, a, a + cells_per_side + 2, a + 1)
    ).reshape(-1, 3)
    positions, uv, normals, triangles = [], [], [], []
    for index, (corners, (left, top, size)) in enumerate(_WEDGE_FACES):
        c = np.array(corners, float)
        c[:, 2] = (c[:, 2] - 0.5) * np.where(c[:, 0] > 0, thick_mm, thin_mm)
        c[:, :2] = (c[:, :2] - 0.5) * side_mm
        upper = np.outer((1 - u) * (1 - v), c[0]) + np.outer(u * (1 - v), c[1])
        points = upper + np.outer(u * v, c[2]) + np.outer((1 - u) * v, c[3])
        normal = np.cross(c[3] - c[0], c[1] - c[0])
        positions.append(points)
        normals.append(np.tile(normal / np.linalg.norm(normal), (len(points), 1)))
        uv.append(np.column_stack((left + size * u, top + size * v)))
        triangles.append(quads + index * len(points))
    count = sum(map(len, triangles))
    return build_mesh(
        np.vstack(positions),
        np.vstack(uv),
        np.vstack(triangles),
        np.zeros(count),
        SKIN_MATERIALS,
        np.vstack(normals),
    )
