"""The skin around brows, as a grid over the front plane of the mean person, for hairs to walk on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles

_CELL_MM = 2.5
_LOW, _HIGH = (1.0, -2.0), (64.0, 40.0)  # around the left brow and the tips of its hairs [mm]


class Walked(NamedTuple):
    """Where hairs are on the skin.

    place, normal : (n, 3) [mm]
    along_x, along_y : (n, 3) by how much the place moves with those on the front plane [-]
    """

    place: Doubles
    normal: Doubles
    along_x: Doubles
    along_y: Doubles

    def step(self, ways: Doubles, length: Doubles) -> tuple[Doubles, Doubles]:
        """Along x and y of the front plane, how far what lies of ways (n, 3) along the skin leads [mm].

        length : (n,) of the step on the skin [mm]
        """
        u, v = self.along_x, self.along_y
        xx, xy, yy, x, y = (_dots(a, b) for a, b in ((u, u), (u, v), (v, v), (u, ways), (v, ways)))
        dx, dy = yy * x - xy * y, xx * y - xy * x
        scale = length / np.sqrt(xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy)
        return scale * dx, scale * dy


def _dots(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray(np.einsum("nc,nc->n", a, b))


def nodes() -> tuple[Doubles, Doubles]:
    """x and y of the grid (nodes,) on the front plane, the left brow's side [mm]."""
    x, y = np.meshgrid(*_axes(), indexing="ij")
    return x.ravel(), y.ravel()


def _axes() -> tuple[Doubles, Doubles]:
    x, y = (np.arange(low, high + 0.5, _CELL_MM) for low, high in zip(_LOW, _HIGH, strict=True))
    return x, y


class BrowSkin:
    """A person's skin around the brows.

    node_mm, normal : (2 nodes, 3) where the places of the left and of the right grid are on the person, see
        `Skin.foot`; x counts from the nose outwards on both sides
    """

    def __init__(self, node_mm: Doubles, normal: Doubles) -> None:
        shape = tuple(map(len, _axes()))
        ways = np.gradient(node_mm.reshape(2, *shape, 3), _CELL_MM, axis=(1, 2))
        self._last = np.array(shape) - 1
        plane = (node_mm * normal).sum(axis=1, keepdims=True)
        self._node = np.concatenate([node_mm, normal, *(way.reshape(-1, 3) for way in ways), plane], axis=1)

    def at(self, side: Doubles, x: Doubles, y: Doubles) -> Walked:
        """The skin behind places of the front plane (n,) [mm]; beyond the grid, as at its edge.

        side : 1 for the left one
        """
        at = (np.stack([x, y]) - np.array(_LOW)[:, None]) / _CELL_MM
        at = np.clip(at, 0.0, self._last[:, None] - 1e-9)
        cell = at.astype(np.int64)
        s, t = at - cell
        first = cell[0] * (self._last[1] + 1) + cell[1] + (side < 0) * (len(self._node) // 2)
        near = first[:, None] + [0, 1, self._last[1] + 1, self._last[1] + 2]
        share = np.stack([(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t], axis=-1)
        found = np.einsum("nk,nkc->nc", share, self._node.take(near, axis=0))
        place, normal, along_x, along_y, plane = np.split(found, [3, 6, 9, 12], axis=1)
        # curved skin lies as far from its chords as from its tangent planes
        lift = 0.5 * (plane - _dots(place, normal)[:, None])
        return Walked(place + lift * normal, normal, along_x, along_y)
