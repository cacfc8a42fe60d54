"""Eyelids on eyes of true size: published lids fitted to smaller balls, and the targets that close them."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.human.movement import expressions, gaze
from dermis.human.published import FACE_UNITS, Points, data, moves
from dermis.human.skin.surface import average, lid_rings
from dermis.mesh.eyeball import SCLERA_MM, Contact, clearance_mm
from dermis.mesh.eyeball import globe as true_globe

Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

BALL_MM = 15.4
"""Mean radius of the published ball, which the published lids lie on, where the eye is of usual size [mm]."""
FORWARD_MM = 2.2
"""How far the true ball's centre lies before the published one's, so that corneas stand as far out [mm]."""
SPLINE = 1.0045
"""How much larger an eyeball's control points are than its smooth surface."""
_REACH_MM = 15.0  # of the skin around the lids that goes with them
_SHARP = 1.0  # mm over which neighbours share what they follow
_DEEPEST_MM = -1.5  # below the surface of the ball; what lies deeper is never seen
_STRAIGHT, _STEEPEST = 0.75, 0.95  # shares of the radius across the axis, see `_narrowed`
_CLEAR_MM = -0.3, 0.25, 0.75, 1.0  # of wall, edge, crest and skin
_TOUCHING_MM = 0.2  # of the edge: the smooth surface lies a little within its control points
_LIES_ON = np.array([0, 0.2, 0.6, *21 * [1.0], 0.6, 0.2, 0, 0])
"""How far each row of lid_rings.csv lies on the ball: not around the caruncle."""
_CARUNCLE_MM = np.array([[0.3, 0.7, 0.0, 0.0], [0.0, 0.2, 0.0, 0.0], *23 * [4 * [0.0]],
                         [0.0, 0.3, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0], [0.6, 1.1, 0.0, 0.0]])  # fmt: skip
"""How far the floor of the inner corner rises, row by row, while the eye is open."""
_UPPER, _LOWER = slice(1, 12), slice(13, 28)  # rows of lid_rings.csv
_OVER_MM = 1.6 * np.array(
    [0.4, 0.8, *7 * [1.0], 0.8, 0.4]
)  # by which closed upper lids reach beyond lower ones
_ROWS = 6  # of quads, of skin that may slide
_MOVED_MM = 2.0  # by a blink: skin that slides over the eye
_RINGS, _EDGE, _CREST = 4, 1, 2  # columns of lid_rings.csv
AHEAD = np.array([0.0, 0.0, 1.0])
"""Where eyes look at rest."""
_TARGETS = "eyeBlink", "eyeLook", "eyeSquint", "eyeWide"
Doubles = NDArray[np.float64]


class Socket(NamedTuple):
    """A person's eye as published: the middle of the ball (3,), and its size, 1 for a usual one."""

    middle: Points
    size: float


class Side(NamedTuple):
    """What follows the lids of one eye.

    rings : (r,) points of lids, see lid_rings.csv
    point : (n,) these, and the skin around them
    share : (n, r) of the ways of `rings` that each goes
    contact, clear_mm : (c,) points that slide over the eye, and least distances from it
    """

    rings: Index
    point: Index
    share: Points
    contact: Index
    clear_mm: Points

    def numbered(self, point: Index) -> Side:
        """The same by numbers of sorted points, among which all these are."""
        rings, own, contact = (np.searchsorted(point, one) for one in (self.rings, self.point, self.contact))
        return self._replace(rings=rings, point=own, contact=contact)


def socket(balls: Points) -> Socket:
    """The eye whose published ball has points (b, 3)."""
    middle = (balls.min(axis=0) + balls.max(axis=0)) / 2
    return Socket(middle, float(np.linalg.norm(balls - middle, axis=1).mean()) / BALL_MM)


def conformed(
    places: Points, sockets: tuple[Socket, Socket], closed: bool = False, axis: Points = AHEAD
) -> Points:
    """(n, 3) a person's published points with the lids on eyes of true size [mm].

    sockets : of the left and of the right eye
    closed : whether upper lids end at the lower ones, however far they are published to go
    axis : (3,) along which the eyes look, unit
    """
    found = places.copy()
    for side, eye in zip(sides(), sockets, strict=True):
        draw_onto(found, side, eye, closed, axis)
    return found


def draw_onto(places: Points, side: Side, eye: Socket, closed: bool | Flags, axis: Points) -> None:
    """Draw the lids of one eye onto it, see `conformed`; of one person, or in several movements (m, n, 3).

    closed, axis : (m,) and (m, 1, 3) of those
    """
    places[..., side.point, :] += side.share @ _ways(places[..., side.rings, :], eye, closed)
    centre = eye.middle + eye.size * FORWARD_MM * AHEAD
    size = SPLINE * eye.size
    off = (places[..., side.contact, :] - centre) / size
    far, surface = clearance_mm(off, axis)
    out = np.maximum(1.0, (surface + side.clear_mm) / far)
    places[..., side.contact, :] = centre + size * off * out[..., None]


def contact(first: int, globe: int, apex: int, back: int) -> Contact:
    """What slides over the eyes.

    first, globe : number of the left eyeball's first point, and how many points an eyeball has
    apex, back : of an eyeball's points
    """
    both = sides()
    return Contact(
        np.concatenate([side.contact for side in both]).astype(np.int32),
        np.repeat(np.arange(2, dtype=np.int32), [len(side.contact) for side in both]),
        np.concatenate([side.clear_mm for side in both]).astype(np.float32),
        np.array([first + apex, first + globe + apex], np.int32),
        np.array([first + back, first + globe + back], np.int32),
        lid_rings()[..., _EDGE].astype(np.int32),
    )


def _ways(rings: Points, eye: Socket, closed: bool | Flags) -> Points:
    """(..., r, 3) from where points of the lids are published to where they lie on the true ball [mm].

    Seen from the front they stay where they are, but near the ball's outline. Edges touch the ball; lids stay
    as thick.
    """
    published = (rings - eye.middle) / eye.size
    off, shut = published.copy(), np.asarray(closed)
    lids = off.reshape(-1, len(_LIES_ON), _RINGS, 3)
    for one in np.flatnonzero(shut):
        _close(lids[one])
    above = (np.linalg.norm(published, axis=-1) - BALL_MM).reshape(*shut.shape, -1, _RINGS)
    above += (_LIES_ON * (_TOUCHING_MM - above[..., _EDGE]))[..., None]
    radius = SCLERA_MM + np.maximum(above.reshape(*shut.shape, -1), _DEEPEST_MM)
    across = np.linalg.norm(off[..., :2], axis=-1)
    wanted = radius * _narrowed(across / radius)
    floor = np.where(shut[..., None], 0.0, _CARUNCLE_MM.ravel())
    depth = FORWARD_MM + np.sqrt(radius**2 - wanted**2) + floor
    flat = off[..., :2] * (wanted / np.maximum(across, 1e-9))[..., None]
    return np.asarray(eye.size * (np.concatenate([flat, depth[..., None]], axis=-1) - published))


def _close(rings: Points) -> None:
    """Move the rows of an upper lid (rows, 4, 3) so that its crest ends a little below the lower one's."""
    crest = rings[:, _CREST]
    lower = crest[_LOWER][np.argsort(crest[_LOWER, 0])]
    ends = np.interp(crest[_UPPER, 0], lower[:, 0], lower[:, 1]) - _OVER_MM
    rings[_UPPER, :, 1] += (ends - crest[_UPPER, 1])[:, None]


def _narrowed(across: Points) -> Points:
    """Distances from the axis in radii: as they are near it, short of the outline farther out."""
    room = _STEEPEST - _STRAIGHT
    return np.where(across < _STRAIGHT, across, _STRAIGHT + room * np.tanh((across - _STRAIGHT) / room))


@cache
def sides() -> tuple[Side, Side]:
    """Of the left and of the right eye; told on the average person, so the same for all people."""
    places, (left, right) = average()[0].astype(np.float64), lid_rings()
    body = np.unique(data()["quads"][data()["group"] == 0]).astype(np.int64)
    return _side(left, places, body, "Left"), _side(right, places, body, "Right")


def _side(rings: Index, places: Points, body: Index, name: str) -> Side:
    every = rings.ravel()
    near = body[np.abs(places[body] - places[every].mean(axis=0)).max(axis=1) < 4 * _REACH_MM]
    far = np.linalg.norm(places[near][:, None] - places[every], axis=-1)
    point, far = near[far.min(axis=1) < _REACH_MM], far[far.min(axis=1) < _REACH_MM]
    share = 1.0 / (far**2 + _SHARP**2) ** 2
    share /= share.sum(axis=1, keepdims=True)
    t = far.min(axis=1) / _REACH_MM
    share *= (1.0 - t * t * (3.0 - 2.0 * t))[:, None]
    own = np.isin(point, every)
    share[own] = point[own][:, None] == every
    sliding = _sliding(rings, point, name)
    clear = np.concatenate([np.repeat(_CLEAR_MM, len(rings)), np.full(len(sliding), _CLEAR_MM[-1])])
    return Side(every, point, share, np.concatenate([rings.T.ravel(), sliding]), clear)


def _sliding(rings: Index, point: Index, name: str) -> Index:
    """(c,) points of the lids' skin beyond the rings that a blink moves."""
    index = moves().names.index(f"{FACE_UNITS}eyeBlink{name}")
    part = slice(*moves().first[index : index + 2])
    far = np.linalg.norm(moves().delta_mm[part], axis=1) > _MOVED_MM
    moved = np.intersect1d(moves().point[part][far], point)
    quads, skin = data()["quads"].astype(np.int64), rings[:, -1]
    quads = quads[np.isin(quads, moved).any(axis=1) & ~np.isin(quads, rings[:, :-1]).any(axis=1)]
    for _ in range(_ROWS):  # from the lids outwards, never over their edges
        skin = np.union1d(skin, quads[np.isin(quads, skin).any(axis=1)])
    return np.setdiff1d(np.intersect1d(skin, moved), rings)


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


def globe() -> tuple[Doubles, Index]:
    """(n, 3) control points of an eyeball around its centre, looking along +Z [mm], and (q, 4) quads."""
    return true_globe(swell=SPLINE)


def placed(eye: Socket) -> tuple[Doubles, Doubles]:
    """(n, 3) points of a person's eyeball, and its centre (3,) [mm]."""
    centre = eye.middle + eye.size * FORWARD_MM * np.array([0.0, 0.0, 1.0])
    return centre + eye.size * globe()[0], centre
