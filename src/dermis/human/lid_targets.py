"""What expressions move lids by: corrected for eyes of true size, as the lids themselves are."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.human.lids import AHEAD, Flags, Index, Side, Socket, draw_onto, sides
from dermis.human.movement import expressions, gaze
from dermis.human.published import Points

_TARGETS = "eyeBlink", "eyeLook", "eyeSquint", "eyeWide"


def conformed_targets(places: Points, sockets: tuple[Socket, Socket]) -> NDArray[np.float32]:
    """(m, 3) what `expressions` move points by, corrected where they move a person's lids [mm].

    places : (n, 3) the person's published points
    """
    moved, found = _lid_moves(), expressions().delta_mm.copy()
    resting = places[moved.point]
    drawn = np.tile(resting, (len(moved.closed), 1, 1))
    drawn[moved.target, moved.number] += found[moved.row]
    for side, eye, which in zip(moved.sides, sockets, moved.which, strict=True):
        draw_onto(resting, side, eye, False, AHEAD)
        near = drawn[which]
        draw_onto(near, side, eye, moved.closed[which], moved.axis[which])
        drawn[which] = near
    found[moved.row] = drawn[moved.target, moved.number] - resting[moved.number]
    return found


class _LidMoves(NamedTuple):
    """Expressions that move lids.

    closed, axis : (t,) whether lids close, and (t, 1, 3) along which eyes look
    point : (n,) points around both eyes
    sides, which : of the left and of the right eye, by numbers of these points; and what moves its lids
    row, target, number : (m,) displacements of these points, whose they are, and of which point
    """

    closed: Flags
    axis: Points
    point: Index
    sides: tuple[Side, ...]
    which: tuple[Index, ...]
    row: Index
    target: Index
    number: Index


@cache
def _lid_moves() -> _LidMoves:
    both, moved = sides(), expressions()
    point = np.unique(np.concatenate([side.point for side in both]))
    names = [name for name in moved.names if name.startswith(_TARGETS)]
    parts = [np.arange(*moved.first[index : index + 2]) for index in map(moved.names.index, names)]
    rows = [part[np.isin(moved.point[part], point)] for part in parts]
    near = [[np.isin(moved.point[row], side.point).any() for row in rows] for side in both]
    row = np.concatenate(rows)
    return _LidMoves(
        np.array(["Blink" in name for name in names]),
        np.array([axes().get(name, AHEAD) for name in names])[:, None],
        point,
        tuple(side.numbered(point) for side in both),
        tuple(np.flatnonzero(one) for one in near),
        row,
        np.repeat(np.arange(len(rows)), [len(one) for one in rows]),
        np.searchsorted(point, moved.point[row]),
    )


@cache
def axes() -> dict[str, Points]:
    """Along which an eye looks by each target of gaze."""
    turns = {turn.target: np.radians(turn.degrees) for turn in gaze()}
    found = {
        name: np.array([np.sin(y), -np.sin(x), np.cos(x) * np.cos(y)]) for name, (x, y, _) in turns.items()
    }
    return {name: axis / np.linalg.norm(axis) for name, axis in found.items()}
