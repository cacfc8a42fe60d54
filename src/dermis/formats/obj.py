"""OBJ files: checks of their text before parsing, groups, and maps of their materials."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dermis.base.arrays import Bytes, Floats, Index
from dermis.base.errors import DermisError, refuse
from dermis.base.reading import read_file
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
from dermis.formats.size_limits import (
    MAX_CORNERS,
    MAX_FILE_BYTES,
    MAX_GROUPS,
    MAX_LIBRARIES,
    MAX_MTL_BYTES,
    MAX_TRIANGLES,
    MAX_VERTICES,
)
from dermis.images.io import read_image, read_size
from dermis.images.sizes import MAX_TOTAL_PIXELS
from dermis.mesh.maps import Maps

_TRAILING_COMMENT = re.compile(r"^((?:v[tn]?|f)[ \t][^#\n]*)#[^\n]*", re.MULTILINE)
_GROUP_LINE = re.compile(r"^[ \t]*(usemtl|g)(?:[ \t]([^\n]*))?$", re.MULTILINE)
_FACE_OR_NUMBER = re.compile(r"^(?:usemtl (\d+)|f([ \t].*))$", re.MULTILINE)
_MAX_LINE, _MAX_VERTEX_LINE = 1 << 17, 256  # characters
_ZERO = re.compile(r"(?<![^ \t/])0+(?![^ \t/])")
_GROUP_OR_FACE = re.compile(r"^[ \t]*(usemtl|g|f)(?:[ \t]([^\n]*))?$", re.MULTILINE)
_RELIEF_ROLES = ("normal", "height")
_SAMPLES_PER_SIDE = 256  # texels that are compared along a side
_ROLES = {
    "map_kd": "colour",
    "map_ks": "specular",
    "map_pr": "roughness",
    "norm": "normal",
    "map_bump": "bump",
    "bump": "bump",
}
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_OPTION = re.compile(
    rf"-(?:bm\s+(?P<factor>{_NUMBER})"
    rf"|(?P<transform>[ost])(?P<numbers>(?:\s+{_NUMBER}(?=\s)){{1,3}})"
    r"|mm\s+\S+\s+\S+"
    r"|(?:blendu|blendv|boost|cc|clamp|imfchan|texres|type)\s+\S+)\s+",
    re.IGNORECASE,
)
_NUMBER_PATTERN = re.compile(_NUMBER)
_MAX_MTL_LINE = 4096  # characters
_LIBRARY = re.compile(r"^[ \t]*mtllib[ \t]([^\n]*)", re.MULTILINE)


def read_obj_text(path: Path) -> str:
    """Return the text of a .obj file with line feeds as line ends.

    Raises DermisError when it cannot be read or is too large.
    """
    text = read_file(path, "an OBJ file", MAX_FILE_BYTES).decode("utf-8", errors="replace")
    return text.replace("\r\n", "\n")


def join_continued_lines(path: Path, text: str) -> str:
    """Return the text with continued lines joined, and without comments after numbers.

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
    if length.max() > _MAX_LINE or length[vertex].max(initial=0) > _MAX_VERTEX_LINE:
        actual, advice = f"one has {length.max():,}", "The file is damaged: export it again"
        expected = f"lines of at most {_MAX_LINE:,} characters, {_MAX_VERTEX_LINE} for vertices"
        refuse(path, expected, actual, advice)
    if int(vertex.sum()) > 3 * MAX_VERTICES:
        actual, advice = f"it has {int(vertex.sum()):,}", "Decimate it (in Blender: Modifiers > Decimate)"
        refuse(path, f"at most {3 * MAX_VERTICES:,} lines of vertices, uv and normals", actual, advice)


def face_groups(text: str) -> Iterator[tuple[str, str]]:
    """Yield the names of `usemtl` and `g` of each face."""
    current = {"usemtl": "", "g": ""}
    for line in _GROUP_OR_FACE.finditer(text):
        if line[1] == "f":
            yield current["usemtl"], current["g"]
        else:
            current[line[1]] = (line[2] or "").strip()


def number_groups(path: Path, text: str) -> tuple[str, list[tuple[str, str]]]:
    """Return the text with each pair of `usemtl` and `g` as a numbered `usemtl`, and the pairs of names.

    Raises DermisError for too many pairs.
    """
    current = {"usemtl": "", "g": ""}
    numbers: dict[tuple[str, str], int] = {("", ""): 0}

    def number(match: re.Match[str]) -> str:
        current[match[1]] = (match[2] or "").strip()
        key = (current["usemtl"], current["g"])
        return f"usemtl {numbers.setdefault(key, len(numbers))}"

    marked = _GROUP_LINE.sub(number, text)
    if len(numbers) > MAX_GROUPS:
        actual, advice = f"it has {len(numbers):,}", "Export it with fewer, or without groups"
        refuse(path, f"at most {MAX_GROUPS:,} groups", actual, advice)
    return f"mtllib marked.mtl\nusemtl 0\n{marked}", list(numbers)


def face_corner_counts(path: Path, text: str, groups: int) -> list[Index]:
    """Return the number of corners of each face of each group; the text has groups by number.

    Raises DermisError for relative indices, for indices of 0, and for too many corners.
    """
    sides: list[list[int]] = [[] for _ in range(groups)]
    current, triangles = sides[0], 0
    for line in _FACE_OR_NUMBER.finditer(text):
        number, face = line.groups()
        if number:
            current = sides[int(number)]
            continue
        if "-" in face:
            actual = "it has relative (negative) ones"
            refuse(path, "faces by absolute index", actual, "Export it again, in Blender")
        if (" 0" in face or "/0" in face or "\t0" in face) and _ZERO.search(face):
            refuse(path, "faces by indices from 1", "it has a 0", "The file is damaged: export it again")
        count = len(face.split())
        current.append(count)
        triangles += max(count - 2, 0)
        if count > MAX_CORNERS or triangles > MAX_TRIANGLES:
            _refuse_faces(path, count)
    return [np.array(one, dtype=np.int64) for one in sides]


def _refuse_faces(path: Path, corners: int) -> None:
    if corners > MAX_CORNERS:
        actual = f"one has {corners:,}"
        refuse(path, f"faces of at most {MAX_CORNERS:,} corners", actual, "Divide it into smaller ones")
    actual, advice = "it has more", "Decimate it (in Blender: Modifiers > Decimate)"
    refuse(path, f"a mesh of at most {MAX_TRIANGLES:,} triangles", actual, advice)


def read_obj(path: Path) -> MeshFile:
    """Read the parts of a .obj file by `usemtl` and `g`; colours are Kd of its .mtl, taken as linear."""
    return parse_obj(path, read_obj_text(path))


def parse_obj(path: Path, text: str) -> MeshFile:
    """Parse the text of a .obj file as `read_obj` does."""
    text = join_continued_lines(path, text)
    materials = read_materials(path, text).materials
    colours = {name: parse_colour(one.kd) for name, one in materials.items() if len(one.kd) >= 3}
    text, pairs = number_groups(path, text)
    sides = face_corner_counts(path, text, len(pairs))
    names = [tuple(dict.fromkeys(name for name in pair if name)) for pair in pairs]
    groups = [
        MaterialGroup(name, colours.get(pair[0], GREY)) for name, pair in zip(names, pairs, strict=True)
    ]
    numbers = "\n".join(f"newmtl {k}" for k in range(len(groups)))
    # trimesh pops groups from the end; this restores the order of the file
    parts = list(trimesh_parts(text.encode(), "obj", groups, resolver={"marked.mtl": numbers.encode()}))[::-1]
    corners = {id(group): counts for group, counts in zip(groups, sides, strict=True)}
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

    They are map_Kd, norm, map_Bump or bump, map_Ks and map_Pr. A bump map may contain normals, as many
    programs write it, or heights, which require `height_mm`; -bm scales both. map_Pr is the square root of
    the roughness m.

    opaque : groups that are not skin
    overridden : roles of maps that are set otherwise
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
    """Return the number of texels of a picture after checking it against the remaining limit."""
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
    role: str, file: Path, texture: Texture, height_mm: float | None, normal_y: Literal["up", "down"]
) -> dict[str, Any]:
    """Load the map in a file by its role."""
    if role == "roughness":
        root = load_maps(roughness=file).roughness
        return {} if root is None else {role: root * root}
    if role == "bump" and _is_grey(file):
        height = load_maps(height=file, height_mm=height_mm).height
        return {} if height is None else {"height": _scaled(height, texture, file)}
    if role in ("bump", "normal"):
        normal = load_maps(normal=file, normal_y=normal_y).normal
        return {} if normal is None else {"normal": _scaled(normal, texture, file)}
    return {role: getattr(load_maps(**{role: file}), role)}  # type: ignore[arg-type]


def _scaled(relief: Floats, texture: Texture, file: Path) -> Floats:
    """Return a relief scaled by the factor of its material."""
    with np.errstate(over="ignore", invalid="ignore"):
        return check_finite(file, relief * np.float32(texture.factor))


def _is_grey(file: Path) -> bool:
    """Return whether the channels of a picture agree up to JPEG artefacts; large pictures are sampled."""
    picture = read_image(file)
    step = max(min(picture.shape[:2]) // _SAMPLES_PER_SIDE, 1)
    samples = picture[::step, ::step, :3].astype(float)
    largest = float(samples.max()) or 1.0
    return bool((abs(samples - samples[..., :1]) <= 0.02 * largest).all())


def _skin_material(text: str, materials: dict[str, MtlMaterial], opaque: Collection[str]) -> MtlMaterial:
    """Return the material with the most faces among groups named skin, or among all groups."""
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
class Texture:
    """Picture referenced by a material.

    key : statement that references it, such as map_Kd
    name : of the file
    factor : by which its values are multiplied (-bm) [-]
    transformed : whether it is scaled, shifted or made turbulent (-s, -o, -t)
    """

    key: str
    name: str
    factor: float = 1.0
    transformed: bool = False


@dataclass
class MtlMaterial:
    """Material with its Kd as written and its pictures by role; "bump" is a relief of either kind."""

    kd: list[str] = field(default_factory=list)
    textures: dict[str, Texture] = field(default_factory=dict)


@dataclass
class Library:
    """Materials of an OBJ file by name, and names of missing .mtl files."""

    materials: dict[str, MtlMaterial] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def read_materials(path: Path, text: str) -> Library:
    """Read the .mtl files that an OBJ file references.

    text : of the OBJ file
    """
    library, remaining = Library(), MAX_MTL_BYTES
    for listed in library_names(text)[:MAX_LIBRARIES]:
        names = [listed] if find_referenced_file(path, listed) else listed.split(".mtl ")[:MAX_LIBRARIES]
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
        elif key.lower() in _ROLES and value.strip():
            current.textures[_ROLES[key.lower()]] = _parse_texture(key, value.strip())
    return materials


def _parse_texture(key: str, statement: str) -> Texture:
    """Parse a statement with options; the name of the file extends to the end of the line."""
    factor, transformed, start = 1.0, False, 0
    while option := _OPTION.match(statement, start):
        factor = float(option["factor"] or factor)
        if option["transform"]:
            default = 1.0 if option["transform"] in "sS" else 0.0
            transformed |= any(float(number) != default for number in option["numbers"].split())
        start = option.end()
    name = statement[start:]
    match name.rsplit(maxsplit=2):
        case [first, last, number] if last.lower() == "-bm" and _NUMBER_PATTERN.fullmatch(number):
            factor, name = float(number), first  # some programs write the option after the name
    return Texture(key, name, factor, transformed)


def library_names(text: str) -> list[str]:
    """Return the names in `mtllib` lines, each once."""
    return list(dict.fromkeys(line[1].strip() for line in _LIBRARY.finditer(text)))
