"""One uv layout for several materials: a shared map is divided into tiles, one for each material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Mask
from dermis.formats.load import FileSurfaceData
from dermis.formats.maps import MAX_MAP_SIDE
from dermis.formats.materials import FileMaterial, Texture
from dermis.images.io import read_size
from dermis.mesh.geometry import label_components, triangle_areas
from dermis.mesh.mesh import Mesh

UV_TOLERANCE = 2e-2
"""Largest distance of uv from [0, 1] that counts as an inaccuracy, not as repetition of the picture [-]."""
TILE_PADDING_TEXELS = 8
"""Texels around each tile that continue its border, so that mip levels do not mix materials."""
_UNTEXTURED_TILE_SIDE = 16  # side of a tile without pictures that is not skin [texel]
_MIN_SKIN_TILE_SIDE = 256  # smallest side of a tile of skin without pictures [texel]
_MAP_SIDE_GROWTH_FACTOR = 1.02  # step by which the side of the map grows until all tiles fit


@dataclass(frozen=True, eq=False)
class Tile:
    """Rectangle of the shared map that shows one material of the mesh.

    material : index of the file's material, -1 if there is none
    vertices : (n,) indices of the tile's vertices in the mesh
    triangles : indices of the tile's triangles in the mesh
    uv : (n, 2) positions of the vertices in the material's pictures, v down
    low, high : (2,) upper left and lower right corner of the part of the pictures that the tile shows
    size : width and height [texel]
    corner : column and row of the tile's upper left texel in the map, excluding the padding around the tile
    """

    material: int
    vertices: NDArray[np.integer]
    triangles: NDArray[np.integer]
    uv: Doubles
    low: Doubles
    high: Doubles
    size: tuple[int, int]
    corner: tuple[int, int] = (0, 0)

    def layout_uv(self, map_side: int) -> Doubles:
        """Return the uv (n, 2) of the tile's vertices in the shared map.

        map_side : side of the map [texel]
        """
        fraction = (self.uv - self.low) / np.maximum(self.high - self.low, 1e-12)
        return np.asarray((np.array(self.corner) + fraction * self.size) / map_side)


def base_texture(material: FileMaterial) -> Texture | None:
    """Return the texture that determines the uv mapping of a material's tile; None without textures.

    This is the colour texture of the material or, if there is none, its first texture.
    """
    return material.textures.get("colour") or next(iter(material.textures.values()), None)


def file_uv(mesh: Mesh, surface: FileSurfaceData, uv_set: int, vertices: NDArray[np.integer]) -> Doubles:
    """Return the uv coordinates (n, 2) of vertices in one of the file's uv sets, with v down.

    uv_set : index of the uv set; set 0 is the mesh's own uv
    """
    uv: Floats = mesh.uv if uv_set == 0 else surface.other_uv[uv_set]
    return np.asarray(uv[vertices], np.float64)


def lay_out_tiles(
    mesh: Mesh, surface: FileSurfaceData, materials: Sequence[FileMaterial], material_mask: Mask
) -> tuple[list[Tile], int, float]:
    """Return tiles for selected materials, the side of the shared map [texel], and a scale factor.

    The factor is at most 1; all pictures are scaled by it to fit into the map.

    surface : surface data of the file that the mesh comes from
    material_mask : (m,) mask of the mesh's materials that share the map
    """
    of_file = np.array(surface.in_file)[mesh.material]
    member = material_mask[mesh.material]
    tiles = []
    for index in np.unique(of_file[member]).tolist():
        triangles = np.flatnonzero(member & (of_file == index))
        tiles.append(
            _unplaced_tile(
                mesh, surface, materials[index] if index >= 0 else FileMaterial(), index, triangles
            )
        )
    tiles = _set_sizes_without_pictures(mesh, tiles, materials)
    return _pack_tiles(tiles)


def _unplaced_tile(
    mesh: Mesh,
    surface: FileSurfaceData,
    material: FileMaterial,
    material_index: int,
    triangles: NDArray[np.integer],
) -> Tile:
    vertices = np.unique(mesh.triangles[triangles])
    texture = base_texture(material)
    uv = file_uv(mesh, surface, texture.uv_set if texture else 0, vertices)
    if texture:
        uv = _shift_charts_to_unit_square(mesh, texture, texture.map_uv(uv), vertices, triangles)
    low, high = uv.min(axis=0), uv.max(axis=0)
    inside = (low > -UV_TOLERANCE) & (high < 1.0 + UV_TOLERANCE)
    low, high = np.where(inside, np.minimum(low, 0.0), low), np.where(inside, np.maximum(high, 1.0), high)
    width, height = _picture_size(material)
    size = (max(1, round(width * (high[0] - low[0]))), max(1, round(height * (high[1] - low[1]))))
    return Tile(material_index, vertices, triangles, uv, low, high, size if width else (0, 0))


def _picture_size(material: FileMaterial) -> tuple[int, int]:
    """Return the largest width and height of a material's pictures; 0 for a material without pictures."""
    sizes = [read_size(texture.picture) for texture in material.textures.values()]
    return max((width for width, _ in sizes), default=0), max((height for _, height in sizes), default=0)


def _shift_charts_to_unit_square(
    mesh: Mesh, texture: Texture, uv: Doubles, vertices: NDArray[np.integer], triangles: NDArray[np.integer]
) -> Doubles:
    """Return uv (n, 2) in which each chart of a repeating texture is shifted by whole periods.

    The shift brings the middle of the chart into the first period: 0 to 1, or 0 to 2 for a mirrored texture.

    uv : (n, 2) uv of the vertices
    vertices : (n,) sorted indices of the mesh vertices that the texture covers
    triangles : indices of the triangles that the texture covers
    """
    if uv.min() > -UV_TOLERANCE and uv.max() < 1.0 + UV_TOLERANCE:
        return uv
    corner = np.searchsorted(vertices, mesh.triangles[triangles])
    chart = label_components(len(vertices), corner[:, :2].ravel(), corner[:, 1:].ravel())
    count = int(chart.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, chart, uv)
    np.maximum.at(high, chart, uv)
    period = np.array([{"repeat": 1.0, "mirror": 2.0, "clamp": 0.0}[wrap] for wrap in texture.wrap])
    middle = (low + high)[chart] / 2.0
    return np.asarray(uv - period * np.floor(middle / np.where(period > 0, period, 1.0)))


def _set_sizes_without_pictures(
    mesh: Mesh, tiles: list[Tile], materials: Sequence[FileMaterial]
) -> list[Tile]:
    """Return the tiles, with sizes also for tiles without pictures.

    Skin gets the median texel density of the tiles with pictures; other materials get a small fixed size.
    """
    areas = [float(triangle_areas(mesh.positions[mesh.triangles[tile.triangles]]).sum()) for tile in tiles]
    density = [tile.size[0] * tile.size[1] / max(mm2, 1e-9) for tile, mm2 in zip(tiles, areas, strict=True)]
    median_density = float(np.median([value for value in density if value > 0] or [0.0]))
    sized_tiles = []
    for tile, mm2 in zip(tiles, areas, strict=True):
        if tile.size == (0, 0):
            is_skin = mesh.materials[int(mesh.material[tile.triangles[0]])].kind == "skin"
            side = (
                max(_MIN_SKIN_TILE_SIDE, round(float(np.sqrt(median_density * mm2))))
                if is_skin
                else _UNTEXTURED_TILE_SIDE
            )
            tile = Tile(
                tile.material, tile.vertices, tile.triangles, tile.uv, tile.low, tile.high, (side, side)
            )
        sized_tiles.append(tile)
    return sized_tiles


def _pack_tiles(tiles: list[Tile]) -> tuple[list[Tile], int, float]:
    """Pack tiles; return the tiles with positions, the side of the map, and the scale at which tiles fit."""
    scale = 1.0
    while True:
        sizes = [tuple(max(1, round(scale * length)) for length in tile.size) for tile in tiles]
        side, corners = _pack_in_rows(sizes)
        if side <= MAX_MAP_SIDE:
            break
        scale *= 0.98 * MAX_MAP_SIDE / side
    placed = [
        Tile(t.material, t.vertices, t.triangles, t.uv, t.low, t.high, (w, h), corner)
        for t, (w, h), corner in zip(tiles, sizes, corners, strict=True)
    ]
    return placed, side, scale


def _pack_in_rows(tile_sizes: Sequence[tuple[int, ...]]) -> tuple[int, list[tuple[int, int]]]:
    """Pack rectangles in rows; return the side of a square that holds them, and their upper left corners."""
    padded = np.array(tile_sizes) + 2 * TILE_PADDING_TEXELS
    order = np.argsort(-padded[:, 1], kind="stable")
    side = float(max(padded.max(), np.sqrt(padded.prod(axis=1).sum())))
    while True:
        corners, x, y, shelf = np.zeros_like(padded), 0, 0, 0
        for index in order:
            width, height = padded[index]
            if x + width > side:
                x, y, shelf = 0, y + shelf, 0
            corners[index] = x, y
            x, shelf = x + width, max(shelf, height)
        if y + shelf <= side:
            return int(np.ceil(side)), [
                (int(x) + TILE_PADDING_TEXELS, int(y) + TILE_PADDING_TEXELS) for x, y in corners
            ]
        side *= _MAP_SIDE_GROWTH_FACTOR
