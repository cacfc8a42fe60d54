"""Texture maps shared by several materials, baked from their pictures, factors and vertex colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dermis.atlas.raster import covered_texels
from dermis.atlas.texture_tiles import TILE_PADDING_TEXELS, Tile, base_texture, file_uv, lay_out_tiles
from dermis.base.arrays import Doubles, Floats, Mask, Numbers
from dermis.formats.load import FileSurfaceData
from dermis.formats.maps import colour_map, slope_map
from dermis.formats.materials import FileMaterial, Role, Texture, Wrap
from dermis.formats.parts import DEFAULT_COLOUR
from dermis.images.filters import mip_chain
from dermis.images.io import read_image
from dermis.mesh.mesh import Mesh

_TEXELS_PER_STRIP = 1 << 22  # texels that are sampled at a time, to limit memory
_ROLE_DEFAULTS: Mapping[Role, tuple[float, ...]] = {
    "colour": (1.0, 1.0, 1.0),
    "normal": (0.0, 0.0),
    "roughness": (1.0,),
    "metalness": (1.0,),
    "emission": (1.0, 1.0, 1.0),
}
"""Value of each role for a material without a picture; the material's factor multiplies it."""


@dataclass(frozen=True, eq=False)
class PackedTextures:
    """Uv layout and texture maps that several materials share.

    vertices : (n,) vertex indices in the mesh
    uv : (n, 2) uv of these vertices in the shared maps
    maps : dictionary from map roles, such as "colour", to the shared maps (side, side, k); these contain the
        pictures, multiplied by the factors of their materials
    notes : sentences that tell users which detail was lost
    """

    vertices: Numbers
    uv: Floats
    maps: Mapping[str, Floats]
    notes: tuple[str, ...] = ()


def pack_textures(
    mesh: Mesh,
    surface: FileSurfaceData,
    materials: Sequence[FileMaterial],
    material_mask: Mask,
    required_roles: Sequence[Role] = ("colour",),
) -> PackedTextures:
    """Bake one uv layout and one set of texture maps for selected materials of a mesh.

    surface : surface data of the mesh's file
    materials : materials of the mesh's file
    material_mask : (m,) mask of the mesh's materials that share the maps
    required_roles : map roles, such as "colour", that get a map even if no material has a picture for them
    """
    tiles, side, scale = lay_out_tiles(mesh, surface, materials, material_mask)
    baker = _Baker(mesh, surface, materials, tiles, side)
    notes = (f"its pictures are reduced to {scale:.0%} of their size to fit one map",) if scale < 0.99 else ()
    return PackedTextures(
        np.concatenate([tile.vertices for tile in tiles]),
        np.concatenate([tile.layout_uv(side) for tile in tiles]).astype(np.float32),
        {role: baker.bake(role) for role in baker.roles(required_roles)},
        notes,
    )


@dataclass(frozen=True, eq=False)
class _Baker:
    """Baker of the shared texture maps of several materials, with one tile of the maps per material."""

    mesh: Mesh
    surface: FileSurfaceData
    materials: Sequence[FileMaterial]
    tiles: list[Tile]
    side: int

    def roles(self, required_roles: Sequence[Role]) -> list[Role]:
        """Return the map roles, such as "colour", that are required or that a material has a picture for."""
        used = {role for tile in self.tiles for role in self._tile_material(tile).textures}
        return [role for role in _ROLE_DEFAULTS if role in used or role in required_roles]

    def bake(self, role: Role) -> Floats:
        """Bake the shared map (side, side, k) of a map role, such as "colour"."""
        default = np.array(_ROLE_DEFAULTS[role], np.float32)
        channels = len(default) + (role == "colour")  # opacity
        baked = np.zeros((self.side, self.side, channels), np.float32)
        for tile in self.tiles:
            values = self._tile_map(tile, role)
            padded = np.pad(
                values,
                (
                    (TILE_PADDING_TEXELS, TILE_PADDING_TEXELS),
                    (TILE_PADDING_TEXELS, TILE_PADDING_TEXELS),
                    (0, 0),
                ),
                mode="edge",
            )
            x, y = (corner - TILE_PADDING_TEXELS for corner in tile.corner)
            baked[y : y + padded.shape[0], x : x + padded.shape[1]] = padded
        return baked

    def _tile_material(self, tile: Tile) -> FileMaterial:
        return self.materials[tile.material] if tile.material >= 0 else FileMaterial()

    def _tile_map(self, tile: Tile, role: Role) -> Floats:
        """Return one tile (h, w, k) of a role's map: the material's picture multiplied by its factors."""
        material, (width, height) = self._tile_material(tile), tile.size
        texture = material.textures.get(role)
        factor = _material_factor(material, role, self.surface.colours is not None)
        if texture is None:
            default = np.array([*_ROLE_DEFAULTS[role], *((1.0,) if role == "colour" else ())], np.float32)
            values = np.broadcast_to(default, (height, width, len(default))).copy()
        else:
            values = self._sample_picture(tile, texture, role)
        values *= factor
        if role == "colour":
            self._finish_colour_map(tile, values)
        return values

    def _finish_colour_map(self, tile: Tile, colour_map: Floats) -> None:
        """Apply vertex colours and the opacity texture to the colours of a tile, in place.

        colour_map : (h, w, 4) colour and opacity; opacity is shifted so that the alpha cutoff becomes 0.5
        """
        material = self._tile_material(tile)
        if "opacity" in material.textures:
            colour_map[..., 3:] *= self._sample_picture(tile, material.textures["opacity"], "opacity")
        is_opaque = material.alpha_mode == "opaque"
        colour_map[..., 3] = 1.0 if is_opaque else colour_map[..., 3] + 0.5 - material.opacity_cutoff
        if self.surface.colours is not None:
            colour_map[..., :3] *= self._interpolate_to_texels(tile, self.surface.colours[tile.vertices])

    def _sample_picture(self, tile: Tile, texture: Texture, role: Role) -> Floats:
        """Return a picture resampled to the texels of a tile, (h, w, k).

        texture : texture with the picture
        role : map role of the texture, such as "colour"
        """
        picture = read_linear_picture(texture, role)
        base = base_texture(self._tile_material(tile))
        if base is not None and base.uv_mapping == texture.uv_mapping:
            (width, height), span = tile.size, tile.high - tile.low
            u = tile.low[0] + (np.arange(width) + 0.5) / width * span[0]
            v = tile.low[1] + (np.arange(height) + 0.5) / height * span[1]
            return sample_grid(picture, u, v, texture.wrap)
        vertex_uv = texture.map_uv(file_uv(self.mesh, self.surface, texture.uv_set, tile.vertices))
        position = self._interpolate_to_texels(tile, vertex_uv)
        return sample_points(picture, position, texture.wrap)

    def _interpolate_to_texels(self, tile: Tile, vertex_values: Numbers) -> Floats:
        """Interpolate values (n, k) at a tile's vertices to its texels (h, w, k).

        Texels outside all triangles get the value of the nearest texel inside a triangle.
        """
        from scipy.ndimage import distance_transform_edt

        width, height = tile.size
        corner = np.searchsorted(tile.vertices, self.mesh.triangles[tile.triangles])
        place = (tile.layout_uv(self.side) * self.side - tile.corner)[corner] - 0.5
        texel, which = covered_texels(place, (height, width))
        y, x = np.divmod(texel, width)
        weights = _barycentric_coordinates(place[which], np.stack([x, y], axis=1).astype(np.float64))
        baked = np.zeros((height * width, vertex_values.shape[1]), np.float32)
        baked[texel] = np.einsum("nk,nkc->nc", weights, np.asarray(vertex_values, np.float64)[corner[which]])
        if len(texel) == 0:
            return np.broadcast_to(
                vertex_values.mean(axis=0), (height, width, vertex_values.shape[1])
            ).astype(np.float32)
        uncovered = np.ones(height * width, bool)
        uncovered[texel] = False
        near = distance_transform_edt(
            uncovered.reshape(height, width), return_distances=False, return_indices=True
        )
        return np.asarray(baked.reshape(height, width, -1)[tuple(near)])


def _barycentric_coordinates(corners: Doubles, points: Doubles) -> Doubles:
    """Return the barycentric coordinates (n, 3) of points (n, 2) in triangles (n, 3, 2)."""
    a, b, c = corners.transpose(1, 0, 2)
    (bx, by), (cx, cy), (px, py) = (b - a).T, (c - a).T, (points - a).T
    area = bx * cy - by * cx
    area = np.where(area == 0.0, 1.0, area)
    second, third = (px * cy - py * cx) / area, (bx * py - by * px) / area
    return np.asarray(np.clip(np.stack([1.0 - second - third, second, third], axis=1), 0.0, 1.0))


def _material_factor(material: FileMaterial, role: Role, has_vertex_colours: bool) -> Floats:
    """Return the factor (k,) by which a material multiplies its picture for a map role, such as "colour".

    has_vertex_colours : whether the mesh has vertex colours; if so, a material without a colour has the
        factor 1 instead of the default colour, so that the vertex colours are not changed
    """
    has_colour = has_vertex_colours or "colour" in material.textures
    colour = material.colour or ((1.0, 1.0, 1.0) if has_colour else DEFAULT_COLOUR)
    factors: dict[Role, Sequence[float]] = {
        "colour": (*colour, material.alpha),
        "normal": (material.normal_scale, material.normal_scale),
        "roughness": (1.0 if material.roughness is None else material.roughness,),
        "metalness": (material.metalness,),
        "emission": material.emission,
    }
    return np.array(factors[role], np.float32)


def read_linear_picture(texture: Texture, role: Role) -> Floats:
    """Return a texture's picture as linear values (H, W, k), converted for a map role such as "normal"."""
    if role == "normal":
        return slope_map(texture.picture, "up")
    if role in ("colour", "emission"):
        colours = colour_map(texture.picture)
        if role == "emission":
            return colours
        image = read_image(texture.picture)
        opaque = np.ones((*colours.shape[:2], 1), np.float32)
        opacity = _scale_to_unit_range(image[..., 3:]) if image.shape[2] == 4 else opaque
        return np.concatenate([colours, opacity], axis=2)
    image = read_image(texture.picture)
    last = image.shape[2] - 1
    channel = last if role == "opacity" and last == 3 else min(texture.channel or 0, last)
    return _scale_to_unit_range(image[..., channel : channel + 1])


def _scale_to_unit_range(image: Numbers) -> Floats:
    if image.dtype == np.float32:
        return np.asarray(np.clip(image, 0.0, 1.0), np.float32)
    return np.asarray(image / np.float32(np.iinfo(image.dtype.str).max), np.float32)


def sample_grid(picture: Floats, u: Doubles, v: Doubles, wrap: tuple[Wrap, Wrap]) -> Floats:
    """Return samples (h, w, k) of a picture with mip filtering, on a grid of positions u (w,) and v (h,).

    wrap : wrap modes along u and v, such as "repeat"
    """
    step = (
        max(abs(float(u[-1] - u[0])) / max(len(u) - 1, 1), 1e-9),
        max(abs(float(v[-1] - v[0])) / max(len(v) - 1, 1), 1e-9),
    )
    picture = _matching_mip(picture, min(step[0] * picture.shape[1], step[1] * picture.shape[0]))
    left, right, across = _neighbour_texels(u, picture.shape[1], wrap[0])
    top, bottom, down = _neighbour_texels(v, picture.shape[0], wrap[1])
    if not across.any() and not down.any():
        return np.asarray(picture[top[:, None], left[None, :]])
    sampled = np.empty((len(v), len(u), picture.shape[2]), np.float32)
    rows = max(1, _TEXELS_PER_STRIP // max(len(u), 1))
    weight = across[None, :, None].astype(np.float32)
    for start in range(0, len(v), rows):
        strip = slice(start, start + rows)
        upper, lower = (
            picture[line[strip, None], left] * (1 - weight) + picture[line[strip, None], right] * weight
            for line in (top, bottom)
        )
        blend = down[strip, None, None].astype(np.float32)
        sampled[strip] = upper * (1 - blend) + lower * blend
    return sampled


def sample_points(picture: Floats, uv_positions: Floats, wrap: tuple[Wrap, Wrap]) -> Floats:
    """Return bilinear samples (..., k) of a picture at positions (..., 2) in [0, 1].

    wrap : wrap modes along u and v, such as "repeat"
    """
    left, right, across = _neighbour_texels(
        uv_positions[..., 0].astype(np.float64), picture.shape[1], wrap[0]
    )
    top, bottom, down = _neighbour_texels(uv_positions[..., 1].astype(np.float64), picture.shape[0], wrap[1])
    x, y = across[..., None].astype(np.float32), down[..., None].astype(np.float32)
    upper = picture[top, left] * (1 - x) + picture[top, right] * x
    lower = picture[bottom, left] * (1 - x) + picture[bottom, right] * x
    return np.asarray(upper * (1 - y) + lower * y)


def _matching_mip(picture: Floats, texels_per_sample: float) -> Floats:
    """Return the mip level of a picture that has about one texel per sample."""
    level = int(np.floor(np.log2(max(texels_per_sample, 1.0)) + 0.1))
    return mip_chain(picture)[level] if level else picture


def _neighbour_texels(position: Doubles, texel_count: int, wrap: Wrap) -> tuple[Numbers, Numbers, Doubles]:
    """Return the two texels around each position in [0, 1] on an axis, and the second texel's weight.

    texel_count : number of texels along the axis
    wrap : wrap mode, such as "repeat", for texels beyond the ends of the axis
    """
    texel = position * texel_count - 0.5
    texel = np.where(np.abs(texel - np.rint(texel)) < 1e-6 * texel_count, np.rint(texel), texel)
    first = np.floor(texel)
    index = first.astype(np.int64)
    return _wrap_index(index, texel_count, wrap), _wrap_index(index + 1, texel_count, wrap), texel - first


def _wrap_index(texel_index: Numbers, texel_count: int, wrap: Wrap) -> Numbers:
    if wrap == "clamp":
        return np.clip(texel_index, 0, texel_count - 1)
    if wrap == "repeat":
        return texel_index % texel_count
    folded = texel_index % (2 * texel_count)
    return np.minimum(folded, 2 * texel_count - 1 - folded)
