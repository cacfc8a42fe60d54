"""The light inside nodes of a tree as a few numbers: moments, and three points that have nearly the same."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Index = NDArray[np.int64]


class Summary(NamedTuple):
    """Three points in place of each node's light, and what bounds their error.

    centre : (n, 3) of all channels together [mm]
    places : (n, 3, 3) of the points [mm]
    flux : (n, 3, 3) irradiance times area of each point, by channel; may be below 0 [mm²]
    spread : (n,) mean square distance of light from the centre plus that of the points, where it is largest
        of all channels [mm²]
    mismatch : (n,) difference of the second moments of light and points, likewise [mm²]
    offset : (n,) distance of the centres of light and points, likewise [mm]
    """

    centre: Floats
    places: Floats
    flux: Floats
    spread: Floats
    mismatch: Floats
    offset: Floats


def summarise(corners: Floats, light: Floats, area: Floats, first: Index, end: Index) -> Summary:
    """Summary of the nodes that hold triangles first to end - 1.

    corners : (m, 3, 3) of the triangles, about an origin in their middle [mm]
    light : (m, 3, 3) irradiance at their corners, linear in between
    area : (m,) [mm²]

    The points have the flux of each channel, its centre within their plane, and all channels' second moments
    together, which for white light is all up to the second order.
    """
    flux, mean, square = _central(corners, light, area, first, end)
    centre, total = mean.pop(), np.maximum(flux.sum(axis=1), np.finfo(float).tiny)
    lengths, axes = _axes(sum(square) / total[:, None, None])
    arms = np.einsum("kj,nj,naj->nka", _CIRCLE, lengths, axes)
    parts = _shared(flux, mean, lengths, axes)
    safe = np.where(flux > 0, flux, np.inf)
    spread, mismatch, offset = np.zeros((3, len(flux), 3))
    for c in range(3):
        weighted = parts[:, :, c, None] * arms
        trace = np.trace(square[c], axis1=1, axis2=2)
        spread[:, c] = trace + (np.abs(weighted) * np.abs(arms)).sum(axis=(1, 2))
        mismatch[:, c] = np.linalg.norm(square[c] - weighted.swapaxes(1, 2) @ arms, axis=(1, 2))
        offset[:, c] = np.linalg.norm(mean[c] - weighted.sum(axis=1), axis=1)
    bounds = (np.max(values / safe, axis=1) for values in (spread, mismatch, offset))
    return Summary(centre, centre[:, None] + arms, parts, *bounds)


_ANGLE = 2 * np.pi / 3 * np.arange(3)
_CIRCLE = np.sqrt(2) * np.column_stack((np.sin(_ANGLE), np.cos(_ANGLE)))


def _central(
    corners: Floats, light: Floats, area: Floats, first: Index, end: Index
) -> tuple[Floats, list[Floats], list[Floats]]:
    """Flux (n, 3), first moments about the centre (n, 3) of each channel and the centre itself, and second
    moments about it (n, 3, 3) of each channel."""
    moments = [_triangle_moments(corners, light[..., c], area) for c in range(3)]
    sums = [[sum_inside(values, first, end) for values in channel] for channel in moments]
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
    """Integrals over triangles of light (m, 3), of light times place, and times place times place.

    From the integrals of products of three barycentric weights: 1/10, 1/30 or 1/60 of the area when
    three, two or none of them are the same; of two, 1/6 or 1/12.
    """
    sum_light, sum_place = light.sum(axis=1), corners.sum(axis=1)
    weighted = (light[:, None] @ corners)[:, 0]
    crossed = weighted[:, :, None] * sum_place[:, None]
    own = corners.swapaxes(1, 2) @ ((sum_light[:, None] + 2 * light)[..., None] * corners)
    even = sum_light[:, None, None] * sum_place[:, :, None] * sum_place[:, None]
    square = (even + crossed + crossed.swapaxes(1, 2) + own) * (area / 60)[:, None, None]
    moment = (weighted + sum_light[:, None] * sum_place) * (area / 12)[:, None]
    return sum_light * area / 3, moment, square


def _axes(covariance: Floats) -> tuple[Floats, Floats]:
    """Deviations (n, 2) along the two longer axes (n, 3, 2); a patch of surface hardly has a third."""
    squares, axes = np.linalg.eigh(covariance)
    return np.sqrt(squares[:, 1:].clip(0)), axes[..., 1:]


def _shared(flux: Floats, mean: list[Floats], lengths: Floats, axes: Floats) -> Floats:
    """(n, 3, 3) flux of each point and channel, so that each channel's centre is right in the plane."""
    moment = np.einsum("cna,naj->ncj", np.array(mean), axes)
    tilt = np.divide(moment, lengths[:, None], where=lengths[:, None] > 1e-9, out=np.zeros_like(moment))
    parts: Floats = (flux[:, None] + np.einsum("kj,ncj->nkc", _CIRCLE, tilt)) / 3
    return parts


def sum_inside(values: Floats, first: Index, end: Index) -> Floats:
    """Sum of the rows first to end - 1, for each node."""
    return reduce_inside(np.add, values, first, end)


def reduce_inside(operation: np.ufunc, values: Floats, first: Index, end: Index) -> Floats:
    """The operation over rows first to end - 1, for nodes one after or inside another."""
    # reduceat takes the stretches between neighbouring indices, of which every other one is a node; it
    # wants a row after the last
    padded = np.concatenate((values, values[-1:]))
    inside: Floats = operation.reduceat(padded, np.column_stack((first, end)).ravel(), axis=0)[::2]
    return inside
