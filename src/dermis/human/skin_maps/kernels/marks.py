"""Single pieces on the skin (pores, freckles, moles, hairs), and the melanin and blood around them."""

from __future__ import annotations

import math

from dermis.human.bust.fields import Doubles
from dermis.human.skin_maps.hairs import WIDEST_TEXEL_MM, Hairs
from dermis.human.skin_maps.kernels.noise import (
    blobs,
    dots,
    fractal_noise,
    gradient_noise,
    smooth_step,
    visible,
)
from dermis.human.skin_maps.kernels.places import (
    BLOOD,
    FRECKLES,
    LID,
    LIP,
    MELANIN,
    MOUTH,
    PORES,
    SCALP,
    X,
    Y,
    Z,
)
from dermis.human.skin_maps.look import Patch
from dermis.machine_code import compiled

# Columns of what `mark` gives: how much of each is at a place [-].
PORE, FRECKLE, MOLE, HAIR, STUBBLE = 0, 1, 2, 3, 4
FILM = 5  # how unevenly the oil lies, about -1 to 1
COLUMNS = 6

# Artist's values.
_PORE_SPACING_MM, _MOLE_SPACING_MM, _STUBBLE_SPACING_MM = 1.15, 28.0, 0.85
_FRECKLE_SPACING_MM, _SMALL_FRECKLE_SPACING_MM = 4.2, 2.2
# Artist's values, in doublings of the pigment.
_BLOTCHES, _BLOTCH_BLOB_MM, _BLOTCH_GAIN = 0.55, 19.0, 0.86
_PATCHES, _PATCH_BLOB_MM, _PATCH_GAIN = 0.22, 24.0, 0.75
_FRECKLE, _MOLE, _PORE, _RED_PORE = 1.7, 3.4, 0.7, 0.4
_LIP_BLOOD, _LIP_MELANIN = 2.3, 0.5
_RED_LIDS, _RED_SLIT = 0.8, 1.2


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
    x: float, y: float, z: float, normal: Doubles, place: Doubles, freckles: float, texel: float, seed: int
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


@compiled
def spread_pigments(
    patch: Patch, places: Doubles, marks: Doubles, melanin: float, blood: float, out: Doubles
) -> None:
    """Fill `out` (n, 2) with the shares of melanin and blood [-]."""
    for row in range(len(patch.points)):
        x, y, z = patch.points[row]
        place, mark, texel, seed = places[row], marks[row], patch.texel_mm[row], patch.seed
        brown = place[MELANIN] + _LIP_MELANIN * place[LIP]
        brown += _PATCHES * fractal_noise(x, y, z, _PATCH_BLOB_MM, _PATCH_GAIN, texel, seed + 121)
        brown += _FRECKLE * mark[FRECKLE] + _MOLE * mark[MOLE] + _PORE * mark[PORE]
        red = place[BLOOD] + _RED_PORE * mark[PORE]
        red += _BLOTCHES * fractal_noise(x, y, z, _BLOTCH_BLOB_MM, _BLOTCH_GAIN, texel, seed + 131)
        red += place[LIP] * _lip(x, y, z, place, seed)
        red += _RED_LIDS * (1.0 - smooth_step(0.3, 2.0, place[LID]))
        out[row, 0] = min(melanin * math.exp2(brown), 1.0)
        out[row, 1] = min(blood * math.exp2(red), 1.0)


@compiled
def _lip(x: float, y: float, z: float, place: Doubles, seed: int) -> float:
    """Blood of the lips over that of other skin [doublings], most where they meet."""
    streaks = 0.3 * gradient_noise(x / 1.6, y / 9.0, z / 9.0, seed + 141)
    slit = _RED_SLIT * (1.0 - smooth_step(0.0, 2.2, abs(place[MOUTH])))
    return float(_LIP_BLOOD + streaks + slit - max(place[BLOOD], 0.0))
