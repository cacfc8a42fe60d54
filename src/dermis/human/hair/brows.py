"""Brows: hairs rooted in the skin around the eyes, on a grid over the front plane of the mean person."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.hair.look import HairLook
from dermis.human.hair.skin_surface import tangent_component

_CELL_MM = 2.5
_GRID_LOW, _GRID_HIGH = (1.0, -2.0), (64.0, 40.0)  # around the left brow and the tips of its hairs [mm]
KNOTS = 9
_MAX_HAIRS = 760  # hairs of the bushiest brow
# Artist's values along the brow, from its inner to its outer end, on a head seen from the front [mm]: its
# middle, half of its height, where its hairs point from outwards to upwards, how dense and long they are.
_ALONG = np.array([0.0, 0.1, 0.25, 0.45, 0.65, 0.85, 1.0])
_X = np.array([10.5, 14.5, 21.0, 30.0, 39.5, 48.5, 54.5])
_Y = np.array([12.6, 13.2, 14.7, 17.0, 18.4, 16.4, 12.8])
_HALF_HEIGHT = np.array([2.8, 3.4, 3.7, 3.5, 2.9, 2.0, 1.0])
_ANGLES = np.radians([82, 66, 43, 21, 3, -20, -32])
_DENSITY = np.array([0.3, 0.75, 1.0, 1.0, 1.0, 0.9, 0.55])
_LENGTH = np.array([4.5, 6.3, 8.0, 9.0, 9.0, 7.5, 5.5])


class SurfacePoints(NamedTuple):
    """Where hairs are on the skin.

    place, normal : (n, 3) [mm]
    along_x, along_y : (n, 3) by how much the place moves with those on the front plane [-]
    """

    place: Doubles
    normal: Doubles
    along_x: Doubles
    along_y: Doubles

    def step(self, directions: Doubles, length: Doubles) -> tuple[Doubles, Doubles]:
        """Along x and y of the front plane, how far what lies of ways (n, 3) along the skin leads [mm].

        length : (n,) of the step on the skin [mm]
        """
        u, v = self.along_x, self.along_y
        xx, xy, yy, x, y = (
            _row_dots(a, b) for a, b in ((u, u), (u, v), (v, v), (u, directions), (v, directions))
        )
        dx, dy = yy * x - xy * y, xx * y - xy * x
        scale = length / np.sqrt(xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy)
        return scale * dx, scale * dy


def _row_dots(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray(np.einsum("nc,nc->n", a, b))


def grid_points() -> tuple[Doubles, Doubles]:
    """x and y of the grid (nodes,) on the front plane, the left brow's side [mm]."""
    x, y = np.meshgrid(*_grid_axes(), indexing="ij")
    return x.ravel(), y.ravel()


def _grid_axes() -> tuple[Doubles, Doubles]:
    x, y = (np.arange(low, high + 0.5, _CELL_MM) for low, high in zip(_GRID_LOW, _GRID_HIGH, strict=True))
    return x, y


class BrowSurface:
    """A person's skin around the brows.

    node_mm, normal : (2 nodes, 3) where the places of the left and of the right grid are on the person, see
        `SkinSurface.project`; x counts from the nose outwards on both sides
    """

    def __init__(self, node_mm: Doubles, normal: Doubles) -> None:
        shape = tuple(map(len, _grid_axes()))
        directions = np.gradient(node_mm.reshape(2, *shape, 3), _CELL_MM, axis=(1, 2))
        self._last = np.array(shape) - 1
        plane = (node_mm * normal).sum(axis=1, keepdims=True)
        self._node = np.concatenate(
            [node_mm, normal, *(way.reshape(-1, 3) for way in directions), plane], axis=1
        )

    def sample(self, side: Doubles, x: Doubles, y: Doubles) -> SurfacePoints:
        """The skin behind places of the front plane (n,) [mm]; beyond the grid, as at its edge.

        side : 1 for the left one
        """
        position = (np.stack([x, y]) - np.array(_GRID_LOW)[:, None]) / _CELL_MM
        position = np.clip(position, 0.0, self._last[:, None] - 1e-9)
        cell = position.astype(np.int64)
        s, t = position - cell
        first = cell[0] * (self._last[1] + 1) + cell[1] + (side < 0) * (len(self._node) // 2)
        near = first[:, None] + [0, 1, self._last[1] + 1, self._last[1] + 2]
        weights = np.stack([(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t], axis=-1)
        values = np.einsum("nk,nkc->nc", weights, self._node.take(near, axis=0))
        place, normal, along_x, along_y, plane = np.split(values, [3, 6, 9, 12], axis=1)
        # curved skin lies as far from its chords as from its tangent planes
        lift = 0.5 * (plane - _row_dots(place, normal)[:, None])
        return SurfacePoints(place + lift * normal, normal, along_x, along_y)


def sample_positions(rng: np.random.Generator) -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """Along the brow and across it (n,), and x, y in the front plane (n,) [mm], in no order."""
    u = rng.random(4 * _MAX_HAIRS)
    u = u[rng.random(len(u)) < np.interp(u, _ALONG, _DENSITY * _HALF_HEIGHT / _HALF_HEIGHT.max())][
        :_MAX_HAIRS
    ]
    v = np.clip(rng.normal(0.0, 0.52, len(u)), -1.5, 1.5)
    ahead, behind = np.minimum(u + 0.02, 1.0), np.maximum(u - 0.02, 0.0)
    along = np.stack([np.interp(ahead, _ALONG, c) - np.interp(behind, _ALONG, c) for c in (_X, _Y)])
    along /= np.linalg.norm(along, axis=0)
    off = v * np.interp(u, _ALONG, _HALF_HEIGHT)
    x = np.interp(u, _ALONG, _X) - along[1] * off + rng.normal(0, 0.4, len(u))
    y = np.interp(u, _ALONG, _Y) + along[0] * off + rng.normal(0, 0.3, len(u))
    return u, v, x, y


def outline(across: float) -> Doubles:
    """(k, 2) x, y in the front plane along the left brow, from its inner end [mm].

    across : from its lower edge, -1, over its middle to its upper one, 1
    """
    along = np.gradient(np.stack([_X, _Y], axis=-1), axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    x, y = _X - across * _HALF_HEIGHT * along[:, 1], _Y + across * _HALF_HEIGHT * along[:, 0]
    return np.stack([x, y], axis=-1)


def hair_count(look: HairLook) -> int:
    """Hairs of one brow."""
    return int(_MAX_HAIRS * (0.55 + 0.45 * look.bushy))


def sample_shapes(u: Doubles, v: Doubles, rng: np.random.Generator, look: HairLook) -> Doubles:
    """(5, n) where in the front plane hairs point to, by how much they bend [rad], their length, how far they
    rise and the radius of their roots [mm].

    u, v : (n,) along and across the brow, from `sample_positions`
    """
    n = len(u)
    # hairs from above and from below lean together
    turn = np.interp(u, _ALONG, _ANGLES) - 0.6 * v * np.minimum(2.5 * u, 1.0) + rng.normal(0, 0.13, n)
    bend = -0.5 * np.clip(turn - np.interp(np.minimum(u + 0.2, 1), _ALONG, _ANGLES), 0, 1) - 0.25 * v * u
    bend += rng.normal(0, 0.14, n)
    length = np.interp(u, _ALONG, _LENGTH) * rng.uniform(0.6, 1.1, n) * (0.85 + 0.3 * look.bushy)
    rise = np.clip(rng.gamma(4.0, 0.15, n), 0.15, 1.3)
    radius = rng.uniform(0.03, 0.05, n) * (0.9 + 0.2 * look.bushy)
    return np.stack([turn, bend, length, rise, radius])


def grow(
    skin: BrowSurface, root_mm: Doubles, side: Doubles, front_mm: Doubles, shape: Doubles
) -> tuple[Doubles, Doubles]:
    """Knots (n, k, 3) and radii (n, k) of the hairs of brows [mm].

    root_mm : (n, 3) on the skin
    side : (n,) 1 for the left one
    front_mm : (2, n) x, y in the front plane, from `sample_positions`
    shape : (5, n) from `sample_shapes`
    """
    (x, y), (turn, bend, length, rise, radius) = front_mm, shape
    t = np.linspace(0.0, 1.0, KNOTS)
    height = rise[:, None] * (1 - (1 - t) ** 2.2) * (1 - 0.35 * t) - 0.25 * (1 - t) ** 8
    skin_points = skin.sample(side, x, y)
    root_offset = tangent_component(root_mm - skin_points.place, skin_points.normal)
    base_points, normals = [skin_points.place + root_offset], [skin_points.normal]
    for k in range(2, KNOTS, 2):  # straight between: 0.16 mm off at most
        angle = turn + bend * (t[k - 1] + t[k]) / 2
        out = np.stack([side * np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=-1)
        across, up = skin_points.step(out, 2 * length / (KNOTS - 1))
        x, y = x + across, y + up
        skin_points = skin.sample(side, x, y)
        base_points += [
            (base_points[-1] + skin_points.place + root_offset) / 2,
            skin_points.place + root_offset,
        ]
        normals += [(normals[-1] + skin_points.normal) / 2, skin_points.normal]
    knots = np.stack(base_points, axis=1) + height[..., None] * np.stack(normals, axis=1)
    taper = np.maximum(1.0 - t**2.5, 0.08)
    return knots, radius[:, None] * taper * np.minimum(1.0, 0.75 + t)
