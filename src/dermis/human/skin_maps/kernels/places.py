"""Where on the face points are: in its zones, on the lips, at the lids, in the hair."""

from __future__ import annotations

import math

from dermis.human.bust.fields import Doubles
from dermis.human.skin_maps.face import DEGREES, Face
from dermis.human.skin_maps.kernels.noise import blobs, smooth_step
from dermis.human.skin_maps.look import Patch
from dermis.machine_code import compiled

# Columns of what `locate` gives.
X, Y, Z = 0, 1, 2  # place on the symmetric head [mm]
# Sums over the zones, in the order of their table.
BLOOD, MELANIN, STRENGTH, ROUGHNESS, PORES, FURROWS, FRECKLES, LEVEL, AROUND, HAIR = range(3, 13)
LIP = 13  # how much the place is red lip [-]
MOUTH = 14  # height over the line of the mouth [mm]
LID = 15  # distance from the line of the closed lids [mm]
SCALP = 16  # how densely hair grows there [-]
COLUMNS = 17

_FAR = 99.0
_INNER_END, _OUTER_END = 18.5, 43.5  # of the line of the lids, in x
_ROUNDS = 4  # of undoing the warp: each comes at least four times closer
_WANDER_MM, _WANDER_BLOB_MM = 5.0, 17.0  # of the zones' borders


@compiled
def locate(patch: Patch, face: Face, out: Doubles) -> None:
    """Fill `out` (n, COLUMNS)."""
    for row in range(len(patch.points)):
        x, y, z = patch.points[row]
        place = out[row]
        place[:] = 0.0
        _unwarp(x, y, z, face, place)
        _sum_zones(x, y, z, face, patch.seed, place)
        _find_lip(x, y, z, face, patch.seed, place)
        _find_lid(face, place)
        _find_scalp(x, y, z, face, patch.seed, place)


@compiled
def _unwarp(x: float, y: float, z: float, face: Face, place: Doubles) -> None:
    """The place on the symmetric head, as `warp.Warp.undo` finds it."""
    px, py, pz = x, y, z
    for _ in range(_ROUNDS):
        sx, sy, sz = 0.0, 0.0, 0.0
        for k in range(len(face.centres)):
            weight = _weight(px, py, pz, face.centres[k], face.radii[k])
            sx += weight * face.shifts[k, 0]
            sy += weight * face.shifts[k, 1]
            sz += weight * face.shifts[k, 2]
        px, py, pz = (x - sx) / face.width, y - sy, z - sz
    place[X], place[Y], place[Z] = px, py, pz


@compiled
def _weight(x: float, y: float, z: float, centre: Doubles, radii: Doubles) -> float:
    """A soft spot, 1 at its centre and exp(-1) at its radii; 0 where it would not show."""
    dx, dy, dz = (x - centre[0]) / radii[0], (y - centre[1]) / radii[1], (z - centre[2]) / radii[2]
    away = dx * dx + dy * dy + dz * dz
    return math.exp(-away) if away < 14.0 else 0.0


@compiled
def _sum_zones(x: float, y: float, z: float, face: Face, seed: int, place: Doubles) -> None:
    px = abs(place[X]) + _WANDER_MM * blobs(x, y, z, _WANDER_BLOB_MM, seed + 11)
    py = place[Y] + _WANDER_MM * blobs(x, y, z, _WANDER_BLOB_MM, seed + 12)
    for k in range(len(face.zone_centres)):
        weight = _weight(px, py, place[Z], face.zone_centres[k], face.zone_radii[k])
        if weight > 0.0:
            for c in range(face.zone_amounts.shape[1]):
                place[BLOOD + c] += weight * face.zone_amounts[k, c]


@compiled
def _find_lip(x: float, y: float, z: float, face: Face, seed: int, place: Doubles) -> None:
    px, py = abs(place[X]), place[Y]
    place[MOUTH] = _FAR
    if px > 30.0 or abs(py + 66.0) > 24.0 or place[Z] < 62.0:
        return
    column = px / face.step_mm
    upper, line, lower = _read(face.lips[0], column), _read(face.lips[1], column), _read(face.lips[2], column)
    inside = min(min(upper - py, py - lower), 25.5 - px)
    place[LIP] = smooth_step(-1.1, 1.5, inside + 0.45 * blobs(x, y, z, 1.6, seed + 21))
    place[MOUTH] = py - line


@compiled
def _find_lid(face: Face, place: Doubles) -> None:
    px, py = abs(place[X]), place[Y]
    place[LID] = _FAR
    if px < 50.0 and abs(py) < 20.0 and place[Z] > 50.0:
        beyond = max(max(_INNER_END - px, px - _OUTER_END), 0.0)
        place[LID] = math.hypot(py - _read(face.lids, px / face.step_mm), beyond)


@compiled
def _find_scalp(x: float, y: float, z: float, face: Face, seed: int, place: Doubles) -> None:
    if place[Y] < -85.0:
        return
    angle = math.degrees(math.atan2(abs(place[X]), place[Z]))
    ragged = 5.0 * blobs(x, y, z, 14.0, seed + 23) + 4.0 * blobs(x, y, z, 3.0, seed + 24)
    above = place[Y] - _read(face.hairline, angle / DEGREES) + ragged
    place[SCALP] = smooth_step(-9.0, 16.0, above) * min(max(1.0 + place[HAIR], 0.0), 1.0)


@compiled
def _read(values: Doubles, place: float) -> float:
    """A list's value between its entries."""
    before = min(int(place), len(values) - 2)
    return float(values[before] + (place - before) * (values[before + 1] - values[before]))
