"""All maps of a bust's skin, for places in any order."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import Doubles
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.regions import REGIONS, region_of
from dermis.human.skin_maps.face import make_face, make_folds
from dermis.human.skin_maps.hairs import make_hairs
from dermis.human.skin_maps.look import Patch, SkinLook
from dermis.human.skin_maps.reflection import colour_of, gloss

Floats = NDArray[np.float32]

_CHUNK = 1 << 15
_TEXTURES = 1000  # seeds that the textures of one look may use


class Painted(NamedTuple):
    """Skin at n places.

    colour : (n, 3) diffuse reflectance, linear Rec. 709 [-]
    height_mm : (n,) over the smooth surface [mm]
    rho_s, roughness : (n,) strength and Beckmann roughness of the surface's reflection [-]
    region : (n,) index into `regions.REGIONS`
    """

    colour: Floats
    height_mm: Floats
    rho_s: Floats
    roughness: Floats
    region: NDArray[np.uint8]


def paint_skin(
    points: NDArray[np.floating],
    normals: NDArray[np.floating],
    parameters: BustParameters,
    look: SkinLook,
    texel_mm: float | NDArray[np.floating] = 0.1,
) -> Painted:
    """Colour, relief and gloss of the skin at these places of a bust.

    points : (n, 3) on the bust of `parameters` [mm]
    normals : (n, 3) of its smooth surface, of any length
    texel_mm : how far apart places are, one number or (n,): nothing finer than about two is painted [mm]

    Each place is painted by itself: their order and number do not matter.
    """
    brush = _brush(parameters, look)
    texels = np.broadcast_to(np.asarray(texel_mm, np.float64), len(points))

    def paint(rows: slice) -> Painted:
        place, normal, texel = (np.array(values[rows], np.float64) for values in (points, normals, texels))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return brush.paint(Patch(place, normal, texel, look.seed * _TEXTURES))

    starts = range(0, max(len(points), 1), _CHUNK)
    # the kernels release the GIL, so that threads share the work
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = list(pool.map(paint, (slice(start, start + _CHUNK) for start in starts)))
    return Painted(*(np.concatenate(pieces) for pieces in zip(*parts, strict=True)))


@lru_cache(maxsize=2)
def _brush(parameters: BustParameters, look: SkinLook) -> _Brush:
    return _Brush(parameters, look)


class _Brush:
    """Tables of a bust and a look, made once for all places."""

    def __init__(self, parameters: BustParameters, look: SkinLook) -> None:
        self.look = look
        self.symmetric = replace(parameters, width=1.0, asymmetry=0.0)
        self.face = make_face(parameters)
        self.folds = make_folds(parameters, look.age)
        self.hairs = make_hairs(look.seed)

    def paint(self, patch: Patch) -> Painted:
        from dermis.human.skin_maps.kernels import marks, places, relief

        look, count = self.look, len(patch.points)
        place, mark = np.empty((count, places.COLUMNS)), np.empty((count, marks.COLUMNS))
        height, pigment = np.empty(count), np.empty((count, 2))
        places.locate(patch, self.face, place)
        marks.mark(patch, place, self.hairs, look.freckles, look.moles, look.stubble, mark)
        relief.raise_skin(patch, place, mark, self.folds, look.age, height)
        marks.spread_pigments(patch, place, mark, look.melanin, look.blood, pigment)
        colour = colour_of(look, pigment, place, mark)
        return Painted(colour, height.astype(np.float32), *gloss(look, place, mark), self._regions(place))

    def _regions(self, place: Doubles) -> NDArray[np.uint8]:
        """Labels; boxes rule out face and ear for most of the head."""
        points = place[:, :3]
        x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
        face = (z > -5) & (y > -118) & (y < 80)
        ear = (x > 50) & (np.abs(y + 12) < 50) & (np.abs(z + 20) < 50)
        label = np.full(len(points), REGIONS.index("neck and scalp"), np.uint8)
        label[face | ear] = region_of(points[face | ear], self.symmetric)
        return label
