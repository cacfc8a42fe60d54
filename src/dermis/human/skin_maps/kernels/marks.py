"""What lies on the skin in single pieces: pores, freckles, moles and hairs."""

from __future__ import annotations

import math

from dermis.human.skin_maps.hairs import WIDEST_TEXEL_MM, Hairs
from dermis.human.skin_maps.kernels.dots import dots
from dermis.human.skin_maps.kernels.noise import blobs, smooth_step, visible
from dermis.human.skin_maps.kernels.places import FRECKLES, LIP, PORES, SCALP, X, Y, Z
from dermis.human.skin_maps.patch import Doubles, Patch
from dermis.machine_code import compiled

# Columns of what `mark` gives: how much of each is at a place [-].
PORE, FRECKLE, MOLE, HAIR, STUBBLE = 0, 1, 2, 3, 4
FILM = 5  # how unevenly the oil lies, about -1 to 1
COLUMNS = 6

# Artist's values.
_PORE_SPACING_MM, _MOLE_SPACING_MM, _STUBBLE_SPACING_MM = 1.15, 28.0, 0.85
_FRECKLE_SPACING_MM, _SMALL_FRECKLE_SPACING_MM = 4.2, 2.2


@compiled
def mark(
    patch: Patch, places: Doubles, hairs: Hairs, freckles: float, moles: float, stubble: float, out: Doubles
) -> None:
    """Fill `out` (n, COLUMNS)."""
    seed = patch.seed
    for row in range(len(patch.points)):
        x, y, z = patch.points[row]
        normal, texel, place, found = patch.normals[row], patch.texel_mm[row], places[row], out[row]
        found[:] = 0.0
        bare = 1.0 - place[LIP]
        found[PORE] = _pore(x, y, z, normal, place, texel, seed)
        if freckles > 0.0:
            found[FRECKLE] = bare * _freckle(x, y, z, normal, place, freckles, texel, seed)
        if moles > 0.0:
            found[MOLE] = bare * _mole(x, y, z, normal, moles, texel, seed)
        if place[Z] > 40.0:
            found[HAIR] = _hair(place[X], place[Y], hairs, texel)
        if place[SCALP] > 0.0 and stubble > 0.0:
            stub = dots(x, y, z, normal, _STUBBLE_SPACING_MM, 0.16, 0.26, 1.0, texel, seed + 56)
            found[STUBBLE] = stubble * place[SCALP] * (0.6 + 0.4 * stub)
        found[FILM] = blobs(x, y, z, 8.0, seed + 58) + 0.7 * visible(1.9, texel) * blobs(
            x, y, z, 1.9, seed + 59
        )


@compiled
def _pore(x: float, y: float, z: float, normal: Doubles, place: Doubles, texel: float, seed: int) -> float:
    many = min(max(0.45 + place[PORES], 0.0), 1.0) * (1.0 - place[LIP])
    wide = min(max(place[PORES], 0.0), 1.0)
    smallest, largest = 0.17 + 0.07 * wide, 0.23 + 0.2 * wide
    return dots(x, y, z, normal, _PORE_SPACING_MM, smallest, largest, many, texel, seed + 31)


@compiled
def _freckle(
    x: float,
    y: float,
    z: float,
    normal: Doubles,
    place: Doubles,
    freckles: float,
    texel: float,
    seed: int,
) -> float:
    """Ragged spots of two sizes, most where the sun shines."""
    kept = freckles * (0.12 + 0.88 * min(max(place[FRECKLES], 0.0), 1.0))
    kept *= 0.75 + 0.75 * blobs(x, y, z, 14.0, seed + 41)
    dx, dy = 0.55 * blobs(x, y, z, 1.3, seed + 42), 0.55 * blobs(x, y, z, 1.3, seed + 43)
    x, y = x + dx, y + dy
    large = dots(x, y, z, normal, _FRECKLE_SPACING_MM, 0.2, 0.5, 0.7 * kept, texel, seed + 44)
    small = dots(x, y, z, normal, _SMALL_FRECKLE_SPACING_MM, 0.25, 0.5, kept, texel, seed + 46)
    return smooth_step(0.02, 0.3, large + 0.7 * small)


@compiled
def _mole(x: float, y: float, z: float, normal: Doubles, moles: float, texel: float, seed: int) -> float:
    ragged = 0.4 * visible(0.9, texel) * blobs(x, y, z, 0.9, seed + 51)
    x, y = x + ragged, y - ragged
    return smooth_step(
        0.1, 0.6, dots(x, y, z, normal, _MOLE_SPACING_MM, 0.045, 0.11, 0.3 * moles, texel, seed + 52)
    )


@compiled
def _hair(x: float, y: float, hairs: Hairs, texel: float) -> float:
    """Share of the skin that hairs hide."""
    column = math.floor((x - hairs.left_mm) / hairs.cell_mm)
    line = math.floor((y - hairs.bottom_mm) / hairs.cell_mm)
    if not (0 <= column < hairs.columns and 0 <= line < hairs.lines):
        return 0.0
    cell = line * hairs.columns + column
    blur = (0.9 * min(texel, WIDEST_TEXEL_MM)) ** 2
    bare = 1.0
    for k in range(hairs.first[cell], hairs.first[cell + 1]):
        piece = hairs.pieces[hairs.members[k]]
        ax, ay = piece[2] - piece[0], piece[3] - piece[1]
        t = min(max(((x - piece[0]) * ax + (y - piece[1]) * ay) / (ax * ax + ay * ay), 0.0), 1.0)
        dx, dy = x - piece[0] - t * ax, y - piece[1] - t * ay
        width = piece[4] + t * (piece[5] - piece[4])
        reach = width * width + blur
        beside = max(1.0 - (dx * dx + dy * dy) / reach, 0.0)
        bare *= 1.0 - piece[6] * beside * beside * width / math.sqrt(reach)
    return 1.0 - bare
