"""Skin of neck and torso as a dense sheet to which cloth is bound, and rings around the neck on it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index, Ints, Mask
from dermis.human.makehuman import mesh_point_count
from dermis.human.model import MEAN_PERSON_WEIGHTS, control_points_mm, head_template
from dermis.mesh.geometry import edges

if TYPE_CHECKING:
    from scipy.sparse import csr_array

RING_SIZE = 192
"""Number of columns of a ring around the neck; column 0 is at the front, columns proceed to the left."""
_SHEET_LEVELS = 2  # levels of subdivision of the sheet; its triangles are about 6 mm wide
_HIGHEST_LEVEL_MM = -110.0  # level of the highest skin of the sheet, below the ears
NECK_AXIS_Z_MM = -92.0
"""Depth of the vertical axis about which rings run, on the mean person [mm]."""

_FRONT_BASE_YZ_MM = -197.0, -43.0  # height and depth of the base of the neck at its front
_BASE_SLOPE = -0.417  # slope of the base of the neck along z
_BASE_RISE = 0.42  # slope of the base of the neck towards the sides
_BASE_ROUNDING_MM = 38.0  # half width of the rounded middle of the base


def levels_mm(mean_mm: Doubles) -> Doubles:
    """Return the distances (n,) of points on the mean person below the base of the neck [mm].

    The distances are negative on the neck. The base of the neck is a rounded curve, as necklines are.
    """
    x, y, z = mean_mm.T
    side = np.hypot(x, _BASE_ROUNDING_MM) - _BASE_ROUNDING_MM
    front_y, front_z = _FRONT_BASE_YZ_MM
    return np.asarray(front_y + _BASE_SLOPE * (z - front_z) + _BASE_RISE * side - y)


class SkinSheet(NamedTuple):
    """Dense triangles of the skin from the jaw to the lower border of the bust.

    weights : (n, p) weights of the control points in each point of the sheet
    triangles : (t, 3) indices of points of the sheet, counter-clockwise seen from outside
    mean_mm : (n, 3) points on the mean person [mm]
    level_mm : (n,) distance of the points below the base of the neck, negative on the neck [mm]
    """

    weights: csr_array
    triangles: Ints
    mean_mm: Doubles
    level_mm: Doubles

    def fit(self, control_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Return the points (n, 3) of a person's sheet and the unit normals (n, 3) of the skin there [mm].

        control_mm : (p, 3) control points of the person
        """
        points = np.asarray(self.weights @ control_mm[: self.weights.shape[1]])
        return points, point_normals(points, self.triangles)


def point_normals(points: Doubles, triangles: Ints) -> Doubles:
    """Return unit normals (n, 3) at points (n, 3), from the areas of the adjacent triangles."""
    corners = points[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = triangles.ravel()
    total = np.stack([np.bincount(flat, np.repeat(area[:, k], 3), len(points)) for k in range(3)], axis=1)
    return unit_vectors(total.astype(np.float64))


def unit_vectors(vectors: Doubles) -> Doubles:
    """Return vectors (..., 3) scaled to length 1; zero vectors stay zero."""
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))


@cache
def skin_sheet() -> SkinSheet:
    """Return the sheet of skin on which garments are defined; it is the same for all people."""
    return _sheet_where(lambda points: (levels_mm(points) > _HIGHEST_LEVEL_MM) & _is_outer_skin(points))


@cache
def head_sheet() -> SkinSheet:
    """Return the sheet of skin to which glasses are fitted; it is the same for all people."""
    return _sheet_where(lambda points: (points[:, 1] > -62.0) & _is_outside_sockets(points))


def _sheet_where(is_wanted: Callable[[Doubles], Mask]) -> SkinSheet:
    """Return the triangles of the skin whose corners on the mean person are all wanted.

    is_wanted : function from points (n, 3) to a mask (n,)
    """
    template = head_template("own", _SHEET_LEVELS)
    assert template.refinement is not None
    mean = control_points_mm(MEAN_PERSON_WEIGHTS).astype(np.float64)
    points, mesh = np.asarray(template.refinement.weights @ mean), template.head.mesh
    level = levels_mm(points)
    corners = mesh.point[mesh.triangles[mesh.material == 0]]
    inside = is_wanted(points)[corners].all(axis=1)
    used, triangles = np.unique(corners[inside], return_inverse=True)
    weights = template.refinement.weights[used][:, : mesh_point_count()]
    return SkinSheet(weights.tocsr(), triangles.reshape(-1, 3).astype(np.int32), points[used], level[used])


def _is_outside_sockets(points: Doubles) -> Mask:
    """Return a mask (n,) of points (n, 3) that are not in the mouth, or deep in nose and eye sockets."""
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    in_socket = (np.hypot((x - 30.0) / 16.0, y / 9.0) < 1.0) & (z < 2.0) & (z > -40.0)
    in_mouth = (x < 25.0) & (y < -40.0) & (z < 20.0) & (z > -60.0)
    return np.asarray(~in_socket & ~in_mouth)


def _is_outer_skin(points: Doubles) -> Mask:
    """Return a mask (n,) of points (n, 3) that are not in the mouth, on lips or ears."""
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    return np.asarray(((z < -30.0) | (y < -95.0)) & ((x < 62.0) | (y < -75.0)))


class Cut(NamedTuple):
    """Part of the sheet below a border line, whose triangles are cut along the line.

    bind : (m, n) weights of the points of the sheet in each point of the part
    triangles : (t, 3) indices of points of the part
    on_border : (m,) whether a point is on the border line
    """

    bind: csr_array
    triangles: Ints
    on_border: np.ndarray[tuple[int], np.dtype[np.bool_]]


def cut_below(field_mm: Doubles) -> Cut:
    """Return the part of the sheet where a field (n,) over its points is positive."""
    from scipy.sparse import csr_array

    triangles, inside = skin_sheet().triangles, field_mm > 0.0
    count = inside[triangles].sum(axis=1)
    whole = triangles[count == 3]
    cut_edges, made = list[Doubles](), list[Index]()
    for wanted, corner_count in ((1, 1), (2, 2)):
        part = triangles[count == wanted]
        lone = (inside[part] == (corner_count == 1)).argmax(axis=1)  # the corner that differs from the others
        a, b, c = (np.take_along_axis(part, ((lone + k) % 3)[:, None], 1)[:, 0] for k in range(3))
        cut_edges.append(np.stack([np.stack([a, b], 1), np.stack([a, c], 1)], axis=1))
        made.append(np.stack([a, b, c], axis=1))
    pairs = np.sort(np.concatenate(cut_edges).reshape(-1, 2), axis=1)
    unique, at = np.unique(pairs, axis=0, return_inverse=True)
    at = at.ravel() + len(field_mm)
    first, second = (part.reshape(-1, 2) for part in np.split(at, [2 * len(made[0])]))
    cut = [np.stack([made[0][:, 0], first[:, 0], first[:, 1]], axis=1)]
    ab, ac = second.T
    b, c = made[1][:, 1], made[1][:, 2]
    cut += [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
    joined = np.concatenate([whole, *cut])
    used, corners = np.unique(joined, return_inverse=True)
    f = field_mm[unique]
    t = f[:, 0] / (f[:, 0] - f[:, 1])
    n, m = len(field_mm), len(unique)
    rows = np.concatenate([np.arange(n), np.repeat(np.arange(m), 2) + n])
    columns = np.concatenate([np.arange(n), unique.ravel()])
    values = np.concatenate([np.ones(n), np.stack([1 - t, t], 1).ravel()])
    bind = csr_array((values, (rows, columns)), shape=(n + m, n))
    return Cut(bind[used], corners.reshape(-1, 3).astype(np.int32), used >= n)


def ring_around(field_mm: Doubles) -> csr_array:
    """Return weights (RING_SIZE, n) of sheet points in a closed ring where a field over them is zero.

    The columns of the ring are at equal angles about the axis of the neck on the mean person.
    """
    from scipy.sparse import csr_array

    sheet, sides = skin_sheet(), _sheet_edges()
    crossed = sides[(field_mm[sides] > 0.0).sum(axis=1) == 1]
    values = field_mm[crossed]
    share = values[:, 0] / (values[:, 0] - values[:, 1])
    first, second = crossed.T
    points = (1.0 - share)[:, None] * sheet.mean_mm[first] + share[:, None] * sheet.mean_mm[second]
    angle = np.arctan2(points[:, 0], points[:, 2] - NECK_AXIS_Z_MM) % (2 * np.pi)
    order = np.argsort(angle)
    angle = angle[order]
    wanted = np.arange(RING_SIZE) * 2 * np.pi / RING_SIZE
    after = np.searchsorted(angle, wanted) % len(angle)
    before = after - 1
    gap = (angle[after] - angle[before]) % (2 * np.pi)
    t = ((wanted - angle[before]) % (2 * np.pi)) / np.where(gap > 0.0, gap, 1.0)
    near = np.stack([order[before], order[after]], axis=1)
    weights = np.stack([1.0 - t, t], axis=1)
    shared = np.stack([weights * (1.0 - share[near]), weights * share[near]], axis=-1)
    rows = np.repeat(np.arange(RING_SIZE), 4)
    return csr_array((shared.ravel(), (rows, crossed[near].ravel())), shape=(RING_SIZE, len(field_mm)))


@cache
def _sheet_edges() -> Index:
    """Return the edges (e, 2) of the sheet as pairs of points, each edge once."""
    return edges(skin_sheet().triangles)[0]
