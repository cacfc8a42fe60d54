"""An octree over irradiance samples: cubes within cubes, the light in each summed up as three points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.irradiance_samples import IrradianceSamples
from dermis.mesh.geometry import triangle_areas

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_LEAF_TRIANGLES = 16  # triangles; a node with fewer is not split
_MAX_DEPTH = 20  # of the tree; three bits each make a key of 60


class Octree(NamedTuple):
    """Nodes from the root on, each before those inside it; triangles in the order of the nodes.

    first, end : (n,) the node's triangles
    skip : (n,) the next node that is not inside this one
    centre : (n, 3) of all light inside, weighted by irradiance and area [mm]
    radius : (n,) of a ball around the centre that holds the node's triangles and its three points [mm]
    places, flux : (n, 3, 3) the three points and their flux by channel; may be below 0 [mm, mm²]
    spread, mismatch, offset : (n,) bounds of the points' error, of the worst channel: mean square distance
        from the centre of the light plus that of the points [mm²], difference of their second moments [mm²],
        distance between their centres [mm]
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


def build_octree(samples: IrradianceSamples) -> Octree:
    """Return the octree of the samples' triangles.

    Source: [JensenBuhler2002], with three points for each node and bounds that say when to open it.
    """
    middle = np.mean(samples.positions, axis=0)  # moments about a far origin would lose digits
    corners = (np.asarray(samples.positions, np.float64) - middle)[samples.triangles]
    keys = _morton_keys(corners.mean(axis=1))
    order = np.argsort(keys, kind="stable")
    corners, light = corners[order], np.asarray(samples.irradiance, np.float64)[samples.triangles[order]]
    area = triangle_areas(corners)
    first, end, skip = _nodes(keys[order])
    centre, points, flux, spread, mismatch, offset = _point_approximation(corners, light, area, first, end)
    radius = np.linalg.norm(points - centre[:, None], axis=2).max(axis=1)
    return Octree(
        first,
        end,
        skip,
        centre + middle,
        np.maximum(radius, _bounding_radius(corners, centre, first, end)),
        points + middle,
        flux,
        spread,
        mismatch,
        offset,
        corners + middle,
        light,
        area,
    )


def _morton_keys(places: Floats) -> Index:
    """Return (m,) paths down the tree: the half along z, y and x, then the half of that, and so on."""
    low = places.min(axis=0)
    size = max(float((places.max(axis=0) - low).max()), 1e-9)
    cell = np.minimum((places - low) / size * 2**_MAX_DEPTH, 2**_MAX_DEPTH - 1).astype(np.int64)
    keys = np.zeros(len(places), np.int64)
    for level in range(_MAX_DEPTH):
        for axis in range(3):
            keys |= ((cell[:, axis] >> level) & 1) << (3 * level + axis)
    return keys


def _nodes(keys: Index) -> tuple[Index, Index, Index]:
    """Return the first triangle, end and skip of each node, for sorted keys."""
    starts, ends = [np.array([0])], [np.array([len(keys)])]
    for level in range(_MAX_DEPTH - 1, -1, -1):
        bounds = np.flatnonzero(np.diff(keys >> (3 * level), prepend=-1, append=-1))
        parent = np.searchsorted(starts[-1], bounds[:-1], side="right") - 1
        inside = (parent >= 0) & (bounds[:-1] < ends[-1][parent])
        inside &= ends[-1][parent] - starts[-1][parent] > _LEAF_TRIANGLES
        if not inside.any():
            break
        starts.append(bounds[:-1][inside])
        ends.append(bounds[1:][inside])
    spans = np.unique(np.column_stack((np.concatenate(starts), -np.concatenate(ends))), axis=0)
    first, end = spans[:, 0], -spans[:, 1]
    return first, end, np.searchsorted(first, end)


def _bounding_radius(corners: Floats, centre: Floats, first: Index, end: Index) -> Floats:
    """Return the distance from the centre to the furthest corner of the box around each node."""
    low = _reduce_nodes(np.minimum, corners.min(axis=1), first, end)
    high = _reduce_nodes(np.maximum, corners.max(axis=1), first, end)
    radius: Floats = np.linalg.norm(np.maximum(centre - low, high - centre), axis=1)
    return radius


def _point_approximation(
    corners: Floats, light: Floats, area: Floats, first: Index, end: Index
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Return centre, places, flux, spread, mismatch and offset of the nodes, as in `Tree`.

    corners : about an origin in the middle of all triangles

    The points have the flux of each channel, its centre within their plane, and the second moments of all
    channels together, which for white light is everything up to the second order.
    """
    flux, mean, square = _central_moments(corners, light, area, first, end)
    centre, total = mean.pop(), np.maximum(flux.sum(axis=1), np.finfo(float).tiny)
    squares, axes = np.linalg.eigh(sum(square) / total[:, None, None])
    # A patch of surface is nearly flat: its two longer axes will do.
    lengths, axes = np.sqrt(squares[:, 1:].clip(0)), axes[..., 1:]
    arms = np.einsum("kj,nj,naj->nka", _TRIANGLE_POINTS, lengths, axes)
    parts = _point_flux(flux, mean, lengths, axes)
    safe = np.where(flux > 0, flux, np.inf)
    bounds = np.zeros((3, len(flux), 3))
    for c in range(3):
        weighted = parts[:, :, c, None] * arms
        trace = np.trace(square[c], axis1=1, axis2=2)
        bounds[0, :, c] = trace + (np.abs(weighted) * np.abs(arms)).sum(axis=(1, 2))
        bounds[1, :, c] = np.linalg.norm(square[c] - weighted.swapaxes(1, 2) @ arms, axis=(1, 2))
        bounds[2, :, c] = np.linalg.norm(mean[c] - weighted.sum(axis=1), axis=1)
    spread, mismatch, offset = (np.max(values / safe, axis=1) for values in bounds)
    return centre, centre[:, None] + arms, parts, spread, mismatch, offset


_TRIANGLE_ANGLES = 2 * np.pi / 3 * np.arange(3)
_TRIANGLE_POINTS = np.sqrt(2) * np.column_stack((np.sin(_TRIANGLE_ANGLES), np.cos(_TRIANGLE_ANGLES)))


def _central_moments(
    corners: Floats, light: Floats, area: Floats, first: Index, end: Index
) -> tuple[Floats, list[Floats], list[Floats]]:
    """Return moments of the light in each node: of order 0, 1 and 2, by channel.

    Flux (n, 3); first moments about the centre (n, 3) of each channel, then the centre itself; second moments
    about the centre (n, 3, 3) of each channel.
    """
    moments = [_triangle_moments(corners, light[..., c], area) for c in range(3)]
    sums = [[_reduce_nodes(np.add, values, first, end) for values in channel] for channel in moments]
    flux = np.column_stack([channel[0] for channel in sums])
    total = flux.sum(axis=1)[:, None]
    moment = sum(channel[1] for channel in sums)
    centre = np.divide(moment, total, where=total > 0, out=corners[first].mean(axis=1))
    mean, square = [], []
    for power, about_origin, outer in sums:
        crossed = about_origin[:, :, None] * centre[:, None]
        own = power[:, None, None] * centre[:, :, None] * centre[:, None]
        mean.append(about_origin - power[:, None] * centre)
        square.append(outer - crossed - crossed.swapaxes(1, 2) + own)
    return flux, [*mean, centre], square


def _triangle_moments(corners: Floats, light: Floats, area: Floats) -> tuple[Floats, Floats, Floats]:
    """Return integrals over triangles of light (m, 3), of light times position, and times its outer product.

    From the integrals of products of three barycentric weights: 1/10, 1/30 or 1/60 of the area when three,
    two or none of them are the same; of two, 1/6 or 1/12.
    """
    sum_light, sum_place = light.sum(axis=1), corners.sum(axis=1)
    weighted = (light[:, None] @ corners)[:, 0]
    crossed = weighted[:, :, None] * sum_place[:, None]
    own = corners.swapaxes(1, 2) @ ((sum_light[:, None] + 2 * light)[..., None] * corners)
    even = sum_light[:, None, None] * sum_place[:, :, None] * sum_place[:, None]
    square = (even + crossed + crossed.swapaxes(1, 2) + own) * (area / 60)[:, None, None]
    moment = (weighted + sum_light[:, None] * sum_place) * (area / 12)[:, None]
    return sum_light * area / 3, moment, square


def _point_flux(flux: Floats, mean: list[Floats], lengths: Floats, axes: Floats) -> Floats:
    """Return (n, 3, 3) flux of each point and channel that keeps each channel's centre in the plane."""
    moment = np.einsum("cna,naj->ncj", np.array(mean), axes)
    tilt = np.divide(moment, lengths[:, None], where=lengths[:, None] > 1e-9, out=np.zeros_like(moment))
    parts: Floats = (flux[:, None] + np.einsum("kj,ncj->nkc", _TRIANGLE_POINTS, tilt)) / 3
    return parts


def _reduce_nodes(operation: np.ufunc, values: Floats, first: Index, end: Index) -> Floats:
    """Return the operation over rows first to end - 1 of each node."""
    # reduceat reduces between neighbouring indices, so every other result is a node; it also needs a row
    # after the last.
    padded = np.concatenate((values, values[-1:]))
    inside: Floats = operation.reduceat(padded, np.column_stack((first, end)).ravel(), axis=0)[::2]
    return inside
