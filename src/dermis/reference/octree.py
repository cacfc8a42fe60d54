"""An octree of irradiance samples: cubes in cubes, each with the light inside it as one point."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import triangle_areas
from dermis.reference.irradiance_samples import IrradianceSamples
from dermis.reference.light_moments import reduce_inside, summarise

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_LEAF = 16  # triangles that are not worth another cube
_LEVELS = 20  # halvings of the whole; three bits each make a key of 60


class Tree(NamedTuple):
    """Nodes from the root on, each before those inside it; triangles in the order of the nodes.

    first, end : (n,) the node's triangles
    skip : (n,) the next node that is not inside this one
    centre : (n, 3) of all light inside, weighted by irradiance and area [mm]
    radius : (n,) neither light nor place is further from the centre [mm]
    places, flux : (n, 3, 3) three points in place of the light, and their flux by channel [mm, mm²]
    spread, mismatch, offset : (n,) of the points; see `Summary` [mm², mm², mm]
    corners : (m, 3, 3) of the triangles [mm]
    light : (m, 3, 3) irradiance at their corners
    area : (m,) [mm²]
    """

    first: Index
    end: Index
    skip: Index
    centre: Floats
    radius: Floats
    places: Floats
    flux: Floats
    spread: Floats
    mismatch: Floats
    offset: Floats
    corners: Floats
    light: Floats
    area: Floats


def build_tree(samples: IrradianceSamples) -> Tree:
    """The octree of the samples' triangles.

    Source: [JensenBuhler2002], with three points to a node and with bounds that say when to open it.
    """
    middle = np.mean(samples.positions, axis=0)  # moments about a far origin would lose digits
    corners = (np.asarray(samples.positions, np.float64) - middle)[samples.triangles]
    keys = _keys(corners.mean(axis=1))
    order = np.argsort(keys, kind="stable")
    corners, light = corners[order], np.asarray(samples.irradiance, np.float64)[samples.triangles[order]]
    area = triangle_areas(corners)
    first, end, skip = _nodes(keys[order])
    light_in = summarise(corners, light, area, first, end)
    radius = np.linalg.norm(light_in.places - light_in.centre[:, None], axis=2).max(axis=1)
    return Tree(
        first,
        end,
        skip,
        centre=light_in.centre + middle,
        radius=np.maximum(radius, _radius(corners, light_in.centre, first, end)),
        places=light_in.places + middle,
        flux=light_in.flux,
        spread=light_in.spread,
        mismatch=light_in.mismatch,
        offset=light_in.offset,
        corners=corners + middle,
        light=light,
        area=area,
    )


def _keys(places: Floats) -> Index:
    """(m,) which half along z, y and x, then which half of that, and so on: the way down, as bits."""
    low = places.min(axis=0)
    size = max(float((places.max(axis=0) - low).max()), 1e-9)
    cell = np.minimum((places - low) / size * 2**_LEVELS, 2**_LEVELS - 1).astype(np.int64)
    keys = np.zeros(len(places), np.int64)
    for level in range(_LEVELS):
        for axis in range(3):
            keys |= ((cell[:, axis] >> level) & 1) << (3 * level + axis)
    return keys


def _nodes(keys: Index) -> tuple[Index, Index, Index]:
    """First triangle, end and skip of each node, for keys in order."""
    starts, ends = [np.array([0])], [np.array([len(keys)])]
    for level in range(_LEVELS - 1, -1, -1):
        bounds = np.flatnonzero(np.diff(keys >> (3 * level), prepend=-1, append=-1))
        parent = np.searchsorted(starts[-1], bounds[:-1], side="right") - 1
        inside = (parent >= 0) & (bounds[:-1] < ends[-1][parent])
        inside &= ends[-1][parent] - starts[-1][parent] > _LEAF
        if not inside.any():
            break
        starts.append(bounds[:-1][inside])
        ends.append(bounds[1:][inside])
    spans = np.unique(np.column_stack((np.concatenate(starts), -np.concatenate(ends))), axis=0)
    first, end = spans[:, 0], -spans[:, 1]
    return first, end, np.searchsorted(first, end)


def _radius(corners: Floats, centre: Floats, first: Index, end: Index) -> Floats:
    """Distance from the centre to the furthest corner of the box around each node."""
    low = reduce_inside(np.minimum, corners.min(axis=1), first, end)
    high = reduce_inside(np.maximum, corners.max(axis=1), first, end)
    radius: Floats = np.linalg.norm(np.maximum(centre - low, high - centre), axis=1)
    return radius
