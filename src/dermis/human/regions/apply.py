"""Roughness and specular maps of a head, painted region by region."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.base.disk import Array, Arrays, cached_arrays
from dermis.base.errors import DermisError
from dermis.base.progress import logged_step
from dermis.human.regions.labels import known_landmarks, label_texels
from dermis.human.regions.region_table import (
    DEFAULT_TABLE_NAME,
    REGION_VALUE_LIMITS,
    Doubles,
    RegionTable,
    load_region_table,
)
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

Floats = NDArray[np.float32]

MIN_MAP_SIDE = 1024
"""Minimum side of the maps [texel]; larger maps of the head keep their size."""
REGION_BLUR_MM = 2.5
"""Standard deviation of the blur of borders between regions [mm]."""
_DETAIL_BLUR_MM = 6.0  # finer detail is taken from the head's own maps, the rest from the table
_MIN_RELATIVE_LOCAL_MEAN = 0.4  # smallest local mean of a map, relative to its mean
_MAX_RATIO_TO_LOCAL_MEAN = 3.0  # largest value of a map, relative to its local mean
_BLUR_GRID_CELL_MM = 2.0
_MAX_BLUR_GRID_CELLS = 256  # along the longest side of the grid
_BLUR_TRUNCATION_SIGMAS = 3  # radius of the blur kernel in standard deviations
_CACHE_VERSION = 2  # increment when `with_regions` returns different maps for the same head


def with_regions(head: Head, table: RegionTable | str | Path = DEFAULT_TABLE_NAME) -> tuple[Head, float]:
    """Return a head with roughness and specular maps by region of the face.

    The renderer scales the specular map to a mean of `Skin.rho_s`; set `Skin.rho_s` to the returned mean, so
    that the regions get the values of the table. Fine detail of existing roughness and specular maps is kept:
    the new map is multiplied by the ratio of the existing map to its local mean.

    Parameters
    ----------
    head : Head
        Head with known regions: a parametric human, a sample head of the package, or a head with a label map.
        Any other head needs a table that names a file of landmarks or a label map.
    table : RegionTable, str or path
        Roughness and specular strength of each region: a table, the path of a TOML file, or "default" for the
        package's table.

    Returns
    -------
    head : Head
        The head with the maps.
    rho_s : float
        Mean specular strength of the skin [-].

    Raises
    ------
    DermisError
        For heads whose regions are not known, and for invalid tables.

    Examples
    --------
    >>> import dermis, numpy
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> labels = numpy.full((64, 64), 3, numpy.uint8)
    >>> head = dermis.Head("nose", uv_sphere(90.0, 8, 4), Maps(region=labels))
    >>> round(dermis.with_regions(head)[1], 2)
    0.75
    """
    if not isinstance(table, RegionTable):
        table = load_region_table(table)
    atlas = build_atlas(head.mesh, MIN_MAP_SIDE)
    points = atlas.interpolate(head.mesh, head.mesh.positions)[atlas.coverage]
    smoothed = gaussian_mean(points, table.values[label_texels(head, atlas, table)], REGION_BLUR_MM)
    own_maps = (head.maps.roughness, head.maps.specular)
    roughness, specular = (
        np.clip(_region_map(atlas, points, smoothed[:, k], own_maps[k]), *limits)
        for k, limits in enumerate(REGION_VALUE_LIMITS.values())
    )
    y, x = np.nonzero(atlas.coverage)
    height, width = specular.shape
    mean = float(specular[y * height // MIN_MAP_SIDE, x * width // MIN_MAP_SIDE].mean())
    return replace(head, maps=replace(head.maps, roughness=roughness, specular=specular)), mean


def _region_map(
    atlas: Atlas, points: NDArray[np.float64], region_values: NDArray[np.float64], existing_map: Floats | None
) -> Floats:
    """Return a map (h, w) of roughness or specular strength, with the fine detail of an existing map.

    points : (n, 3) positions of the covered texels of the atlas [mm]
    region_values : (n,) roughness or specular strength at these texels, smoothed across region borders
    existing_map : (h, w) existing map of the same quantity, or None
    """
    if existing_map is None:
        return _texel_image(atlas, region_values)
    y, x = np.nonzero(atlas.coverage)
    height, width = existing_map.shape
    values = existing_map[y * height // MIN_MAP_SIDE, x * width // MIN_MAP_SIDE].astype(np.float64)
    local_mean = gaussian_mean(points, values[:, None], _DETAIL_BLUR_MM)[:, 0]
    local_mean = np.maximum(local_mean, _MIN_RELATIVE_LOCAL_MEAN * values.mean())
    local_mean = np.maximum(local_mean, np.finfo(np.float32).eps)
    shape = max(height, MIN_MAP_SIDE), max(width, MIN_MAP_SIDE)
    detail = np.minimum(
        _resize_map(existing_map, shape) / _resize_map(_texel_image(atlas, local_mean), shape),
        _MAX_RATIO_TO_LOCAL_MEAN,
    )
    return np.asarray(detail * _resize_map(_texel_image(atlas, region_values), shape))


def _texel_image(atlas: Atlas, texel_values: NDArray[np.float64]) -> Floats:
    """Return values (n,) of covered atlas texels as an image; other texels copy the nearest covered texel."""
    from scipy.ndimage import distance_transform_edt

    image = np.zeros(atlas.coverage.shape, np.float32)
    image[atlas.coverage] = texel_values
    y, x = distance_transform_edt(~atlas.coverage, return_distances=False, return_indices=True)
    return np.asarray(image[y, x])


def _resize_map(region_map: Floats, map_shape: tuple[int, int]) -> Floats:
    from scipy.ndimage import zoom

    if region_map.shape == map_shape:
        return region_map
    factors = map_shape[0] / region_map.shape[0], map_shape[1] / region_map.shape[1]
    return np.asarray(zoom(region_map, factors, order=1, mode="nearest", grid_mode=True), np.float32)


def gaussian_mean(points: Doubles, point_values: Doubles, sigma_mm: float) -> Doubles:
    """Return values (n, c) at points of a surface, blurred with a Gaussian in 3D.

    Distances in space are used, so that seams of the uv layout have no effect.

    points : (n, 3) positions of the points [mm]
    point_values : (n, c) values at the points
    sigma_mm : standard deviation of the Gaussian [mm]
    """
    from scipy.ndimage import gaussian_filter, map_coordinates

    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    side = max(_BLUR_GRID_CELL_MM, float(extent.max()) / _MAX_BLUR_GRID_CELLS)
    position = (points - low) / side + 1
    shape = tuple(int(length) + 4 for length in extent / side)
    cell = np.ravel_multi_index(tuple(np.rint(position).astype(int).T), shape)
    count = np.bincount(cell, minlength=int(np.prod(shape)))

    def blur(quantity: Doubles) -> Doubles:
        grid = np.divide(quantity, count, out=np.zeros(len(count)), where=count > 0).reshape(shape)
        smooth = gaussian_filter(grid, sigma_mm / side, mode="constant", truncate=_BLUR_TRUNCATION_SIGMAS)
        return np.asarray(map_coordinates(smooth, position.T, order=1))

    weight = blur(count.astype(np.float64))
    sums = [np.bincount(cell, column, minlength=len(count)).astype(np.float64) for column in point_values.T]
    return np.stack([blur(column) / weight for column in sums], axis=-1)


@logged_step("finding the regions of the face")
def with_default_regions(head: Head) -> Head:
    """Return a head with roughness and specular maps from the package's region table.

    A head with unknown regions or with a roughness map is returned unchanged. An existing specular map is
    kept. The mean of a new specular map has no effect, because the renderer scales it to `Skin.rho_s`.
    """
    if head.maps.has_roughness or known_landmarks(head) is None:
        return head
    table = load_region_table(DEFAULT_TABLE_NAME)
    missing = ["roughness"] if head.maps.specular is not None else ["roughness", "specular"]
    sources: list[Array] = [head.mesh.positions, head.mesh.uv, head.mesh.triangles, table.values]

    def make_region_maps() -> Arrays:
        maps = with_regions(replace(head, maps=Maps()), table)[0].maps
        return {name: np.asarray(getattr(maps, name), np.float32) for name in missing}

    try:
        arrays = cached_arrays(
            sources, f"regions {_CACHE_VERSION} {MIN_MAP_SIDE} {head.name}", missing, make_region_maps
        )
    except DermisError:  # a different head with the name of a known one
        return head
    changed: dict[str, Any] = dict(arrays)
    return replace(head, maps=replace(head.maps, **changed))
