"""How melanin and blood are spread over the skin."""

from __future__ import annotations

import math

from dermis.human.skin_maps.kernels.marks import FRECKLE, MOLE, PORE
from dermis.human.skin_maps.kernels.noise import fractal_noise, gradient_noise, smooth_step
from dermis.human.skin_maps.kernels.places import BLOOD, LID, LIP, MELANIN, MOUTH
from dermis.human.skin_maps.patch import Doubles, Patch
from dermis.machine_code import compiled

# Artist's values, in doublings of the pigment.
_BLOTCHES, _BLOTCH_BLOB_MM, _BLOTCH_GAIN = 0.55, 19.0, 0.86
_PATCHES, _PATCH_BLOB_MM, _PATCH_GAIN = 0.22, 24.0, 0.75
_FRECKLE, _MOLE, _PORE, _RED_PORE = 1.7, 3.4, 0.7, 0.4
_LIP_BLOOD, _LIP_MELANIN = 2.3, 0.5
_RED_LIDS, _RED_SLIT = 0.8, 1.2


@compiled
def spread(patch: Patch, places: Doubles, marks: Doubles, melanin: float, blood: float, out: Doubles) -> None:
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
