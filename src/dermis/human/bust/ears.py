"""The outer ear: a thin curled sheet with helix, antihelix, concha, tragus and lobe."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import (
    Doubles,
    cone,
    ellipsoid,
    rise,
    rotation,
    smooth_difference,
    smooth_intersection,
    smooth_union,
    spline,
    tube,
)
from dermis.human.bust.parameters import BustParameters

CENTRE = np.array([69.0, -12.0, -6.0])
_FLARE, _TILT, _LEAN = 25.0, 13.0, 7.0  # backwards-outwards, top backwards, top outwards [degrees]
# Rows of the frame: u backwards along the ear, v upwards along it, w outwards from the head.
FRAME = (
    np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    @ rotation(1, -_FLARE).T
    @ rotation(2, -_LEAN).T
    @ rotation(0, -_TILT).T
)
# Artist's values in the plane of the ear [mm].
OUTLINE = [
    (0, 11), (1, 18), (4.5, 25), (10.5, 29.8), (17.5, 31), (24.5, 28.5), (29.5, 22), (31.5, 13), (30.5, 3),
    (27, -7), (22, -15.5), (18, -22), (14.5, -27.5), (9.5, -31), (4, -30), (0.5, -25), (-1.5, -16),
    (-2.5, -5), (-1.5, 4),
]  # fmt: skip
CONCHA = [(0, 2), (3, 8), (9, 9.5), (16, 7), (20, 1), (19.5, -6), (15.5, -11.5), (9, -13), (3.5, -13.5),
          (0, -9), (-0.5, -3)]  # fmt: skip
ANTIHELIX = [(10, -14.5), (15.5, -12.5), (20, -8), (22.3, -1), (22, 6), (19.5, 13), (15.5, 20)]
FORK = [(21.5, 7), (17, 10.5), (10, 12.5), (5, 13)]
# The rim in space, with its thickness: u, v, w, radius [mm].
HELIX = [
    (11.5, -2, -7.5, 1.6), (6.5, 1.5, -4.5, 2.3), (2, 8, 0.2, 2.4), (2.4, 16, 1.0, 2.4),
    (5.5, 23.5, 2.4, 2.4), (11, 27.8, 3.4, 2.5), (17.5, 28.8, 3.0, 2.5), (23.8, 26.2, 2.6, 2.5),
    (28, 20.5, 2.2, 2.4), (29.4, 12.5, 1.8, 2.3), (28.6, 3.5, 1.5, 2.2), (25.4, -6, 1.1, 1.9),
    (21, -13.5, 0.6, 1.5),
]  # fmt: skip


def add_ears(distance: Doubles, p: Doubles, parameters: BustParameters) -> Doubles:
    """The head with its ears; p with x >= 0."""
    size = parameters.ears
    near = p[:, 0] > 40
    local = _local(p[near], size)
    near[near] = beside = _near(local)
    joined = distance.copy()
    joined[near] = _grow(distance[near] / size, local[beside]) * size
    return joined


def belongs(p: Doubles, parameters: BustParameters) -> NDArray[np.bool_]:
    """Which places (n, 3) on the skin are ear; x >= 0."""
    local = _local(p, parameters.ears)
    near = _near(local)
    q = local[near]
    near[near] = np.minimum(_auricle(q), np.minimum(_tragus(q), _canal(q))) < 0.8
    return near


def sides(p: Doubles, parameters: BustParameters) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which places (n, 3) on the skin are auricle, and which lie before the middle of its sheet; x >= 0."""
    local = _local(p, parameters.ears)
    near = _near(local)
    q = local[near]
    _, concha, middle, _ = (layer.read(q[:, 0], q[:, 1]) for layer in _plan())
    front = np.zeros(len(p), dtype=bool)
    front[near] = (q[:, 2] > middle) | (concha < -0.5) | (q[:, 0] < 2)
    near[near] = (np.minimum(_auricle(q), _canal(q)) < 0.6) & (q[:, 0] > -1)
    return near, front


def _local(p: Doubles, size: float) -> Doubles:
    """Coordinates u, v, w in the frame of the ear."""
    return np.asarray((p - CENTRE) @ FRAME.T / size)


def _near(q: Doubles) -> NDArray[np.bool_]:
    return np.asarray((np.abs(q - (14, 0, 4)) < (26, 42, 26)).all(axis=1))


def _grow(distance: Doubles, q: Doubles) -> Doubles:
    bowl = ellipsoid(q, (9, -2.5, 1), (11, 13, 8.5))
    hollowed = smooth_difference(distance, bowl, 4)
    whole = smooth_union(hollowed, _auricle(q), 3)
    whole = smooth_union(whole, _tragus(q), 4)
    return smooth_difference(whole, _canal(q), 2)


def _auricle(q: Doubles) -> Doubles:
    outline, concha, middle, slope = (layer.read(q[:, 0], q[:, 1]) for layer in _plan())
    w = (q[:, 2] - middle) / slope
    sheet = smooth_intersection(np.abs(w) - 1.25, outline + 1.7, 2.2)
    # the concha rests on the head, so no gap is left behind it
    taper = 0.55 * np.maximum(-6 - q[:, 2], 0)
    rest = smooth_intersection(smooth_intersection(w - 1.25, concha - 1.5 + taper, 3), -17 - q[:, 2], 5)
    whole = smooth_union(smooth_union(sheet, rest, 1), tube(q, HELIX), 2.4)
    antitragus = ellipsoid(q, (8.5, -15.0, 1.2), (4.5, 2.8, 2.6), rotation(2, -20))
    lobe = ellipsoid(q, (7.6, -23.6, 0.3), (6.8, 7.2, 1.9))
    root = np.minimum(cone(q, (3, -17, -4), (2, -10, -4), 2.5, 3), cone(q, (1.5, 6, -3), (3.5, 20, -3), 3, 3))
    return smooth_union(smooth_union(smooth_union(whole, antitragus, 2.5), lobe, 4), root, 3)


def _tragus(q: Doubles) -> Doubles:
    return ellipsoid(q, (-1.6, -5.5, 0.6), (3.4, 5.5, 3.0))


def _canal(q: Doubles) -> Doubles:
    return ellipsoid(q, (3.5, -5, -5.5), (3.2, 3.8, 6))


@dataclass(frozen=True)
class Layer:
    """A quantity over the plane of the ear, on a grid of half a millimetre."""

    values: Doubles

    def read(self, u: Doubles, v: Doubles) -> Doubles:
        """Smoothly interpolated values at (n,) places, the nearest beyond the grid."""
        from scipy.ndimage import map_coordinates

        return np.asarray(
            map_coordinates(self.values, [(u + 14) / 0.5, (v + 44) / 0.5], order=3, mode="nearest")
        )


@lru_cache(maxsize=1)
def _plan() -> tuple[Layer, ...]:
    """Distances to the outline and to the concha's, height of the sheet's middle, and its steepness."""
    from scipy.ndimage import gaussian_filter

    u, v = np.meshgrid(np.arange(-14, 43, 0.5), np.arange(-44, 45, 0.5), indexing="ij")
    places = np.column_stack((u.ravel(), v.ravel()))
    outline = _closed(places, OUTLINE).reshape(u.shape)
    concha = _closed(places, CONCHA).reshape(u.shape)
    branches = _away(places, spline(ANTIHELIX, 8)), _away(places, spline(FORK, 8)) + 0.6
    ridge = smooth_union(*branches, 4.0).reshape(u.shape)
    middle = 3.6 * np.exp(-((ridge / 3.4) ** 2)) - 8.5 * rise(-concha, -1.5, 5.5)
    middle -= 1.4 * np.exp(-(((outline + 7.0) / 2.5) ** 2)) * rise(v, -10, 4)
    middle += 1.2 * rise(outline, -5, 0) * rise(v, -18, -6)
    middle -= 2.5 * rise(u, 8, -2) * rise(v, -2, 8)
    middle = gaussian_filter(middle, 1.6, mode="nearest")
    du, dv = np.gradient(middle, 0.5)
    steepness = gaussian_filter(np.sqrt(1 + du * du + dv * dv), 2.0, mode="nearest")
    return Layer(outline), Layer(concha), Layer(middle), Layer(steepness)


def _closed(places: Doubles, knots: list[tuple[float, float]]) -> Doubles:
    """Signed distance to a closed curve through knots, negative inside."""
    curve = spline(knots, 8, closed=True)
    u, v = places.T
    inside = np.zeros(len(places), dtype=bool)
    for (u0, v0), (u1, v1) in pairwise(curve):
        if v0 != v1:  # a ray along u crosses this piece
            inside ^= ((v0 > v) != (v1 > v)) & (u < u0 + (v - v0) * (u1 - u0) / (v1 - v0))
    return np.where(inside, -1, 1) * _away(places, curve)


def _away(places: Doubles, curve: Doubles) -> Doubles:
    """Distance to a line of straight pieces."""
    nearest = np.full(len(places), np.inf)
    for a, b in pairwise(curve):
        along = b - a
        t = np.clip((places - a) @ along / (along @ along), 0, 1)
        nearest = np.minimum(nearest, np.hypot(*(places - a - t[:, None] * along).T))
    return nearest
