"""Height of the skin over its smooth surface, in mm."""

from __future__ import annotations

import math

from dermis.human.bust.fields import Doubles
from dermis.human.skin_maps.face import Folds
from dermis.human.skin_maps.kernels.marks import HAIR, MOLE, PORE
from dermis.human.skin_maps.kernels.noise import blobs, fractal_noise, gradient_noise, smooth_step, visible
from dermis.human.skin_maps.kernels.places import AROUND, FURROWS, LEVEL, LIP, MOUTH, X, Y, Z
from dermis.human.skin_maps.look import Patch
from dermis.machine_code import compiled

# Artist's values [mm].
_PORE_MM, _MOLE_MM, _HAIR_MM = 0.085, 0.18, 0.05
_FURROW_MM, _FURROW_BLOB_MM = 0.044, 1.15
_GRAIN_MM, _GRAIN_BLOB_MM = 0.048, 2.6
_LINE_MM = 0.07
_LIP_MM = 0.2
_EYE_X, _EYE_Y = 31.7, -1.0
_WANDER_MM = 2.4  # of the folds, at most
_REACH = 6.0  # of a fold, in its widths


@compiled
def raise_skin(patch: Patch, places: Doubles, marks: Doubles, folds: Folds, age: float, out: Doubles) -> None:
    """Fill `out` (n,) [mm]."""
    for row in range(len(patch.points)):
        x, y, z = patch.points[row]
        place, mark, texel, seed = places[row], marks[row], patch.texel_mm[row], patch.seed
        amount = max(1.0 + place[FURROWS], 0.2) * (1.0 - 0.85 * place[LIP]) * (1.0 - 0.7 * mark[MOLE])
        height = amount * _grain(x, y, z, texel, seed)
        height += amount * (0.8 + 1.4 * age * age) * _furrows(x, y, z, texel, seed)
        height += (0.5 + age) * _lines(x, y, z, place, texel, seed)
        if place[LIP] > 0.0:
            height += place[LIP] * _lip(x, y, z, place, texel, seed)
        height += _fold(x, y, z, place, folds, texel, seed + 500)
        out[row] = height + _MOLE_MM * mark[MOLE] + _HAIR_MM * mark[HAIR] - _PORE_MM * mark[PORE]


@compiled
def _grain(x: float, y: float, z: float, texel: float, seed: int) -> float:
    """Uneven cushions between the furrows."""
    rough = 0.6 + 0.5 * blobs(x, y, z, 9.0, seed + 61)
    n = fractal_noise(x, y, z, _GRAIN_BLOB_MM, 0.62, texel, seed + 62)
    lumps = abs(blobs(x, y, z, 1.3, seed + 73)) * visible(1.3, texel)
    return _GRAIN_MM * rough * (n + 0.9 * lumps)


@compiled
def _furrows(x: float, y: float, z: float, texel: float, seed: int) -> float:
    """Three sets of fine crossing lines, each with a direction of its own.

    Source: [Corcuff1983] for directions and depth, which on the forearm is 0.04 mm and grows to 0.1 with age.
    """
    wx = x + 0.4 * blobs(x, y, z, 1.8, seed + 81)
    wy = y + 0.4 * blobs(x, y, z, 1.8, seed + 82)
    wz = z + wx - x
    patch = 0.5 * blobs(x, y, z, 6.0, seed + 83)
    depth = (0.6 + patch) * _along(wx, wy, wz, 0.70, 0.70, 0.14, texel, seed + 84)
    depth += (0.6 - patch) * _along(wx, wy, wz, -0.60, 0.77, 0.22, texel, seed + 85)
    depth += 0.5 * _along(wx, wy, wz, 0.90, 0.10, -0.42, texel, seed + 86)
    return -_FURROW_MM * depth


@compiled
def _along(x: float, y: float, z: float, dx: float, dy: float, dz: float, texel: float, seed: int) -> float:
    """Depth of lines along (dx, dy, dz), four times as long as they are apart [-]."""
    run = 0.75 * (x * dx + y * dy + z * dz)
    b = _FURROW_BLOB_MM
    n = gradient_noise((x - run * dx) / b, (y - run * dy) / b, (z - run * dz) / b, seed)
    return _groove(n, 4.0, texel, b)


@compiled
def _groove(n: float, sharpness: float, texel: float, blob_mm: float) -> float:
    """Depth of a groove where noise crosses zero, no sharper than texels can show [-]."""
    finest = min(sharpness, 0.45 * blob_mm / texel)
    side = max(1.0 - abs(n) * finest, 0.0)
    return side * side * finest / sharpness * visible(blob_mm, texel)


@compiled
def _lines(x: float, y: float, z: float, place: Doubles, texel: float, seed: int) -> float:
    """Fine lines across the forehead and the neck, and around the eyes."""
    height = 0.0
    dx = 0.8 * blobs(x, y, z, 5.0, seed + 91)
    uneven = max(0.45 + 0.9 * blobs(x, y, z, 7.0, seed + 92), 0.0)
    if place[LEVEL] > 1e-3:
        n = gradient_noise(x / 11.0, (y + dx) / 1.5, z / 11.0, seed + 93)
        height -= place[LEVEL] * uneven * _LINE_MM * _groove(n, 3.5, texel, 1.5)
    if place[AROUND] > 1e-3:
        away = math.hypot(abs(place[X]) - _EYE_X, 1.25 * (place[Y] - _EYE_Y)) + dx
        n = gradient_noise(away / 1.1, x / 9.0, y / 9.0, seed + 94)
        height -= place[AROUND] * (0.3 + uneven) * 0.9 * _LINE_MM * _groove(n, 3.0, texel, 1.1)
    return height


@compiled
def _lip(x: float, y: float, z: float, place: Doubles, texel: float, seed: int) -> float:
    """Creases across the lip, which fork and run out, and its soft plumpness between them."""
    wx = x + 0.9 * blobs(x, y, z, 3.2, seed + 101)
    wx += 0.02 * x * abs(place[MOUTH])
    n = gradient_noise(wx / 1.7, y / 9.0, z / 14.0, seed + 102)
    fine = gradient_noise(wx / 0.8, y / 5.0, z / 9.0, seed + 103)
    uneven = 0.6 + 0.6 * blobs(x, y, z, 4.0, seed + 104)
    depth = uneven * _groove(n, 2.2, texel, 1.7) + 0.3 * _groove(fine, 2.5, texel, 0.8)
    return -_LIP_MM * depth * smooth_step(0.2, 2.0, abs(place[MOUTH]))


@compiled
def _fold(x: float, y: float, z: float, place: Doubles, folds: Folds, texel: float, seed: int) -> float:
    """Furrows along the face's own lines, with the skin a little raised beside them."""
    height = 0.0
    for c in range(len(folds.width_mm)):
        width = math.sqrt(folds.width_mm[c] ** 2 + (0.8 * texel) ** 2)
        px, py, pz = abs(place[X]), place[Y], place[Z]
        dx, dy, dz = px - folds.bounds[c, 0], py - folds.bounds[c, 1], pz - folds.bounds[c, 2]
        reach = _REACH * width + _WANDER_MM
        if dx * dx + dy * dy + dz * dz > (folds.bounds[c, 3] + reach) ** 2:
            continue
        if _nearest(px, py, pz, folds, c)[0] > reach * reach:
            continue
        px += 0.7 * _WANDER_MM * blobs(x, y, z, 19.0, seed + c) + 0.3 * _WANDER_MM * blobs(
            x, y, z, 5.0, seed - c
        )
        py += 0.7 * _WANDER_MM * blobs(x, y, z, 21.0, seed - c) + 0.3 * _WANDER_MM * blobs(
            x, y, z, 6.0, seed + c
        )
        uneven = max(0.8 + 0.6 * blobs(x, y, z, 8.0, seed + c), 0.0)
        away, along = _nearest(px, py, pz, folds, c)
        depth = folds.depth_mm[c] * folds.width_mm[c] / width * uneven * (1.0 - (2.0 * along - 1.0) ** 4)
        height += depth * _profile(away / (width * width))
    return height


@compiled
def _profile(square: float) -> float:
    """Height across a fold of depth 1, by the squared distance in widths."""
    return (0.35 * math.exp(-square / 7.0) - math.exp(-square)) * smooth_step(
        _REACH**2, 0.6 * _REACH**2, square
    )


@compiled
def _nearest(x: float, y: float, z: float, folds: Folds, c: int) -> tuple[float, float]:
    """Squared distance to a curve [mm2], and how far along it that is [-]."""
    nearest, place = 1e9, 0.0
    for k in range(folds.first[c], folds.first[c + 1] - 1):
        ax, ay = folds.knots[k + 1, 0] - folds.knots[k, 0], folds.knots[k + 1, 1] - folds.knots[k, 1]
        az = folds.knots[k + 1, 2] - folds.knots[k, 2]
        dx, dy, dz = x - folds.knots[k, 0], y - folds.knots[k, 1], z - folds.knots[k, 2]
        t = min(max((dx * ax + dy * ay + dz * az) / (ax * ax + ay * ay + az * az), 0.0), 1.0)
        away = (dx - t * ax) ** 2 + (dy - t * ay) ** 2 + (dz - t * az) ** 2
        if away < nearest:
            nearest = away
            place = folds.along[k] + t * (folds.along[k + 1] - folds.along[k])
    return nearest, place
