"""Reading of OBJ files as mesh parts, and of the maps of their materials."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dermis.base.errors import DermisError, refuse
from dermis.base.reading import read_file, refuse_parse_errors
from dermis.formats import size_limits as limits
from dermis.formats.maps import check_finite, load_maps
from dermis.formats.obj_geometry import parse_geometry
from dermis.formats.obj_materials import MtlTexture, picture_file_name, read_library, with_materials
from dermis.formats.parts import DEFAULT_COLOUR, MaterialGroup, MeshFile, MeshPart
from dermis.formats.referenced_files import find_referenced_file
from dermis.formats.text_files import decode_text
from dermis.images.io import read_image, read_size
from dermis.images.sizes import MAX_TOTAL_PIXELS
from dermis.mesh.maps import Maps

_RELIEF_MAP_ROLES = ("normal", "height")
_GREY_TEST_TEXELS_PER_SIDE = 256  # compared texels along a side


def read_obj_text(path: Path) -> str:
    """Return the text of a .obj file, with line feeds as its only line ends.

    Raises DermisError when the file cannot be read or is too large.
    """
    data = read_file(path, "an OBJ file", limits.MAX_FILE_BYTES)
    with refuse_parse_errors(path, "an OBJ file"):
        return decode_text(data)


def read_obj(path: Path) -> MeshFile:
    """Read a .obj file; polygons with the same `usemtl` and the same `g` form one mesh part.

    The colour of a part is the value Kd of its material in the .mtl file, taken as linear.
    """
    return parse_obj(path, read_obj_text(path))


def parse_obj(path: Path, obj_text: str) -> MeshFile:
    """Parse the text of a .obj file; polygons with the same `usemtl` and the same `g` form one mesh part.

    path : path of the file, for errors and to find the .mtl file
    """
    geometry = parse_geometry(path, obj_text)
    library = read_library(path, geometry.statements)
    names = [tuple(dict.fromkeys(name for name in pair if name)) for pair in geometry.pairs]
    known = [library.materials.get(pair[0]) for pair in geometry.pairs]
    colours = [DEFAULT_COLOUR if own is None else own.colour or DEFAULT_COLOUR for own in known]
    groups = [MaterialGroup(name, colour) for name, colour in zip(names, colours, strict=True)]
    parts = geometry.polygons.mesh_parts(groups, geometry.pair, "by polygon")
    used, none = {part.group for part in parts}, np.empty((0, 3))
    empty = [MeshPart(g, none, None, None, none.astype(int)) for g in groups if g.names and g not in used]
    assigned, materials, notes = with_materials(path, [*parts, *empty], library)
    return MeshFile(assigned, materials=materials, notes=(*geometry.notes, *notes))


def obj_maps(
    path: Path,
    material_name: str,
    *,
    overridden_roles: Collection[str] = (),
    height_mm: float | None = None,
    normal_y: Literal["up", "down"] = "up",
) -> tuple[Maps, list[str]]:
    """Return the maps of the material of a skin, and notes for the user about maps that cannot be used.

    The skin must have a single material, and its pictures must have no uv transforms. The statements map_Kd,
    norm, map_Bump or bump, map_Ks and map_Pr are read. A bump map may contain normals, as many programs write
    them, or heights, which require `height_mm`. Normals and heights are scaled by the option -bm. map_Pr
    contains the square root of the roughness m.

    material_name : name of the material in the .mtl files
    overridden_roles : roles of the maps that the caller sets by other means, and that are not read from the
        file
    height_mm, normal_y : see `load_maps`
    """
    textures = read_library(path, read_obj_text(path)).materials[material_name].textures
    maps, faults = Maps(), list[str]()
    roles = [role for role in ("colour", "specular", "roughness") if role not in overridden_roles]
    if not set(_RELIEF_MAP_ROLES) & set(overridden_roles):
        roles.append("normal" if "normal" in textures else "bump")
    remaining = MAX_TOTAL_PIXELS
    for role in (one for one in roles if one in textures):
        texture = textures[role]
        file = find_referenced_file(path, picture_file_name(texture))
        if file is None:
            continue
        try:
            remaining -= _checked_texel_count(file, remaining)
            maps = replace(maps, **_load_map(role, file, texture, height_mm, normal_y))
        except DermisError as fault:
            faults.append(f"{texture.key}: {fault}")
    return maps, faults


def _checked_texel_count(picture_file: Path, remaining_texels: int) -> int:
    """Return the number of texels of a picture after checking that it is at most `remaining_texels`."""
    width, height = read_size(picture_file)
    if width * height > remaining_texels:
        expected = f"pictures of at most {MAX_TOTAL_PIXELS / 1e6:.0f} million texels together"
        refuse(picture_file, expected, "this one exceeds the limit", "Resize them")
    return width * height


def _load_map(
    role: str,
    picture_file: Path,
    texture: MtlTexture,
    height_mm: float | None,
    normal_y: Literal["up", "down"],
) -> dict[str, Any]:
    """Load the map of a role from a picture file; heights and slopes are multiplied by the option -bm.

    The result is {role: map}; the role "bump" becomes "height" for a grey picture, else "normal".
    """
    if role == "bump":
        role = "height" if _is_grey(picture_file) else "normal"
    if role not in _RELIEF_MAP_ROLES:
        values = getattr(load_maps(**{role: picture_file}), role)  # type: ignore[arg-type]
        return {role: values * values if role == "roughness" else values}
    maps = load_maps(**{role: picture_file}, height_mm=height_mm, normal_y=normal_y)
    with np.errstate(over="ignore", invalid="ignore"):
        return {role: check_finite(picture_file, getattr(maps, role) * np.float32(texture.factor))}


def _is_grey(picture_file: Path) -> bool:
    """Return whether a picture is grey up to JPEG artefacts; large pictures are subsampled."""
    picture = read_image(picture_file)
    step = max(min(picture.shape[:2]) // _GREY_TEST_TEXELS_PER_SIDE, 1)
    samples = picture[::step, ::step, :3].astype(float)
    largest = float(samples.max()) or 1.0
    return bool((abs(samples - samples[..., :1]) <= 0.02 * largest).all())
