"""Maps of roughness and strength by region of the face, for heads given or loaded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.base.disk import Array, Arrays, cached_arrays
from dermis.base.errors import DermisError
from dermis.base.progress import logged_step
from dermis.human.regions.labels import known_landmarks, label_texels
from dermis.human.regions.region_table import DEFAULT_TABLE, LIMITS, Doubles, RegionTable, load_region_table
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

Floats = NDArray[np.float32]

SIZE = 1024
"""Side of the maps in texels; maps of the head that are larger keep their size."""
EDGE_MM = 2.5
"""Borders between regions are blurred: standard deviation [mm]."""
_DETAIL_MM = 6.0  # what is finer stays in the head's own maps; what is coarser comes from the table
_MIN_LOCAL_MEAN, _MAX_DETAIL = (
    0.4,
    3.0,
)  # of the mean and of the surroundings: else specks in black would glare
_CELL_MM = 2.0
_MAX_CELLS = 256  # along the longest side
_TRUNCATE = 3  # standard deviations
_CACHE_VERSION = 2  # increment when `with_regions` gives other maps for the same head


def with_regions(head: Head, table: RegionTable | str | Path = DEFAULT_TABLE) -> tuple[Head, float]:
    """The head with roughness and specular maps by region of the face, and the mean rho_s of its skin [-].

    table : what `load_region_table` gives or takes

    The specular map holds rho_s itself; to scale maps to a mean, take the one returned. Pores and blotches of
    the head's own two maps stay, as a factor of their surroundings.

    Raises DermisError when the head's regions are not known, and for invalid tables.
    """
    if not isinstance(table, RegionTable):
        table = load_region_table(table)
    atlas = build_atlas(head.mesh, SIZE)
    points = atlas.interpolate(head.mesh, head.mesh.positions)[atlas.coverage]
    smoothed = gaussian_mean(points, table.values[label_texels(head, atlas, table)], EDGE_MM)
    own_maps = (head.maps.roughness, head.maps.specular)
    roughness, specular = (
        np.clip(_region_map(atlas, points, smoothed[:, k], own_maps[k]), *limits)
        for k, limits in enumerate(LIMITS.values())
    )
    y, x = np.nonzero(atlas.coverage)
    height, width = specular.shape
    mean = float(specular[y * height // SIZE, x * width // SIZE].mean())
    return replace(head, maps=replace(head.maps, roughness=roughness, specular=specular)), mean


def _region_map(
    atlas: Atlas, points: NDArray[np.float64], level: NDArray[np.float64], own_maps: Floats | None
) -> Floats:
    """(h, w) picture of the levels (n,) of the covered texels, times the fine detail of the own map."""
    if own_maps is None:
        return _picture(atlas, level)
    y, x = np.nonzero(atlas.coverage)
    height, width = own_maps.shape
    values = own_maps[y * height // SIZE, x * width // SIZE].astype(np.float64)
    local_mean = np.maximum(
        gaussian_mean(points, values[:, None], _DETAIL_MM)[:, 0], _MIN_LOCAL_MEAN * values.mean()
    )
    local_mean = np.maximum(local_mean, np.finfo(np.float32).eps)
    shape = max(height, SIZE), max(width, SIZE)
    detail = np.minimum(_resized(own_maps, shape) / _resized(_picture(atlas, local_mean), shape), _MAX_DETAIL)
    return np.asarray(detail * _resized(_picture(atlas, level), shape))


def _picture(atlas: Atlas, values: NDArray[np.float64]) -> Floats:
    """(SIZE, SIZE) values (n,) of the covered texels; empty ones take the nearest."""
    from scipy.ndimage import distance_transform_edt

    picture = np.zeros(atlas.coverage.shape, np.float32)
    picture[atlas.coverage] = values
    y, x = distance_transform_edt(~atlas.coverage, return_distances=False, return_indices=True)
    return np.asarray(picture[y, x])


def _resized(picture: Floats, shape: tuple[int, int]) -> Floats:
    from scipy.ndimage import zoom

    if picture.shape == shape:
        return picture
    factors = shape[0] / picture.shape[0], shape[1] / picture.shape[1]
    return np.asarray(zoom(picture, factors, order=1, mode="nearest", grid_mode=True), np.float32)


def gaussian_mean(points: Doubles, values: Doubles, sigma_mm: float) -> Doubles:
    """Gaussian mean (n, c) of the values around each place, by distance in space: seams do not show.

    points : (n, 3) [mm]
    values : (n, c)
    sigma_mm : standard deviation [mm]
    """
    from scipy.ndimage import gaussian_filter, map_coordinates

    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    side = max(_CELL_MM, float(extent.max()) / _MAX_CELLS)
    place = (points - low) / side + 1
    shape = tuple(int(length) + 4 for length in extent / side)
    cell = np.ravel_multi_index(tuple(np.rint(place).astype(int).T), shape)
    count = np.bincount(cell, minlength=int(np.prod(shape)))

    def blur(quantity: Doubles) -> Doubles:
        grid = np.divide(quantity, count, out=np.zeros(len(count)), where=count > 0).reshape(shape)
        smooth = gaussian_filter(grid, sigma_mm / side, mode="constant", truncate=_TRUNCATE)
        return np.asarray(map_coordinates(smooth, place.T, order=1))

    weight = blur(count.astype(np.float64))
    sums = [np.bincount(cell, column, minlength=len(count)).astype(np.float64) for column in values.T]
    return np.stack([blur(column) / weight for column in sums], axis=-1)


@logged_step("finding the regions of the face")
def with_default_regions(head: Head) -> Head:
    """The head with the package's table by region, where it knows the regions and no map says the roughness.

    Strengths are relative to each other: a skin's rho_s is their mean, as of every map. A map of the head's
    own stays: it knows the person, and the table is an artist's.
    """
    if head.maps.rough or known_landmarks(head) is None:
        return head
    table = load_region_table(DEFAULT_TABLE)
    missing = ["roughness"] if head.maps.specular is not None else ["roughness", "specular"]
    sources: list[Array] = [head.mesh.positions, head.mesh.uv, head.mesh.triangles, table.values]

    def make() -> Arrays:
        maps = with_regions(replace(head, maps=Maps()), table)[0].maps
        return {name: np.asarray(getattr(maps, name), np.float32) for name in missing}

    try:
        found = cached_arrays(sources, f"regions {_CACHE_VERSION} {SIZE} {head.name}", missing, make)
    except DermisError:  # of a known name, but another head
        return head
    return replace(head, maps=replace(head.maps, **found))
