"""Eyebrow hairs: random roots and shapes, and strands traced over the skin around the eyes.

Positions along and across a brow are defined on the mean person as seen from the front, in the xy plane.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.hair.look import HairLook
from dermis.human.hair.skin_surface import tangent_component

_GRID_CELL_MM = 2.5
_GRID_LOW, _GRID_HIGH = (1.0, -2.0), (64.0, 40.0)  # grid around the left brow and the tips of its hairs [mm]
KNOTS_PER_HAIR = 9
_MAX_HAIRS = 1080  # number of hairs of the bushiest brow
# Artist's values along the brow, from its inner to its outer end, in a view from the front [mm]: position,
# half height, angle of the hairs from outwards to upwards, density and length.
_POSITIONS_ALONG_BROW = np.array([0.0, 0.1, 0.25, 0.45, 0.65, 0.85, 1.0])
_CENTRELINE_X_MM = np.array([10.5, 14.5, 21.0, 30.0, 39.5, 48.5, 54.5])
_CENTRELINE_Y_MM = np.array([12.6, 13.2, 14.7, 17.0, 18.4, 16.4, 12.8])
_BROW_HALF_HEIGHT_MM = np.array([2.8, 3.4, 3.7, 3.5, 2.9, 2.0, 1.0])
_HAIR_ANGLES_RADIANS = np.radians([82, 66, 43, 21, 3, -20, -32])
_RELATIVE_HAIR_DENSITY = np.array([0.3, 0.75, 1.0, 1.0, 1.0, 0.9, 0.55])
_HAIR_LENGTH_MM = np.array([4.5, 6.3, 8.0, 9.0, 9.0, 7.5, 5.5])


class SurfacePoints(NamedTuple):
    """Sampled skin points with their normals and tangents.

    position_mm, normal : (n, 3) positions [mm] and unit normals
    derivative_x, derivative_y : (n, 3) tangents of the skin: derivatives of the position with respect to x
        and y, the coordinates of the grid on which `BrowSurface` samples the skin [-]
    """

    position_mm: Doubles
    normal: Doubles
    derivative_x: Doubles
    derivative_y: Doubles

    def xy_steps(self, directions: Doubles, step_length: Doubles) -> tuple[Doubles, Doubles]:
        """Return the changes (n,) of x and (n,) of y by steps along the skin [mm].

        directions : (n, 3) directions of the steps, whose components along the normal are ignored
        step_length : (n,) length of each step along the skin [mm]
        """
        u, v = self.derivative_x, self.derivative_y
        pairs = (u, u), (u, v), (v, v), (u, directions), (v, directions)
        xx, xy, yy, x, y = (_row_dots(a, b) for a, b in pairs)
        dx, dy = yy * x - xy * y, xx * y - xy * x
        scale = step_length / np.sqrt(xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy)
        return scale * dx, scale * dy


def _row_dots(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray(np.einsum("nc,nc->n", a, b))


def brow_grid_points() -> tuple[Doubles, Doubles]:
    """Return x and y (n,) of the grid nodes at which `BrowSurface` samples the skin of the left brow [mm]."""
    x, y = np.meshgrid(*_grid_axes(), indexing="ij")
    return x.ravel(), y.ravel()


def _grid_axes() -> tuple[Doubles, Doubles]:
    x, y = (
        np.arange(low, high + 0.5, _GRID_CELL_MM) for low, high in zip(_GRID_LOW, _GRID_HIGH, strict=True)
    )
    return x, y


class BrowSurface:
    """Skin around the brows of a person, sampled on a grid; brow hairs follow this surface as they grow.

    node_mm : (2 n, 3) the n nodes of `brow_grid_points` on the left brow, then the mirrored nodes on the
        right brow, all projected onto the skin [mm]
    normal : (2 n, 3) unit normals of the skin at these points
    """

    def __init__(self, node_mm: Doubles, normal: Doubles) -> None:
        shape = tuple(map(len, _grid_axes()))
        tangents = np.gradient(node_mm.reshape(2, *shape, 3), _GRID_CELL_MM, axis=(1, 2))
        self._last = np.array(shape) - 1
        plane = (node_mm * normal).sum(axis=1, keepdims=True)
        slopes = [tangent.reshape(-1, 3) for tangent in tangents]
        self._node = np.concatenate([node_mm, normal, *slopes, plane], axis=1)

    def points_at(self, side_sign: Doubles, x: Doubles, y: Doubles) -> SurfacePoints:
        """Return the n skin points with given x and y; positions outside the grid are moved to its border.

        side_sign : (n,) 1 for the left brow, -1 for the right brow
        x, y : (n,) distance from the middle of the face outwards, and height [mm]
        """
        grid = (np.stack([x, y]) - np.array(_GRID_LOW)[:, None]) / _GRID_CELL_MM
        grid = np.clip(grid, 0.0, self._last[:, None] - 1e-9)
        cell = grid.astype(np.int64)
        s, t = grid - cell
        first = cell[0] * (self._last[1] + 1) + cell[1] + (side_sign < 0) * (len(self._node) // 2)
        near = first[:, None] + [0, 1, self._last[1] + 1, self._last[1] + 2]
        weights = np.stack([(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t], axis=-1)
        values = np.einsum("nk,nkc->nc", weights, self._node.take(near, axis=0))
        position, normal, derivative_x, derivative_y, plane = np.split(values, [3, 6, 9, 12], axis=1)
        # a curved surface is as far from its chords as from its tangent planes
        lift = 0.5 * (plane - _row_dots(position, normal)[:, None])
        return SurfacePoints(position + lift * normal, normal, derivative_x, derivative_y)


def sample_positions(rng: np.random.Generator) -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """Return random root positions of n brow hairs as four arrays (n,): u, v, x and y.

    The position along the brow, u, runs from 0 at the inner end to 1 at the outer end. The position across
    the brow, v, is -1 at the lower edge and 1 at the upper edge. The coordinates x and y [mm] are for the
    left brow of the mean person, seen from the front.
    """
    u = rng.random(4 * _MAX_HAIRS)
    accepted = rng.random(len(u)) < np.interp(
        u, _POSITIONS_ALONG_BROW, _RELATIVE_HAIR_DENSITY * _BROW_HALF_HEIGHT_MM / _BROW_HALF_HEIGHT_MM.max()
    )
    u = u[accepted][:_MAX_HAIRS]
    v = np.clip(rng.normal(0.0, 0.52, len(u)), -1.5, 1.5)
    ahead, behind = np.minimum(u + 0.02, 1.0), np.maximum(u - 0.02, 0.0)
    along = np.stack(
        [
            np.interp(ahead, _POSITIONS_ALONG_BROW, c) - np.interp(behind, _POSITIONS_ALONG_BROW, c)
            for c in (_CENTRELINE_X_MM, _CENTRELINE_Y_MM)
        ]
    )
    along /= np.linalg.norm(along, axis=0)
    offset = v * np.interp(u, _POSITIONS_ALONG_BROW, _BROW_HALF_HEIGHT_MM)
    x = np.interp(u, _POSITIONS_ALONG_BROW, _CENTRELINE_X_MM) - along[1] * offset + rng.normal(0, 0.4, len(u))
    y = np.interp(u, _POSITIONS_ALONG_BROW, _CENTRELINE_Y_MM) + along[0] * offset + rng.normal(0, 0.3, len(u))
    return u, v, x, y


def brow_outline(position_across: float) -> Doubles:
    """Return a polyline (k, 2) along the left brow from its inner to its outer end, seen from the front [mm].

    position_across : -1 for the lower edge of the brow, 0 for its centreline, 1 for the upper edge
    """
    along = np.gradient(np.stack([_CENTRELINE_X_MM, _CENTRELINE_Y_MM], axis=-1), axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    x, y = (
        _CENTRELINE_X_MM - position_across * _BROW_HALF_HEIGHT_MM * along[:, 1],
        _CENTRELINE_Y_MM + position_across * _BROW_HALF_HEIGHT_MM * along[:, 0],
    )
    return np.stack([x, y], axis=-1)


def hair_count(hair_look: HairLook) -> int:
    """Return the number of hairs in each brow, which grows with `HairLook.bushy`."""
    return int(_MAX_HAIRS * (0.55 + 0.45 * hair_look.bushy))


def sample_shapes(
    position_along: Doubles, position_across: Doubles, rng: np.random.Generator, hair_look: HairLook
) -> Doubles:
    """Return random shape parameters (5, n) of brow hairs.

    The five rows are: the angle of the hair at its root [rad], the change of this angle from root to tip
    [rad], the length of the hair [mm], its height above the skin [mm], and its radius at the root [mm]. Seen
    from the front, the angle is 0 for a hair that points outwards and pi / 2 for a hair that points up.

    position_along, position_across : (n,) positions along and across the brow, from `sample_positions`
    """
    n = len(position_along)
    # hairs of the upper and the lower half lean towards each other
    angle = (
        np.interp(position_along, _POSITIONS_ALONG_BROW, _HAIR_ANGLES_RADIANS)
        - 0.6 * position_across * np.minimum(2.5 * position_along, 1.0)
        + rng.normal(0, 0.13, n) * (1.0 + 0.8 * np.exp(-position_along / 0.12))
    )
    bend = (
        -0.5
        * np.clip(
            angle
            - np.interp(np.minimum(position_along + 0.2, 1), _POSITIONS_ALONG_BROW, _HAIR_ANGLES_RADIANS),
            0,
            1,
        )
        - 0.25 * position_across * position_along
    )
    bend += rng.normal(0, 0.14, n)
    length = (
        np.interp(position_along, _POSITIONS_ALONG_BROW, _HAIR_LENGTH_MM)
        * rng.uniform(0.45, 1.1, n)
        * (0.85 + 0.3 * hair_look.bushy)
    )
    rise = np.clip(rng.gamma(4.0, 0.15, n), 0.15, 1.3)
    edge = np.minimum(1.0, 0.65 + 3.0 * position_along) * (1.0 - 0.2 * np.abs(position_across))
    radius = rng.uniform(0.022, 0.042, n) * (0.9 + 0.2 * hair_look.bushy) * np.maximum(edge, 0.6)
    return np.stack([angle, bend, length, rise, radius])


def grow_brow_hairs(
    skin: BrowSurface, root_mm: Doubles, side_sign: Doubles, root_xy_mm: Doubles, shape_parameters: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the knots (n, k, 3) and radii (n, k) of brow hairs traced over the skin [mm].

    root_mm : (n, 3) positions of the roots on the skin [mm]
    side_sign : (n,) 1 for hairs of the left brow, -1 for the right
    root_xy_mm : (2, n) x and y of the roots, from `sample_positions` [mm]
    shape_parameters : (5, n) shape parameters from `sample_shapes`
    """
    (x, y), (first_angle, bend, length, rise, radius) = root_xy_mm, shape_parameters
    t = np.linspace(0.0, 1.0, KNOTS_PER_HAIR)
    height = rise[:, None] * (1 - (1 - t) ** 2.2) * (1 - 0.35 * t) - 0.25 * (1 - t) ** 8
    skin_points = skin.points_at(side_sign, x, y)
    root_offset = tangent_component(root_mm - skin_points.position_mm, skin_points.normal)
    base_points, normals = [skin_points.position_mm + root_offset], [skin_points.normal]
    for k in range(2, KNOTS_PER_HAIR, 2):  # odd knots are interpolated, with an error of at most 0.16 mm
        angle = first_angle + bend * (t[k - 1] + t[k]) / 2
        direction = np.stack([side_sign * np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=-1)
        across, up = skin_points.xy_steps(direction, 2 * length / (KNOTS_PER_HAIR - 1))
        x, y = x + across, y + up
        skin_points = skin.points_at(side_sign, x, y)
        base = skin_points.position_mm + root_offset
        base_points += [(base_points[-1] + base) / 2, base]
        normals += [(normals[-1] + skin_points.normal) / 2, skin_points.normal]
    knots = np.stack(base_points, axis=1) + height[..., None] * np.stack(normals, axis=1)
    taper = np.maximum(1.0 - t**2.5, 0.08)
    return knots, radius[:, None] * taper * np.minimum(1.0, 0.75 + t)
