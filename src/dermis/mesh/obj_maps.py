"""The pictures that the materials of an OBJ file name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dermis.base.errors import DermisError, refuse
from dermis.images.io import read_image, read_size
from dermis.images.sizes import MOST_TOGETHER
from dermis.mesh.beside import beside
from dermis.mesh.map_pixels import Floats, finite
from dermis.mesh.maps import Maps, load_maps
from dermis.mesh.mtl import MtlMaterial, Texture, read_materials
from dermis.mesh.obj_text import groups_of_faces, read_obj_text

_RELIEF = ("normal", "height")
_ENOUGH = 256  # texels a side


def obj_maps(
    path: Path,
    *,
    opaque: Collection[str] = (),
    given: Collection[str] = (),
    height_mm: float | None = None,
    normal_y: Literal["up", "down"] = "up",
) -> tuple[Maps, str]:
    """Maps of the skin's material: map_Kd, norm, map_Bump or bump, map_Ks and map_Pr.

    A bump map may hold normals, as many programs write it, or heights, which need `height_mm`; -bm multiplies
    either. map_Pr is the root of the roughness m. What cannot be used is left out; the second result says
    why, if need be.

    opaque : groups that are not skin
    given : roles of maps that are not wanted
    height_mm, normal_y : see `load_maps`
    """
    text = read_obj_text(path)
    library, faults = read_materials(path, text), list[str]()
    faults += [f"mtllib: {name} is not in its folder" for name in library.missing]
    wanted = _skin(text, library.materials, opaque).textures
    maps, roles = Maps(), [role for role in ("colour", "specular", "roughness") if role not in given]
    if not set(_RELIEF) & set(given):
        roles.append("normal" if "normal" in wanted else "bump")
    left = MOST_TOGETHER
    for role in (one for one in roles if one in wanted):
        texture = wanted[role]
        file = beside(path, texture.name)
        if file is None:
            faults.append(f"{texture.key}: {texture.name} is not in its folder")
            continue
        try:
            left -= _texels(file, left)
            maps = replace(maps, **_loaded(role, file, texture, height_mm, normal_y))
        except DermisError as fault:
            faults.append(f"{texture.key}: {fault}")
        if texture.moved:
            faults.append(f"{texture.key}: {texture.name} is taken without its -s, -o or -t")
    return maps, _notice(path, faults)


def _texels(file: Path, left: int) -> int:
    """How many texels a picture has, of those that are left to a mesh file."""
    width, height = read_size(file)
    if width * height > left:
        expected = f"pictures of at most {MOST_TOGETHER / 1e6:.0f} million texels together"
        refuse(file, expected, "with this one there are more", "Resize them")
    return width * height


def _notice(path: Path, faults: list[str]) -> str:
    if not faults:
        return ""
    remedy = "Put the files beside it, or name maps yourself (--colour, --normal, ...)"
    return "\n  ".join([f"{path}: not all that its .mtl names is used. {remedy}.", *faults])


def _loaded(
    role: str, file: Path, texture: Texture, height_mm: float | None, normal_y: Literal["up", "down"]
) -> dict[str, Any]:
    """The map in a file, by its role."""
    if role == "roughness":
        made = load_maps(roughness=file).roughness
        return {} if made is None else {role: made * made}
    if role == "bump" and _is_grey(file):
        made = load_maps(height=file, height_mm=height_mm).height
        return {} if made is None else {"height": _times(made, texture, file)}
    if role in ("bump", "normal"):
        made = load_maps(normal=file, normal_y=normal_y).normal
        return {} if made is None else {"normal": _times(made, texture, file)}
    return {role: getattr(load_maps(**{role: file}), role)}  # type: ignore[arg-type]


def _times(made: Floats, texture: Texture, file: Path) -> Floats:
    """A relief multiplied as its material says."""
    with np.errstate(over="ignore", invalid="ignore"):
        return finite(file, made * np.float32(texture.factor))


def _is_grey(file: Path) -> bool:
    """Whether a picture's channels agree, but for what JPEG does to them; of a large one few texels tell."""
    whole = read_image(file)
    apart = max(min(whole.shape[:2]) // _ENOUGH, 1)
    image = whole[::apart, ::apart, :3].astype(float)
    most = float(image.max()) or 1.0
    return bool((abs(image - image[..., :1]) <= 0.02 * most).all())


def _skin(text: str, materials: dict[str, MtlMaterial], opaque: Collection[str]) -> MtlMaterial:
    """The material of the skin: of groups called so, else of all, the one with the most faces."""
    faces = Counter(groups_of_faces(text))
    unwanted = {name.casefold() for name in opaque}
    left = {names: count for names, count in faces.items() if not unwanted & set(map(str.casefold, names))}
    named = {names: count for names, count in left.items() if "skin" in " ".join(names).casefold()}
    counts = Counter[str]()
    for (material, _), count in (named or left).items():
        if material in materials and materials[material].textures:
            counts[material] += count
    return materials[counts.most_common(1)[0][0]] if counts else MtlMaterial()
