"""The search for pairs of places that exchange light through the flesh, and how far apart they are."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.machine_code import compiled

Doubles = NDArray[np.float64]
Integers = NDArray[np.int64]
Metric = tuple[float, float, float]  # texels per mm along u and v, and the cosine between these

ASKEW = 0.5
"""Cosine of two normals below which two places make a pair."""

_OPPOSED = -0.2  # cosine at which a pair counts fully
_NEIGHBOURS = 3.0  # texels within which the nine around one are found
_ACROSS_AIR = -0.5  # mean cosine to the inward normals at which two places only see each other from outside


class Sources(NamedTuple):
    """Places that give light: position, normal (n, 3), in the order in which the cells of a grid list them.

    listed : (n,) the number of each
    """

    position: Doubles
    normal: Doubles
    low: Doubles
    cell_mm: float
    size: Integers
    first: Integers
    listed: Integers


class Receivers(NamedTuple):
    """Places that take light: position, normal (m, 3), and texel (m, 2) of the atlas (x, y).

    stretch, shear : (m, 2) and (m,) there, as `Atlas` has them
    """

    position: Doubles
    normal: Doubles
    texel: Integers
    stretch: NDArray[np.float32]
    shear: NDArray[np.float32]


class Map(NamedTuple):
    """What the atlas shows.

    reach : as `Atlas` has it
    shown : (n, n) the source whose light each texel shows, -1 for none
    """

    reach: NDArray[np.uint16]
    shown: NDArray[np.int32]


class Hits(NamedTuple):
    """Texels that show a source: which, and how far off in the map [mm]."""

    source: NDArray[np.int32]
    distance: NDArray[np.float32]


class Along(NamedTuple):
    """For each source: distance in the map to the nearest texel that shows it [mm]; sum and count around."""

    nearest: NDArray[np.float32]
    sum: NDArray[np.float32]
    number: NDArray[np.int32]


@compiled
def search(
    receivers: Receivers,
    part: tuple[int, int],
    sources: Sources,
    flat: Map,
    radius_mm: float,
    count: Integers,
) -> tuple[NDArray[np.int32], NDArray[np.uint16]]:
    """Sources (l,) of some receivers, one after the other, and (l, 4) their geometry.

    That is: depth under the source's tangent plane, distance beside its normal, distance along the surface
    [1/65535 of the radius; 65535 where no blur gets there]; share that counts [1/65535].

    part : first receiver, and the one after the last
    count : (m,) sources of each receiver, to be written
    """
    most = len(sources.position)
    found, shape = np.empty(most, np.int32), np.empty((most, 4), np.float32)
    texels = int((flat.shown >= 0).sum())  # in gutters any number of them may show one source
    hits = Hits(np.empty(texels, np.int32), np.empty(texels, np.float32))
    away = Along(np.full(most, np.inf, np.float32), np.zeros(most, np.float32), np.zeros(most, np.int32))
    index, geometry = np.empty(1 << 16, np.int32), np.empty((1 << 16, 4), np.uint16)
    total = 0
    for i in range(part[0], part[1]):
        n = _look_around(receivers.position[i], receivers.normal[i], sources, radius_mm, found, shape)
        count[i] = n
        if n == 0:
            continue
        metric = receivers.stretch[i, 0], receivers.stretch[i, 1], receivers.shear[i]
        marked = _spread(receivers.texel[i], metric, flat, radius_mm, hits, away)
        for k in range(n):
            j = found[k]
            shape[k, 2] = away.sum[j] / away.number[j] if away.number[j] else np.inf
        _forget(hits, marked, away)
        while total + n > len(index):
            index = np.concatenate((index, np.empty_like(index)))
            geometry = np.concatenate((geometry, np.empty_like(geometry)))
        index[total : total + n] = found[:n]
        for k in range(n):
            for m in range(3):
                geometry[total + k, m] = _part(shape[k, m] / radius_mm)
            geometry[total + k, 3] = _part(shape[k, 3])
        total += n
    return index[:total], geometry[:total]


@compiled
def _part(share: float) -> int:
    """A number of 0 to 1 [1/65535]."""
    return int(np.rint(min(share, 1.0) * 65535.0))


@compiled
def _look_around(
    place: Doubles,
    normal: Doubles,
    sources: Sources,
    radius_mm: float,
    found: NDArray[np.int32],
    shape: NDArray[np.float32],
) -> int:
    """How many sources within a ball lie across the flesh; writes them and their geometry."""
    n = 0
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for k in range(3):
        low[k] = max(0, math.floor((place[k] - radius_mm - sources.low[k]) / sources.cell_mm))
        high[k] = min(
            sources.size[k] - 1, math.floor((place[k] + radius_mm - sources.low[k]) / sources.cell_mm)
        )
        if low[k] > high[k]:  # a place outside the grid
            return 0
    for z in range(low[2], high[2] + 1):
        for y in range(low[1], high[1] + 1):
            row = sources.size[0] * (y + sources.size[1] * z)
            for q in range(sources.first[row + low[0]], sources.first[row + high[0] + 1]):
                if _through_flesh(place, normal, sources.position[q], sources.normal[q], radius_mm, shape[n]):
                    found[n] = sources.listed[q]
                    n += 1
    return n


@compiled
def _through_flesh(
    place: Doubles,
    normal: Doubles,
    other: Doubles,
    its_normal: Doubles,
    radius_mm: float,
    shape: NDArray[np.float32],
) -> bool:
    """Whether flesh lies between two places that face apart; writes depth, distance beside and share."""
    cosine = normal[0] * its_normal[0] + normal[1] * its_normal[1] + normal[2] * its_normal[2]
    if cosine >= ASKEW:  # as on most of the surface around
        return False
    square, below, depth = 0.0, 0.0, 0.0
    for k in range(3):
        to = other[k] - place[k]
        square += to * to
        below -= to * normal[k]
        depth += to * its_normal[k]
    if square >= radius_mm * radius_mm:
        return False
    inward = 0.5 * (below + depth) / math.sqrt(max(square, 1e-12))
    share = _rise(ASKEW, _OPPOSED, cosine) * _rise(_ACROSS_AIR, 0.0, inward)
    shape[0] = abs(depth)
    shape[1] = math.sqrt(max(0.0, square - depth * depth))
    shape[3] = share
    return share > 0.0


@compiled
def _rise(start: float, end: float, x: float) -> float:
    """From 0 at the start to 1 at the end, smooth at both."""
    t = min(1.0, max(0.0, (x - start) / (end - start)))
    return t * t * (3.0 - 2.0 * t)


@compiled
def _spread(texel: Integers, metric: Metric, flat: Map, radius_mm: float, hits: Hits, away: Along) -> int:
    """Distance in the map to every source that a blur brings light from; returns how many texels show one.

    Up to nine texels show a source, each from a little off: the mean over those around the nearest counts.
    """
    n = _texels_around(texel, metric, flat, radius_mm, hits)
    for k in range(n):
        away.nearest[hits.source[k]] = min(away.nearest[hits.source[k]], hits.distance[k])
    apart = _NEIGHBOURS / min(metric[0], metric[1])
    for k in range(n):
        j = hits.source[k]
        if hits.distance[k] <= away.nearest[j] + apart:
            away.sum[j] += hits.distance[k]
            away.number[j] += 1
    return n


@compiled
def _texels_around(texel: Integers, metric: Metric, flat: Map, radius_mm: float, hits: Hits) -> int:
    """How many texels that a blur reads show a source; writes which, and the distance in the map."""
    n, size = 0, len(flat.shown)
    x, y = texel[0], texel[1]
    u, v, cosine = metric
    straight = math.sqrt(max(1e-3, 1.0 - cosine * cosine))
    wide, high = int(radius_mm * u / straight), int(radius_mm * v / straight)
    for dv in range(-min(high, flat.reach[y, x, 2], y), min(high, flat.reach[y, x, 3], size - 1 - y) + 1):
        left, right = flat.reach[y + dv, x, 0], flat.reach[y + dv, x, 1]
        for du in range(-min(wide, left, x), min(wide, right, size - 1 - x) + 1):
            a, b = du / u, dv / v
            square = a * a + b * b + 2.0 * cosine * a * b
            if flat.shown[y + dv, x + du] >= 0 and square < radius_mm * radius_mm:
                hits.source[n], hits.distance[n] = flat.shown[y + dv, x + du], math.sqrt(square)
                n += 1
    return n


@compiled
def _forget(hits: Hits, n: int, away: Along) -> None:
    for k in range(n):
        j = hits.source[k]
        away.nearest[j], away.sum[j], away.number[j] = np.inf, 0.0, 0
