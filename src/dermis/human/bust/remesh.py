"""Half a bust as even triangles on an implicit mesh: marching cubes, then whole-array remeshing.

Remeshing splits, collapses, flips, relaxes and projects. The border of the half lies in the plane x = 0 and
stays there. Source: [BotschKobbelt2004].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.human.bust.fields import Doubles, Field, gradient
from dermis.human.bust.half_mesh import Flags, HalfMesh, Index, collapse, flip
from dermis.mesh.geometry import edges, sum_at

# Stretches along x, y and z: start, end, spacing [mm]; fine where ears and nose are.
_STRETCHES = (
    ((0, 60, 3.0), (60, 105, 1.5), (105, 225, 6.0)),
    ((-275, -120, 6.0), (-120, 45, 2.5), (45, 130, 5.0)),
    ((-125, -60, 5.0), (-60, 25, 2.0), (25, 130, 3.0)),
)
_STRIDE = 3  # nodes of the first, coarse look at the field
_COARSENING = 10  # passes that thin out what marching cubes made too fine


def polygonise(field: Field) -> HalfMesh:
    """Marching cubes [Lewiner2003] over an uneven grid for x >= 0, open in the plane x = 0."""
    from skimage import measure

    marching_cubes: Any = measure.marching_cubes
    axes = [_axis(stretches) for stretches in _STRETCHES]
    places, triangles, _, _ = marching_cubes(_sample(field, axes), 0.0)
    points = [np.interp(places[:, k], np.arange(len(axis)), axis) for k, axis in enumerate(axes)]
    return HalfMesh(np.column_stack(points), triangles.astype(np.int64))


def _axis(stretches: tuple[tuple[float, float, float], ...]) -> Doubles:
    """Coordinates along stretches that follow each other [mm]."""
    parts = [np.arange(start, end - 1e-6, step) for start, end, step in stretches]
    return np.concatenate([*parts, [stretches[-1][1]]])


def _sample(field: Field, axes: list[Doubles]) -> Doubles:
    """The field at all nodes: in full near the surface, elsewhere as at the nearest node of a coarse grid."""
    nearest = [np.minimum((np.arange(len(axis)) + 1) // _STRIDE * _STRIDE, len(axis) - 1) for axis in axes]
    grid = _grid(axes)
    away = np.linalg.norm(grid - _grid([axis[k] for axis, k in zip(axes, nearest, strict=True)]), axis=-1)
    kept = [np.unique(k, return_inverse=True) for k in nearest]
    coarse = grid[np.ix_(*[nodes for nodes, _ in kept])]
    values = field(coarse.reshape(-1, 3)).reshape(coarse.shape[:3])[np.ix_(*[back for _, back in kept])]
    near = np.abs(values) < 1.6 * away + 6
    values[near] = field(grid[near])
    return values


def _grid(axes: list[Doubles]) -> Doubles:
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def remesh(mesh: HalfMesh, field: Field, size: Field, rounds: int) -> HalfMesh:
    """The surface with edges of about `size` [mm] at each place, its points on the field's zero."""
    for _ in range(_COARSENING):
        mesh = collapse(mesh, size)
    for turn in range(rounds):
        mesh = split(mesh, size)
        mesh = collapse(mesh, size)
        mesh = collapse(mesh, size)
        mesh = flip(flip(mesh))
        mesh = relax(mesh, field, size, passes=2 if turn < rounds - 1 else 3)
        mesh = flip(mesh)
    return part_bridges(mesh, field)


def part_bridges(mesh: HalfMesh, field: Field) -> HalfMesh:
    """Edges inside the half that join two points of its border, cut: they would be their own images."""
    p, t, border = mesh.points, mesh.triangles, mesh.on_border
    ends, of_side, counts = edges(t)
    bridge = (counts == 2) & border[ends].all(axis=1)
    if not bridge.any():
        return mesh
    opposite = np.roll(t, 1, axis=1).T.ravel()  # the corner that faces each side
    sides = bridge[of_side]
    number = np.full(len(ends), -1, dtype=np.int64)
    number[bridge] = len(p) + np.arange(bridge.sum())
    facing = sum_at(number[of_side[sides]] - len(p), p[opposite[sides]], int(bridge.sum())) / 2
    points = (p[ends[bridge]].mean(axis=1) + facing) / 2
    for _ in range(3):
        slope = gradient(field, points, np.full(len(points), 0.1))
        points -= slope * (field(points) / np.einsum("ni,ni->n", slope, slope))[:, None]
    return HalfMesh(np.vstack((p, points)), _cut_triangles(p, t, number[of_side].reshape(3, -1).T))


def split(mesh: HalfMesh, size: Field) -> HalfMesh:
    """Each edge longer than 4/3 of the size cut in its middle; triangles become two, three or four."""
    p, t = mesh.points, mesh.triangles
    ends, of_side, _ = edges(t)
    middle = p[ends].mean(axis=1)
    long = np.linalg.norm(p[ends[:, 0]] - p[ends[:, 1]], axis=1) > 4 / 3 * size(middle)
    number = np.full(len(ends), -1, dtype=np.int64)
    number[long] = len(p) + np.arange(long.sum())
    cut = number[of_side].reshape(3, -1).T
    return HalfMesh(np.vstack((p, middle[long])), _cut_triangles(p, t, cut))


def _cut_triangles(p: Doubles, t: Index, cut: Index) -> Index:
    """Triangles with new points `cut` (m, 3) on the sides 01, 12, 20, or -1 where a side is whole."""
    count = (cut >= 0).sum(axis=1)
    pieces = [t[count == 0]]
    # turned so that with one cut it is side 01, and with two it is 20 that is whole
    first = np.where(count == 1, cut.argmax(axis=1), (cut.argmin(axis=1) + 1) % 3)
    order = (first[:, None] + np.arange(3)) % 3
    t, cut = np.take_along_axis(t, order, 1), np.take_along_axis(cut, order, 1)
    a, b, c, ab, bc, ca = *t.T, *cut.T
    one, two, three = count == 1, count == 2, count == 3
    pieces += [_columns(one, a, ab, c), _columns(one, ab, b, c)]
    pieces += [_columns(two, ab, b, bc), _columns(two, a, ab, bc), _columns(two, a, bc, c)]
    pieces += [_columns(three, *corner) for corner in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
    return np.vstack(pieces)


def _columns(chosen: Flags, *columns: Index) -> Index:
    return np.column_stack([column[chosen] for column in columns])


def relax(mesh: HalfMesh, field: Field, size: Field, passes: int) -> HalfMesh:
    """Points moved along the surface to the middle of their triangles, then onto the field's zero."""
    p, t, border = mesh.points.copy(), mesh.triangles, mesh.on_border
    for _ in range(passes):
        corners = p[t]
        centre = corners.mean(axis=1)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        weight = np.maximum(area / size(centre) ** 2, 1e-6)
        rows = np.repeat(np.column_stack((centre * weight[:, None], weight)), 3, axis=0)
        summed = sum_at(t.ravel(), rows, len(p))
        towards = summed[:, :3] / summed[:, 3:] - p
        normal = _vertex_normals(p, t)
        normal[border, 0] = 0
        # along the border, the centre of the whole fan is that of its half with x = 0
        towards -= np.einsum("ni,ni->n", towards, normal)[:, None] * normal
        towards[border, 0] = 0
        p = project(p + 0.6 * towards, field, size)
        p[border, 0] = 0
    return HalfMesh(p, t)


def _vertex_normals(p: Doubles, t: Index) -> Doubles:
    faces = np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]])
    summed = sum_at(t.ravel(), np.repeat(faces, 3, axis=0), len(p))
    return np.asarray(summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), 1e-12))


def project(points: Doubles, field: Field, size: Field) -> Doubles:
    """Points moved by Newton's step onto the field's zero, by a third of the size at most."""
    slope = gradient(field, points)
    step = slope * (field(points) / np.maximum(np.einsum("ni,ni->n", slope, slope), 0.05))[:, None]
    length, most = np.linalg.norm(step, axis=1), size(points) / 3
    return np.asarray(points - step * (most / np.maximum(length, most))[:, None])
