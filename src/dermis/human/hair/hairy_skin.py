"""Where hair grows: how much of it at places of the average person, and roots drawn from that."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats
from dermis.base.tables import read_rows
from dermis.human.hair.rooting import Index, Rooting
from dermis.human.skin.face import AMOUNTS, DEGREES, hairline, zones
from dermis.human.skin.surface import FIELDS, average
from dermis.mesh.geometry import crosses, dots
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, between, corners

HEAD_AXIS_Z = -72.0
"""Of the axis around which the hairline is told [mm]."""
_STEPS = np.array([0.7548776662, 0.5698402909])  # of places that fill a square evenly
_LOWEST = -80.0  # of the hair of the head [mm]
_SOFT_MM = (-3.0, 11.0)  # beside the hairline, between which hair gets as dense as it is
_LIPS_MM = (1.5, 4.5)  # beside the lips, between which the beard does
_BEARDED = (0.25, 0.75)  # amount of the zones between which it does
_RAGGED = np.array([[0.37, 0.0, 0.23], [0.81, -0.5, 0.0]])  # waves of the hairline [rad/mm]

_BELOW_MM = 25.0  # the hairline, to where quads may have a little hair
_BESIDE_MM, _BESIDE_BROWS_MM = 25.0, 8.0  # quads with hairs and those around brows, where skin still counts
_BESIDE = 0.02  # amount of the zones from which on quads may have a beard


class Where(NamedTuple):
    """Where hair grows.

    amount : share of the density (n,) at places (n, 4): on the average person, and how far inside the lips
        these are [mm]
    near : (p,) control points of quads on which any may grow
    """

    amount: Callable[[Doubles], Doubles]
    near: NDArray[np.bool_]


def rooted(plain: Mesh, where: Where, per_cm2: float, rng: np.random.Generator) -> Roots:
    """Roots on the skin, evenly but for chance, quad after quad; none on ears, lips and in the mouth.

    plain : the person's mesh of control points
    per_cm2 : density where the share is 1
    """
    quad = _hairy_quads(plain)
    around = corners(plain, quad)
    many = np.floor(per_cm2 * areas_cm2(plain, quad) + rng.random(len(quad))).astype(np.int64)
    began, chance = rng.random((len(quad), 2)), rng.random(int(many.sum()))
    near = where.near[around].any(axis=1)
    which = np.repeat(np.flatnonzero(near), many[near])
    ends = np.cumsum(many)[near]
    number = np.arange(len(which)) + np.repeat(ends - np.cumsum(many[near]), many[near])
    step = number - (np.cumsum(many) - many)[which]
    place = began.take(which, axis=0) + step[:, None] * _STEPS
    place -= np.floor(place)
    values = told().T.take(around.T.take(which, axis=1), axis=1)
    kept = np.flatnonzero(chance.take(number) < where.amount(between(place, values).T))
    return Roots(quad.take(which.take(kept)).astype(np.int32), place.take(kept, axis=0).astype(np.float32))


def above_hairline(places: Doubles, recession: float = 0.0) -> Doubles:
    """How far (n,) places (n, 3 or more) are above the edge of the hair, on the average person [mm].

    recession : see `SkinLook`
    """
    angle = np.degrees(np.arctan2(np.abs(places[:, 0]), places[:, 2] - HEAD_AXIS_Z))
    edge = hairline(recession)
    return np.asarray(places[:, 1] - np.interp(angle, DEGREES * np.arange(len(edge)), edge))


def scalp(recession: float) -> Where:
    """Hair of the head."""
    column = _column("hair")
    gone = zones(recession)[:, column] != zones()[:, column]

    def amount(places: Doubles) -> Doubles:
        above = above_hairline(places, recession)
        soft = np.flatnonzero((above > _SOFT_MM[0] - len(_RAGGED)) & (above < _SOFT_MM[1] + len(_RAGGED)))
        above[soft] += sum(np.sin(places[soft, :3] @ wave) for wave in _RAGGED)
        share = smoothstep(*_SOFT_MM, above) * (places[:, 1] > _LOWEST)
        thinned = _amount("hair", zones(recession)[gone], places)
        return np.asarray(share * np.clip(1.0 + thinned, 0.0, 1.0))

    return Where(amount, _near_scalp())


def beard() -> Where:
    """Hair of the beard."""
    return Where(_bearded, _near_beard())


@cache
def _near_scalp() -> NDArray[np.bool_]:
    return above_hairline(told()) > -_BELOW_MM


@cache
def _near_beard() -> NDArray[np.bool_]:
    return _amount("beard", zones(), told()) > _BESIDE


def _bearded(places: Doubles) -> Doubles:
    bare = smoothstep(*_LIPS_MM, -places[:, 3])
    return np.asarray(smoothstep(*_BEARDED, _amount("beard", zones(), places)) * bare)


def smoothstep(low: float, high: float, x: Doubles) -> Doubles:
    """From 0 at `low` to 1 at `high`."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def areas_cm2(plain: Mesh, quad: Index) -> Doubles:
    """(n,) area of quads [cm2]."""
    around = plain.points_mm.T.take(corners(plain, quad).T, axis=1)
    a, b, c, d = around.swapaxes(0, 1)
    across = crosses(c - a, d - b)
    return np.asarray(np.sqrt(dots(across, across)) / 200.0)


def _amount(name: str, rows: Floats, places: Doubles) -> Doubles:
    """Sum (n,) of an amount of zones, see zones.csv."""
    column, found = _column(name), np.zeros(len(places))
    left = np.abs(places[:, 0]), places[:, 1], places[:, 2]
    for zone in rows[rows[:, column] != 0.0].astype(np.float64):
        away = sum(((left[c] - zone[c]) * zone[4 + c]) ** 2 for c in range(3))
        found += zone[column] * np.exp(-away)
    return found


@cache
def skin_beside(rooting: Rooting, bearded: bool) -> Index:
    """Vertices of the drawn mesh among which are all that hairs of anyone lie beside."""
    from scipy.spatial import cKDTree

    mesh = rooting.mesh
    around = corners(mesh, _hairy_quads(mesh))
    near = np.zeros(len(rooting.drawn.positions), bool)
    hairy = _near_scalp() | _near_beard() if bearded else _near_scalp()
    places = around[hairy[around].any(axis=1)], corners(mesh, rooting.around_brows.quad)
    for points, reach in zip(places, (_BESIDE_MM, _BESIDE_BROWS_MM), strict=True):
        tree = cKDTree(rooting.points_mm[np.unique(points)])
        near |= tree.query(rooting.drawn.positions, distance_upper_bound=reach)[0] < reach
    return np.flatnonzero(near)


def _column(name: str) -> int:
    return 8 + AMOUNTS.index(name)


@cache
def told() -> Doubles:
    """(p, 4) of control points their place on the average person, and how far inside the lips [mm]."""
    places, told = average()
    return np.asfortranarray(np.column_stack([places, told[:, FIELDS.index("lips")]]), np.float64)


@cache
def _bare() -> Index:
    """Quads on which no hair grows: ears, lips, the mouth."""
    rows = read_rows("dermis.human.regions", "parts")
    return np.concatenate([np.arange(int(row["first"]), int(row["last"]) + 1) for row in rows])


def _hairy_quads(plain: Mesh) -> Index:
    skin = np.array([one.kind == "skin" for one in plain.materials])[plain.material[plain.quads[:, 0]]]
    skin[_bare()] = False
    return np.flatnonzero(skin)
