"""Octree over irradiance samples, with the flux of each node approximated by three points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.irradiance_samples import IrradianceSamples
from dermis.mesh.geometry import triangle_areas

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_MAX_LEAF_TRIANGLES = 16  # a node with at most this many triangles is not split
_MAX_OCTREE_DEPTH = 20  # levels of three bits each, so that keys have 60 bits


class Octree(NamedTuple):
    """Octree of n nodes in depth-first order; its m triangles are sorted in the order of the nodes.

    In each node, three points, each with a flux, approximate the light of all triangles of the node. The
    fields `second_moment`, `moment_error` and `centroid_error` bound the error of this approximation. Each
    of them is the maximum over the channels.

    first : (n,) index of the node's first triangle
    end : (n,) index after the node's last triangle
    next_node : (n,) index of the next node that is not inside this node
    centre : (n, 3) mean position on the node's triangles, weighted by irradiance [mm]
    radius : (n,) radius of a ball around the centre that contains the node's triangles and points [mm]
    points : (n, 3, 3) positions of the three points [mm]
    flux : (n, 3, 3) flux of each point by channel, which may be below 0 [mm²]
    second_moment : (n,) mean square distance of the triangles' light from the centre, plus the same mean for
        the points [mm²]
    moment_error : (n,) difference between the second moments of the triangles' light and of the points [mm²]
    centroid_error : (n,) distance between the centroids of the triangles' light and of the points [mm]
    corners : (m, 3, 3) position of each corner of each triangle [mm]
    irradiance : (m, 3, 3) irradiance at each corner of each triangle, by channel
    area : (m,) areas of the triangles [mm²]
    """

    first: Index
    end: Index
    next_node: Index
    centre: Floats
    radius: Floats
    points: Floats
    flux: Floats
    second_moment: Floats
    moment_error: Floats
    centroid_error: Floats
    corners: Floats
    irradiance: Floats
    area: Floats


def build_octree(samples: IrradianceSamples) -> Octree:
    """Return the octree over the triangles of irradiance samples.

    Source: [JensenBuhler2002]. In contrast to the source, each node has three points instead of one, and
    bounds of the error decide whether the children of a node are visited.
    """
    middle = np.mean(samples.positions, axis=0)  # moments about a distant origin would lose precision
    corners = (np.asarray(samples.positions, np.float64) - middle)[samples.triangles]
    morton_keys = _morton_keys(corners.mean(axis=1))
    order = np.argsort(morton_keys, kind="stable")
    corners = corners[order]
    irradiance = np.asarray(samples.irradiance, np.float64)[samples.triangles[order]]
    area = triangle_areas(corners)
    first, end, next_node = _octree_nodes(morton_keys[order])
    centre, points, flux, second_moment, moment_error, centroid_error = _point_approximation(
        corners, irradiance, area, first, end
    )
    radius = np.linalg.norm(points - centre[:, None], axis=2).max(axis=1)
    return Octree(
        first,
        end,
        next_node,
        centre + middle,
        np.maximum(radius, _bounding_radius(corners, centre, first, end)),
        points + middle,
        flux,
        second_moment,
        moment_error,
        centroid_error,
        corners + middle,
        irradiance,
        area,
    )


def _morton_keys(points: Floats) -> Index:
    """Return the Morton key (m,) of each point; sorting by keys groups the points into octree cells.

    A key interleaves the bits of a cell's indices along z, y and x.

    points : (m, 3) positions
    """
    low = points.min(axis=0)
    size = max(float((points.max(axis=0) - low).max()), 1e-9)
    cell = np.minimum((points - low) / size * 2**_MAX_OCTREE_DEPTH, 2**_MAX_OCTREE_DEPTH - 1).astype(np.int64)
    morton_keys = np.zeros(len(points), np.int64)
    for level in range(_MAX_OCTREE_DEPTH):
        for axis in range(3):
            morton_keys |= ((cell[:, axis] >> level) & 1) << (3 * level + axis)
    return morton_keys


def _octree_nodes(morton_keys: Index) -> tuple[Index, Index, Index]:
    """Return the arrays `first`, `end` and `next_node` of the nodes, as defined in `Octree`.

    morton_keys : (m,) sorted keys of the triangles
    """
    starts, ends = [np.array([0])], [np.array([len(morton_keys)])]
    for level in range(_MAX_OCTREE_DEPTH - 1, -1, -1):
        bounds = np.flatnonzero(np.diff(morton_keys >> (3 * level), prepend=-1, append=-1))
        parent = np.searchsorted(starts[-1], bounds[:-1], side="right") - 1
        contained = (parent >= 0) & (bounds[:-1] < ends[-1][parent])
        contained &= ends[-1][parent] - starts[-1][parent] > _MAX_LEAF_TRIANGLES
        if not contained.any():
            break
        starts.append(bounds[:-1][contained])
        ends.append(bounds[1:][contained])
    spans = np.unique(np.column_stack((np.concatenate(starts), -np.concatenate(ends))), axis=0)
    first, end = spans[:, 0], -spans[:, 1]
    return first, end, np.searchsorted(first, end)


def _bounding_radius(corners: Floats, centre: Floats, first_triangle: Index, end_triangle: Index) -> Floats:
    """Return the distance (n,) from each node's centre to the farthest corner of its bounding box [mm].

    corners : (m, 3, 3) corners of the triangles [mm]
    first_triangle, end_triangle : (n,) range of each node's triangles
    """
    low = _reduce_nodes(np.minimum, corners.min(axis=1), first_triangle, end_triangle)
    high = _reduce_nodes(np.maximum, corners.max(axis=1), first_triangle, end_triangle)
    return np.asarray(np.linalg.norm(np.maximum(centre - low, high - centre), axis=1))


def _point_approximation(
    corners: Floats, irradiance: Floats, area: Floats, first_triangle: Index, end_triangle: Index
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Return centre, points, flux and the three error bounds of the nodes, as defined in `Octree`.

    The points preserve the flux of each channel, the centroid of each channel in the plane of the points, and
    the second moments of the sum of all channels. For white light on a flat surface, all moments up to the
    second order are exact.

    corners : (m, 3, 3) corners of the triangles, relative to the middle of all triangles [mm]
    irradiance : (m, 3, 3) irradiance at the corners
    area : (m,) areas of the triangles [mm²]
    first_triangle, end_triangle : (n,) range of each node's triangles
    """
    flux, first_moments, second_moments = _central_moments(
        corners, irradiance, area, first_triangle, end_triangle
    )
    centre, total = first_moments.pop(), np.maximum(flux.sum(axis=1), np.finfo(float).tiny)
    eigenvalues, axes = np.linalg.eigh(sum(second_moments) / total[:, None, None])
    # A patch of surface is nearly flat, so its two longer axes are enough.
    axis_lengths, axes = np.sqrt(eigenvalues[:, 1:].clip(0)), axes[..., 1:]
    offsets = np.einsum("kj,nj,naj->nka", _UNIT_VARIANCE_POINTS, axis_lengths, axes)
    point_flux = _point_flux(flux, first_moments, axis_lengths, axes)
    safe_flux = np.where(flux > 0, flux, np.inf)
    bounds = np.zeros((3, len(flux), 3))
    for c in range(3):
        weighted = point_flux[:, :, c, None] * offsets
        trace = np.trace(second_moments[c], axis1=1, axis2=2)
        bounds[0, :, c] = trace + (np.abs(weighted) * np.abs(offsets)).sum(axis=(1, 2))
        bounds[1, :, c] = np.linalg.norm(second_moments[c] - weighted.swapaxes(1, 2) @ offsets, axis=(1, 2))
        bounds[2, :, c] = np.linalg.norm(first_moments[c] - weighted.sum(axis=1), axis=1)
    second_moment, moment_error, centroid_error = (np.max(values / safe_flux, axis=1) for values in bounds)
    return centre, centre[:, None] + offsets, point_flux, second_moment, moment_error, centroid_error


_POINT_ANGLES = 2 * np.pi / 3 * np.arange(3)
_UNIT_VARIANCE_POINTS = np.sqrt(2) * np.column_stack((np.sin(_POINT_ANGLES), np.cos(_POINT_ANGLES)))


def _central_moments(
    corners: Floats, irradiance: Floats, area: Floats, first_triangle: Index, end_triangle: Index
) -> tuple[Floats, list[Floats], list[Floats]]:
    """Return the moments of orders 0, 1 and 2 of the light in each of n nodes, about the node's centre.

    The first result is the flux (n, 3) by channel. The second is a list of four arrays (n, 3): the first
    moments of each of the three channels, and the centres of the nodes. The third is a list of the second
    moments (n, 3, 3) of each channel.

    corners : (m, 3, 3) corners of the triangles [mm]
    irradiance : (m, 3, 3) irradiance at the corners
    area : (m,) areas of the triangles [mm²]
    first_triangle, end_triangle : (n,) range of each node's triangles
    """
    moments = [_triangle_moments(corners, irradiance[..., c], area) for c in range(3)]
    sums = [
        [_reduce_nodes(np.add, values, first_triangle, end_triangle) for values in channel]
        for channel in moments
    ]
    flux = np.column_stack([channel[0] for channel in sums])
    total = flux.sum(axis=1)[:, None]
    moment = sum(channel[1] for channel in sums)
    centre = np.divide(moment, total, where=total > 0, out=corners[first_triangle].mean(axis=1))
    first_moments, second_moments = [], []
    for channel_flux, origin_moment, origin_outer in sums:
        cross = origin_moment[:, :, None] * centre[:, None]
        product = channel_flux[:, None, None] * centre[:, :, None] * centre[:, None]
        first_moments.append(origin_moment - channel_flux[:, None] * centre)
        second_moments.append(origin_outer - cross - cross.swapaxes(1, 2) + product)
    return flux, [*first_moments, centre], second_moments


def _triangle_moments(corners: Floats, irradiance: Floats, area: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the integrals of E, E x and E x xᵀ over each triangle, with irradiance E and position x.

    corners : (m, 3, 3) corner positions
    irradiance : (m, 3) irradiance of one channel at the corners
    area : (m,) areas of the triangles
    """
    # The integral of a product of three barycentric weights is 1/10 of the area if all three are the same,
    # 1/30 if two are the same, and 1/60 if all differ. For two weights: 1/6 if they are the same, else 1/12.
    sum_light, sum_position = irradiance.sum(axis=1), corners.sum(axis=1)
    weighted = (irradiance[:, None] @ corners)[:, 0]
    cross = weighted[:, :, None] * sum_position[:, None]
    product = corners.swapaxes(1, 2) @ ((sum_light[:, None] + 2 * irradiance)[..., None] * corners)
    sum_outer = sum_light[:, None, None] * sum_position[:, :, None] * sum_position[:, None]
    second_moments = (sum_outer + cross + cross.swapaxes(1, 2) + product) * (area / 60)[:, None, None]
    moment = (weighted + sum_light[:, None] * sum_position) * (area / 12)[:, None]
    return sum_light * area / 3, moment, second_moments


def _point_flux(
    flux: Floats, first_moments: list[Floats], axis_lengths: Floats, principal_axes: Floats
) -> Floats:
    """Return the flux (n, 3, 3) of each of the three points of each node, by channel.

    In each channel, the points have the same total flux as the node. In the plane of the points, they also
    have the same centroid as the node's light.

    flux : (n, 3) flux of each node by channel
    first_moments : first moments (n, 3) of each channel about the node's centre
    axis_lengths : (n, 2) standard deviations of the node's light along its two longer principal axes
    principal_axes : (n, 3, 2) these axes as columns
    """
    moment = np.einsum("cna,naj->ncj", np.array(first_moments), principal_axes)
    lengths = axis_lengths[:, None]
    ratio = np.divide(moment, lengths, where=lengths > 1e-9, out=np.zeros_like(moment))
    return np.asarray((flux[:, None] + np.einsum("kj,ncj->nkc", _UNIT_VARIANCE_POINTS, ratio)) / 3)


def _reduce_nodes(
    operation: np.ufunc, triangle_values: Floats, first_triangle: Index, end_triangle: Index
) -> Floats:
    """Return for each node the values of its triangles, reduced by a NumPy ufunc such as np.add.

    triangle_values : (m, ...) values of the triangles
    first_triangle, end_triangle : (n,) range of each node's triangles
    """
    # `reduceat` reduces between consecutive indices, so every other result belongs to a node; it also needs a
    # row after the last one.
    padded = np.concatenate((triangle_values, triangle_values[-1:]))
    return np.asarray(
        operation.reduceat(padded, np.column_stack((first_triangle, end_triangle)).ravel(), axis=0)[::2]
    )
