"""OBJ files: checks of their text before parsing, groups of faces, and maps of their materials."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dermis.base.arrays import Bytes, Index
from dermis.base.errors import DermisError, refuse
from dermis.base.reading import read_file
from dermis.formats import size_limits as limits
from dermis.formats.maps import check_finite, load_maps
from dermis.formats.parts import (
    GREY,
    MaterialGroup,
    MeshFile,
    MeshPart,
    find_quads,
    parse_colour,
    trimesh_parts,
)
from dermis.formats.referenced_files import find_referenced_file
from dermis.images.io import read_image, read_size
from dermis.images.sizes import MAX_TOTAL_PIXELS
from dermis.mesh.maps import Maps

_TRAILING_COMMENT = re.compile(r"^((?:v[tn]?|f)[ \t][^#\n]*)#[^\n]*", re.MULTILINE)
_GROUP_LINE = re.compile(r"^[ \t]*(usemtl|g)(?:[ \t]([^\n]*))?$", re.MULTILINE)
_FACE_OR_NUMBER = re.compile(r"^(?:usemtl (\d+)|f([ \t].*))$", re.MULTILINE)
_MAX_LINE_LENGTH, _MAX_VERTEX_LINE = 1 << 17, 256  # characters
_ZERO_INDEX = re.compile(r"(?<![^ \t/])0+(?![^ \t/])")
_GROUP_OR_FACE = re.compile(r"^[ \t]*(usemtl|g|f)(?:[ \t]([^\n]*))?$", re.MULTILINE)
_RELIEF_ROLES = ("normal", "height")
_GREY_TEST_SAMPLES = 256  # texels that are compared along a side
_MAP_ROLES = {
    "map_kd": "colour",
    "map_ks": "specular",
    "map_pr": "roughness",
    "norm": "normal",
    "map_bump": "bump",
    "bump": "bump",
}
_NUMBER_REGEX = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_TEXTURE_OPTION = re.compile(
    rf"-(?:bm\s+(?P<factor>{_NUMBER_REGEX})"
    rf"|(?P<transform>[ost])(?P<numbers>(?:\s+{_NUMBER_REGEX}(?=\s)){{1,3}})"
    r"|mm\s+\S+\s+\S+"
    r"|(?:blendu|blendv|boost|cc|clamp|imfchan|texres|type)\s+\S+)\s+",
    re.IGNORECASE,
)
_NUMBER_PATTERN = re.compile(_NUMBER_REGEX)
_MAX_MTL_LINE = 4096  # characters
_LIBRARY_LINE = re.compile(r"^[ \t]*mtllib[ \t]([^\n]*)", re.MULTILINE)


def read_obj_text(path: Path) -> str:
    """Return the text of a .obj file, with Windows line ends replaced by line feeds.

    Raises DermisError when it cannot be read or is too large.
    """
    text = read_file(path, "an OBJ file", limits.MAX_FILE_BYTES).decode("utf-8", errors="replace")
    return text.replace("\r\n", "\n")


def join_continued_lines(path: Path, text: str) -> str:
    """Return the text of an OBJ file with continued lines joined, and without comments at the ends of lines.

    Raises DermisError for overlong lines, and for too many vertices.
    """
    text = text.replace("\\\n", " ")
    _check_lines(path, np.frombuffer(text.encode("utf-8", "replace"), np.uint8))
    commented = text.count("#") != text.count("\n#") + text.startswith("#")
    return _TRAILING_COMMENT.sub(r"\1", text) if commented else text


def _check_lines(path: Path, data: Bytes) -> None:
    ends = np.flatnonzero(data == ord("\n"))
    starts = np.concatenate([[0], ends + 1])
    length = np.diff(starts, append=len(data) + 1)
    vertex = data[np.minimum(starts, len(data) - 1)] == ord("v") if len(data) else np.zeros(1, bool)
    if length.max() > _MAX_LINE_LENGTH or length[vertex].max(initial=0) > _MAX_VERTEX_LINE:
        expected = f"lines of at most {_MAX_LINE_LENGTH:,} characters, {_MAX_VERTEX_LINE} for vertices"
        refuse(path, expected, f"one has {length.max():,}", limits.DAMAGED_ADVICE)
    items = "lines of vertices, uv and normals"
    limits.check_limit(path, int(vertex.sum()), 3 * limits.MAX_VERTICES, items, limits.DECIMATE_ADVICE)


def face_groups(text: str) -> Iterator[tuple[str, str]]:
    """Yield the current names of `usemtl` and `g` for each face of an OBJ text."""
    current = {"usemtl": "", "g": ""}
    for line in _GROUP_OR_FACE.finditer(text):
        if line[1] == "f":
            yield current["usemtl"], current["g"]
        else:
            current[line[1]] = (line[2] or "").strip()


def number_groups(path: Path, text: str) -> tuple[str, list[tuple[str, str]]]:
    """Replace each pair of `usemtl` and `g` names by a `usemtl` with a number; return the text and the pairs.

    trimesh would rename the groups otherwise.

    Raises DermisError for too many pairs.
    """
    current = {"usemtl": "", "g": ""}
    numbers: dict[tuple[str, str], int] = {("", ""): 0}

    def number(match: re.Match[str]) -> str:
        current[match[1]] = (match[2] or "").strip()
        key = (current["usemtl"], current["g"])
        return f"usemtl {numbers.setdefault(key, len(numbers))}"

    marked = _GROUP_LINE.sub(number, text)
    limits.check_limit(
        path, len(numbers), limits.MAX_GROUPS, "groups", "Export it with fewer, or without groups"
    )
    return f"mtllib marked.mtl\nusemtl 0\n{marked}", list(numbers)


def face_corner_counts(path: Path, text: str, groups: int) -> list[Index]:
    """Return the numbers of corners of the faces of each group.

    text : of the OBJ file, with group numbers from `number_groups`
    groups : number of groups

    Raises DermisError for relative indices, for indices of 0, and for too many corners.
    """
    corner_counts: list[list[int]] = [[] for _ in range(groups)]
    current, triangles = corner_counts[0], 0
    for line in _FACE_OR_NUMBER.finditer(text):
        number, face = line.groups()
        if number:
            current = corner_counts[int(number)]
            continue
        if "-" in face:
            actual = "it has negative ones"
            refuse(path, "absolute indices in faces", actual, "Export it again, in Blender")
        if (" 0" in face or "/0" in face or "\t0" in face) and _ZERO_INDEX.search(face):
            refuse(path, "faces by indices from 1", "it has a 0", limits.DAMAGED_ADVICE)
        count = len(face.split())
        current.append(count)
        triangles += max(count - 2, 0)
        if count > limits.MAX_CORNERS or triangles > limits.MAX_TRIANGLES:
            limits.check_limit(
                path, count, limits.MAX_CORNERS, "corners of a face", "Divide it into smaller ones"
            )
            limits.check_limit(path, triangles, limits.MAX_TRIANGLES, "triangles", limits.DECIMATE_ADVICE)
    return [np.array(one, dtype=np.int64) for one in corner_counts]


def read_obj(path: Path) -> MeshFile:
    """Read a .obj file, one mesh part per pair of `usemtl` and `g`.

    Colours are Kd of its .mtl, taken as linear.
    """
    return parse_obj(path, read_obj_text(path))


def parse_obj(path: Path, text: str) -> MeshFile:
    """Parse the text of a .obj file, one mesh part per pair of `usemtl` and `g`.

    path : of the file, for errors and to find its .mtl
    """
    text = join_continued_lines(path, text)
    materials = read_materials(path, text).materials
    colours = {name: parse_colour(one.kd) for name, one in materials.items() if len(one.kd) >= 3}
    text, pairs = number_groups(path, text)
    corner_counts = face_corner_counts(path, text, len(pairs))
    names = [tuple(dict.fromkeys(name for name in pair if name)) for pair in pairs]
    pairs_of_names = zip(names, pairs, strict=True)
    groups = [MaterialGroup(name, colours.get(pair[0], GREY)) for name, pair in pairs_of_names]
    numbers = "\n".join(f"newmtl {k}" for k in range(len(groups)))
    # trimesh pops groups from the end; this restores the order of the file
    parts = list(trimesh_parts(text.encode(), "obj", groups, resolver={"marked.mtl": numbers.encode()}))[::-1]
    corners = {id(group): counts for group, counts in zip(groups, corner_counts, strict=True)}
    parts = [replace(part, quads=find_quads(corners[id(part.group)], part.triangles)) for part in parts]
    used, none = [part.group for part in parts], np.empty((0, 3))
    empty = [MeshPart(g, none, None, None, none.astype(int)) for g in groups if g.names and g not in used]
    return MeshFile(parts + empty)


def obj_maps(
    path: Path,
    *,
    opaque: Collection[str] = (),
    overridden: Collection[str] = (),
    height_mm: float | None = None,
    normal_y: Literal["up", "down"] = "up",
) -> tuple[Maps, str]:
    """Return the maps of the skin's material, and a note about maps that could not be used.

    The statements map_Kd, norm, map_Bump or bump, map_Ks and map_Pr are read. A bump map may contain normals,
    as many programs write it, or heights, which require `height_mm`; -bm scales both. map_Pr is the square
    root of the roughness m.

    opaque : names of groups that are not skin
    overridden : roles of maps that the caller sets otherwise; those of the file are not read
    height_mm, normal_y : see `load_maps`
    """
    text = read_obj_text(path)
    library, faults = read_materials(path, text), list[str]()
    faults += [f"mtllib: {name} is not in its folder" for name in library.missing]
    textures = _skin_material(text, library.materials, opaque).textures
    maps, roles = Maps(), [role for role in ("colour", "specular", "roughness") if role not in overridden]
    if not set(_RELIEF_ROLES) & set(overridden):
        roles.append("normal" if "normal" in textures else "bump")
    remaining = MAX_TOTAL_PIXELS
    for role in (one for one in roles if one in textures):
        texture = textures[role]
        file = find_referenced_file(path, texture.name)
        if file is None:
            faults.append(f"{texture.key}: {texture.name} is not in its folder")
            continue
        try:
            remaining -= _checked_texel_count(file, remaining)
            maps = replace(maps, **_load_map(role, file, texture, height_mm, normal_y))
        except DermisError as fault:
            faults.append(f"{texture.key}: {fault}")
        if texture.transformed:
            faults.append(f"{texture.key}: {texture.name} is used without its -s, -o or -t")
    return maps, _unused_files_note(path, faults)


def _checked_texel_count(file: Path, remaining: int) -> int:
    """Return the number of texels of a picture after checking it against the number still allowed."""
    width, height = read_size(file)
    if width * height > remaining:
        expected = f"pictures of at most {MAX_TOTAL_PIXELS / 1e6:.0f} million texels together"
        refuse(file, expected, "this one exceeds the limit", "Resize them")
    return width * height


def _unused_files_note(path: Path, faults: list[str]) -> str:
    if not faults:
        return ""
    advice = "Put the files next to it, or set maps by options (--colour, --normal, ...)"
    return "\n  ".join([f"{path}: some maps of its .mtl are not used. {advice}.", *faults])


def _load_map(
    role: str, file: Path, texture: MtlTexture, height_mm: float | None, normal_y: Literal["up", "down"]
) -> dict[str, Any]:
    """Load the map in a picture file by its role; heights and slopes are multiplied by -bm.

    The result has the role as key. For "bump" it is "height" for a grey picture, else "normal".
    """
    if role == "bump":
        role = "height" if _is_grey(file) else "normal"
    if role not in _RELIEF_ROLES:
        values = getattr(load_maps(**{role: file}), role)  # type: ignore[arg-type]
        return {role: values * values if role == "roughness" else values}
    maps = load_maps(**{role: file}, height_mm=height_mm, normal_y=normal_y)
    with np.errstate(over="ignore", invalid="ignore"):
        return {role: check_finite(file, getattr(maps, role) * np.float32(texture.factor))}


def _is_grey(file: Path) -> bool:
    """Return whether a picture is grey up to JPEG artefacts; large pictures are subsampled."""
    picture = read_image(file)
    step = max(min(picture.shape[:2]) // _GREY_TEST_SAMPLES, 1)
    samples = picture[::step, ::step, :3].astype(float)
    largest = float(samples.max()) or 1.0
    return bool((abs(samples - samples[..., :1]) <= 0.02 * largest).all())


def _skin_material(text: str, materials: dict[str, MtlMaterial], opaque: Collection[str]) -> MtlMaterial:
    """Return the material with textures that covers most faces, in groups named skin if there are any.

    opaque : names of groups to leave out
    """
    faces = Counter(face_groups(text))
    excluded = {name.casefold() for name in opaque}
    counted = {names: count for names, count in faces.items() if not excluded & set(map(str.casefold, names))}
    skin = {names: count for names, count in counted.items() if "skin" in " ".join(names).casefold()}
    counts = Counter[str]()
    for (material, _), count in (skin or counted).items():
        if material in materials and materials[material].textures:
            counts[material] += count
    return materials[counts.most_common(1)[0][0]] if counts else MtlMaterial()


@dataclass(frozen=True)
class MtlTexture:
    """Picture that a material of an .mtl file references.

    key : statement that references it, such as map_Kd
    name : file name as written
    factor : option -bm, by which the map is multiplied [-]
    transformed : whether the picture has a scale, an offset or turbulence (-s, -o, -t)
    """

    key: str
    name: str
    factor: float = 1.0
    transformed: bool = False


@dataclass
class MtlMaterial:
    """Material of an .mtl file.

    kd : diffuse colour as written
    textures : pictures by role; "bump" may contain heights or normals
    """

    kd: list[str] = field(default_factory=list)
    textures: dict[str, MtlTexture] = field(default_factory=dict)


@dataclass
class MaterialLibrary:
    """Materials of an OBJ file by name, and the names of .mtl files that do not exist."""

    materials: dict[str, MtlMaterial] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def read_materials(path: Path, text: str) -> MaterialLibrary:
    """Read the .mtl files that an OBJ file references.

    path, text : of the OBJ file
    """
    library, remaining = MaterialLibrary(), limits.MAX_MTL_BYTES
    for listed in library_names(text)[: limits.MAX_LIBRARIES]:
        found = find_referenced_file(path, listed)
        names = [listed] if found else listed.split(".mtl ")[: limits.MAX_LIBRARIES]
        for name in names:
            file = find_referenced_file(path, name) or find_referenced_file(path, f"{name}.mtl")
            if file is None:
                library.missing.append(name)
            else:
                data = read_file(file, "material libraries", remaining)
                remaining -= len(data)
                library.materials |= _parse_mtl(data.decode("utf-8", errors="replace"))
    return library


def _parse_mtl(text: str) -> dict[str, MtlMaterial]:
    materials: dict[str, MtlMaterial] = {}
    current = MtlMaterial()
    for line in text.splitlines():
        if len(line) > _MAX_MTL_LINE:
            continue
        key, _, value = line.strip().replace("\t", " ").partition(" ")
        if key.lower() == "newmtl":
            current = materials.setdefault(value.strip(), MtlMaterial())
        elif key.lower() == "kd":
            current.kd = value.split()
        elif key.lower() in _MAP_ROLES and value.strip():
            current.textures[_MAP_ROLES[key.lower()]] = _parse_texture(key, value.strip())
    return materials


def _parse_texture(key: str, statement: str) -> MtlTexture:
    """Parse a texture statement of an .mtl file; its file name extends to the end of the line.

    key : statement, such as map_Kd
    statement : text after the key, options first
    """
    factor, transformed, start = 1.0, False, 0
    while option := _TEXTURE_OPTION.match(statement, start):
        factor = float(option["factor"] or factor)
        if option["transform"]:
            default = 1.0 if option["transform"] in "sS" else 0.0
            transformed |= any(float(number) != default for number in option["numbers"].split())
        start = option.end()
    name = statement[start:]
    match name.rsplit(maxsplit=2):
        case [first, last, number] if last.lower() == "-bm" and _NUMBER_PATTERN.fullmatch(number):
            factor, name = float(number), first  # some programs write the option after the name
    return MtlTexture(key, name, factor, transformed)


def library_names(text: str) -> list[str]:
    """Return the .mtl file names in the `mtllib` lines of an OBJ text, without duplicates."""
    return list(dict.fromkeys(line[1].strip() for line in _LIBRARY_LINE.finditer(text)))
