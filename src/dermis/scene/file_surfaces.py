"""Maps and materials of heads from mesh files, made from the pictures of each material."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dermis.atlas.texture_baking import PackedTextures, pack_textures, read_linear_picture
from dermis.atlas.texture_tiles import UV_TOLERANCE
from dermis.atlas.unwrap.missing_uv import unwrap_triangles
from dermis.base.arrays import Floats, Mask
from dermis.formats.load import FileSurfaceData, RiggedMesh
from dermis.formats.materials import IDENTITY_UV_TRANSFORM, FileMaterial, Role
from dermis.mesh.maps import Maps, PartMaps
from dermis.mesh.mesh import Material, Mesh

_SURFACE_ROLES: tuple[Role, ...] = ("normal", "roughness", "metalness")


def with_generated_uv(rigged: RiggedMesh) -> RiggedMesh:
    """Return a mesh with new uv for skin groups that have none, and with a note that names these groups."""
    mesh, surface = rigged.mesh, rigged.surface
    bare = np.array(
        [own.kind == "skin" and not has for own, has in zip(mesh.materials, surface.has_uv, strict=True)]
    )
    if not bare.any():
        return rigged
    laid_out, vertex = unwrap_triangles(mesh, bare[mesh.material])
    changed = surface._replace(
        colours=None if surface.colours is None else surface.colours[vertex],
        other_uv={index: uv[vertex] for index, uv in surface.other_uv.items()},
    )
    names = ", ".join(repr(own.name) for own, without in zip(mesh.materials, bare, strict=True) if without)
    note = f"{names} has no uv; the package lays it out"
    return rigged._replace(mesh=laid_out, notes=(*rigged.notes, note), surface=changed)


def unpacked_skin_material(rigged: RiggedMesh, materials: Sequence[FileMaterial]) -> FileMaterial | None:
    """Return the only skin material of a file if its pictures can be used unchanged as skin maps.

    Otherwise, the result is None, and the pictures of the skin materials must be packed into common maps.

    rigged : mesh of the file
    materials : materials of the file
    """
    mesh, surface = rigged.mesh, rigged.surface
    skin = _materials_of_kind(mesh, "skin")
    used = {index for index, is_skin in zip(surface.in_file, skin, strict=True) if is_skin}
    if len(used) != 1:
        return None
    index = used.pop()
    material = materials[index] if index >= 0 else FileMaterial()
    if material.maps is not None:
        return material
    uv = mesh.uv[np.unique(mesh.triangles[skin[mesh.material]])]
    inside = uv.min() > -UV_TOLERANCE and uv.max() < 1.0 + UV_TOLERANCE
    plain = all(texture.uv_mapping == (0, IDENTITY_UV_TRANSFORM) for texture in material.textures.values())
    return material if inside and plain and not _has_colours(mesh, surface, skin) else None


def with_material_factors(maps: Maps, material: FileMaterial, user_roles: Collection[str]) -> Maps:
    """Return the maps of a skin material, multiplied by the factors of the material in the file.

    Files store the square root of the Beckmann roughness m. The product of the roughness map and the
    roughness factor is therefore squared.

    user_roles : roles, such as "colour", of maps that the user replaces; these maps are not multiplied
    """
    changed: dict[str, Any] = {}
    if (
        material.maps is None
        and "colour" not in user_roles
        and material.colour not in (None, (1.0, 1.0, 1.0))
    ):
        white = np.ones((1, 1, 3), np.float32)
        changed["colour"] = (white if maps.colour is None else maps.colour) * np.array(
            material.colour, np.float32
        )
    if maps.normal is not None and "normal" not in user_roles and material.normal_scale != 1.0:
        changed["normal"] = maps.normal * np.float32(material.normal_scale)
    is_stored = material.maps is not None and "roughness" in material.maps
    if not is_stored and "roughness" not in user_roles and "roughness" in material.textures:
        values = read_linear_picture(material.textures["roughness"], "roughness")[..., 0]
        changed["roughness"] = (values * np.float32(material.roughness)) ** 2
    return replace(maps, **changed)


def _materials_of_kind(mesh: Mesh, material_kind: str) -> Mask:
    """Return a mask (m,) of the materials of a mesh that have a kind, such as "skin"."""
    return np.array([material.kind == material_kind for material in mesh.materials])


def _has_colours(mesh: Mesh, surface: FileSurfaceData, material_mask: Mask) -> bool:
    """Return whether any vertex of selected materials has a colour other than white.

    surface : surface data of the file, with vertex colours from 0 to 1 if the file has them
    material_mask : (m,) mask of the selected materials
    """
    if surface.colours is None:
        return False
    return bool((surface.colours[np.unique(mesh.triangles[material_mask[mesh.material]])] < 1.0).any())


def with_file_textures(
    rigged: RiggedMesh, materials: Sequence[FileMaterial], pack_skin: bool
) -> tuple[Mesh, Maps, tuple[str, ...]]:
    """Pack pictures of materials into common maps; return the mesh, the maps and notes for the user.

    The uv of the returned mesh refer to the common maps. The notes say which detail was lost.

    rigged : mesh of the file
    materials : materials of the file
    pack_skin : whether pictures of the skin are packed too; False if `unpacked_skin_material` returns a
        material
    """
    mesh, maps, notes = rigged.mesh, Maps(), list[str]()
    if pack_skin:
        packed_textures = pack_textures(mesh, rigged.surface, materials, _materials_of_kind(mesh, "skin"))
        mesh, maps = _with_uv(mesh, packed_textures), _skin_maps(packed_textures)
        notes += [f"skin: {note}" for note in packed_textures.notes]
    pictured = _pictured_material_mask(mesh, rigged.surface, materials)
    if pictured.any():
        packed_textures = pack_textures(
            mesh, rigged.surface, materials, pictured, ("colour", *_SURFACE_ROLES)
        )
        mesh, maps = _with_uv(mesh, packed_textures), replace(maps, parts=_part_maps(packed_textures))
        notes += [f"parts that are not skin: {note}" for note in packed_textures.notes]
    changed = [
        _with_surface(material, materials[index] if index >= 0 else None, has_maps)
        for material, index, has_maps in zip(mesh.materials, rigged.surface.in_file, pictured, strict=True)
    ]
    if maps.parts is not None:
        changed = _with_mean_colours(mesh, changed, maps.parts)
    return _with_cached_outline(mesh, replace(mesh, materials=tuple(changed))), maps, tuple(notes)


def _with_mean_colours(mesh: Mesh, materials: list[Material], maps: PartMaps) -> list[Material]:
    """Return the materials; each one with maps gets, as uniform colour, the mean colour of its map texels."""
    size = np.array(maps.colour.shape[1::-1])
    coloured = []
    for index, material in enumerate(materials):
        if material.has_maps:
            middle = mesh.uv[mesh.triangles[mesh.material == index]].mean(axis=1)
            x, y = np.clip(middle * size, 0, size - 1).astype(int).T
            red, green, blue = (float(one) for one in maps.colour[y, x, :3].mean(axis=0))
            material = replace(material, colour=(red, green, blue))
        coloured.append(material)
    return coloured


def _pictured_material_mask(mesh: Mesh, surface: FileSurfaceData, materials: Sequence[FileMaterial]) -> Mask:
    """Return the mask (m,) of opaque materials with pictures or vertex colours."""
    opaque = _materials_of_kind(mesh, "opaque")
    if any(one.maps is not None for one in materials):  # this package wrote the file; eyes are fitted again
        opaque &= ~np.array([one.eye for one in mesh.materials])
    pictured = np.zeros_like(opaque)
    for index in np.flatnonzero(opaque):
        selected, in_file = np.arange(len(opaque)) == index, surface.in_file[index]
        has_pictures = in_file >= 0 and bool(materials[in_file].textures) and surface.has_uv[index]
        pictured[index] = has_pictures or _has_colours(mesh, surface, selected)
    return pictured


def _with_uv(mesh: Mesh, packed_textures: PackedTextures) -> Mesh:
    uv = mesh.uv.copy()
    uv[packed_textures.vertices] = packed_textures.uv
    return _with_cached_outline(mesh, replace(mesh, uv=uv))


def _with_cached_outline(mesh: Mesh, changed_mesh: Mesh) -> Mesh:
    """Copy the convex hull of a mesh, which is slow to compute, to a changed mesh of equal shape.

    changed_mesh : copy of `mesh` with changed uv or materials; it is also the returned mesh
    """
    vars(changed_mesh)["outline"] = mesh.outline
    return changed_mesh


def _skin_maps(packed_textures: PackedTextures) -> Maps:
    maps = packed_textures.maps
    roughness = maps.get("roughness")
    return Maps(
        colour=np.ascontiguousarray(maps["colour"][..., :3]),
        normal=maps.get("normal"),
        roughness=None if roughness is None else roughness[..., 0] ** 2,
    )


def _part_maps(packed_textures: PackedTextures) -> PartMaps:
    maps = packed_textures.maps
    surface = np.concatenate([maps[role] for role in _SURFACE_ROLES], axis=2)
    return PartMaps(maps["colour"], surface, _emission_if_any(maps.get("emission")))


def _emission_if_any(emission_texels: Floats | None) -> Floats | None:
    return emission_texels if emission_texels is not None and emission_texels.any() else None


def _with_surface(material: Material, file_material: FileMaterial | None, has_maps: bool) -> Material:
    """Return a material with the surface properties that the file states; skin materials are not changed.

    material : material of the mesh, which is returned with changes
    file_material : material in the file; None if the file has no material
    has_maps : whether the common maps contain the pictures of this material, see `Material`
    """
    if material.kind == "skin":
        return material
    if file_material is None:
        return replace(material, has_maps=has_maps)
    return replace(
        material,
        has_maps=has_maps,
        roughness=file_material.roughness,
        metalness=file_material.metalness,
        emission=file_material.emission,
        opacity_cutoff=0.0 if file_material.alpha_mode == "opaque" else file_material.opacity_cutoff,
    )


def unused_properties(
    mesh: Mesh,
    materials: Sequence[FileMaterial],
    file_material_index: Sequence[int],
    user_roles: Collection[str],
    skin_is_packed: bool,
) -> str:
    """Return a note on properties of a file's materials that are not drawn; empty if all are drawn.

    mesh : mesh with m materials
    materials : materials of the file
    file_material_index : (m,) index in `materials` of each material of the mesh, or -1 if the file lacks the
        material
    user_roles : roles, such as "colour", of skin maps that the user replaces
    skin_is_packed : whether pictures of the skin materials are packed into common maps
    """
    if any(one.maps is not None for one in materials):  # this package wrote the file
        return ""
    lines = dict[str, None]()
    for material, index in zip(mesh.materials, file_material_index, strict=True):
        file_material, is_skin = materials[index] if index >= 0 else FileMaterial(), material.kind == "skin"
        unused = list(file_material.unused)
        unused += [
            text for role, text in file_material.missing.items() if not (is_skin and role in user_roles)
        ]
        if is_skin and file_material.maps is None:
            unused += _properties_replaced_by_skin(file_material)
        if not is_skin or skin_is_packed:
            unused += file_material.skin_only
        if unused:
            lines[f"{file_material.name or material.name!r}: {', '.join(dict.fromkeys(unused))}"] = None
    return "\n  ".join(["not drawn, or replaced by the properties of skin:", *lines]) if lines else ""


def _properties_replaced_by_skin(material: FileMaterial) -> list[str]:
    """Return the names of a file material's properties that the skin settings replace."""
    replaced = []
    if "roughness" not in material.textures and material.roughness not in (None, 1.0):
        replaced.append(f"roughness {material.roughness:g}")
    if material.stated_metalness or "metalness" in material.textures:
        replaced.append("metalness")
    if max(material.emission) > 0.0 or "emission" in material.textures:
        replaced.append(f"emission {max(material.emission):g}")
    if material.alpha_mode != "opaque":
        replaced.append(f"opacity ({material.alpha_mode})")
    return replaced
