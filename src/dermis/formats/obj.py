"""OBJ files: their text, checked before it is parsed, their groups, and the maps of their materials."""

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
_MAX_LINE, _MAX_VERTEX_LINE = 1 << 17, 256  # characters of a line
_ZERO = re.compile(r"(?<![^ \t/])0+(?![^ \t/])")
_GROUP_OR_FACE = re.compile(r"^[ \t]*(usemtl|g|f)(?:[ \t]([^\n]*))?$", re.MULTILINE)
_RELIEF_ROLES = ("normal", "height")
_SAMPLES_PER_SIDE = 256  # texels a side
_ROLES = {"map_kd": "colour", "map_ks": "specular", "map_pr": "roughness", "norm": "normal"}
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_OPTION = re.compile(
    rf"-(?:bm\s+(?P<factor>{_NUMBER})"
    rf"|(?P<place>[ost])(?P<numbers>(?:\s+{_NUMBER}(?=\s)){{1,3}})"
    r"|mm\s+\S+\s+\S+"
    r"|(?:blendu|blendv|boost|cc|clamp|imfchan|texres|type)\s+\S+)\s+",
    re.IGNORECASE,
)
_WHOLE_NUMBER = re.compile(_NUMBER)
_MAX_MTL_LINE = 4096  # characters of a line
_LIBRARY = re.compile(r"^[ \t]*mtllib[ \t]([^\n]*)", re.MULTILINE)


def read_obj_text(path: Path) -> str:
    """The text of a .obj file with line feeds alone.

    Raises DermisError when it cannot be read or is too large.
    """
    text = read_file(path, "an OBJ file", MAX_FILE_BYTES).decode("utf-8", errors="replace")
    return text.replace("\r\n", "\n")


def join_continued_lines(path: Path, text: str) -> str:
    """The text with continued lines joined, and numbers without comments behind them.

    Raises DermisError for lines that are longer than any that means something, and for too many vertices.
    """
    text = text.replace("\\\n", " ")
    _check_lines(path, np.frombuffer(text.encode("utf-8", "replace"), np.uint8))
    commented = text.count("#") != text.count("\n#") + text.startswith("#")
    return _TRAILING_COMMENT.sub(r"\1", text) if commented else text


def _check_lines(path: Path, data: Bytes) -> None:
    ends = np.flatnonzero(data == ord("\n"))
    starts = np.concatenate([[0], ends + 1])
    long = np.diff(starts, append=len(data) + 1)
    vertex = data[np.minimum(starts, len(data) - 1)] == ord("v") if len(data) else np.zeros(1, bool)
    if long.max() > _MAX_LINE or long[vertex].max(initial=0) > _MAX_VERTEX_LINE:
        actual, advice = f"one has {long.max():,}", "The file is damaged: export it again"
        expected = f"lines of at most {_MAX_LINE:,} characters, {_MAX_VERTEX_LINE} for vertices"
        refuse(path, expected, actual, advice)
    if int(vertex.sum()) > 3 * MAX_VERTICES:
        actual, advice = f"it has {int(vertex.sum()):,}", "Decimate it (in Blender: Modifiers > Decimate)"
        refuse(path, f"at most {3 * MAX_VERTICES:,} lines of vertices, uv and normals", actual, advice)


def face_groups(text: str) -> Iterator[tuple[str, str]]:
    """The names `usemtl` and `g` of each face."""
    current = {"usemtl": "", "g": ""}
    for line in _GROUP_OR_FACE.finditer(text):
        if line[1] == "f":
            yield current["usemtl"], current["g"]
        else:
            current[line[1]] = (line[2] or "").strip()


def number_groups(path: Path, text: str) -> tuple[str, list[tuple[str, str]]]:
    """Each `usemtl` and `g` as `usemtl` of a number, one for each pair of names, and these pairs.

    Raises DermisError when they are too many.
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
    """How many corners each face of each group has; the text names groups by number, `usemtl 0` first.

    Raises DermisError for indices that are relative or 0, and for too many corners.
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
        refuse(path, f"faces of at most {MAX_CORNERS:,} corners", actual, "Cut it into smaller ones")
    actual, advice = "it has more", "Decimate it (in Blender: Modifiers > Decimate)"
    refuse(path, f"a mesh of at most {MAX_TRIANGLES:,} triangles", actual, advice)


def read_obj(path: Path) -> MeshFile:
    """Parts of a .obj file by `usemtl` and `g`; colours are Kd of its .mtl, taken as linear."""
    return parse_obj(path, read_obj_text(path))


def parse_obj(path: Path, text: str) -> MeshFile:
    """The same of a file's text."""
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
    # trimesh pops groups from the end: file order again
    parts = list(trimesh_parts(text.encode(), "obj", groups, resolver={"marked.mtl": numbers.encode()}))[::-1]
    faces = {id(group): each for group, each in zip(groups, sides, strict=True)}
    parts = [replace(part, quads=find_quads(faces[id(part.group)], part.triangles)) for part in parts]
    full, none = [part.group for part in parts], np.empty((0, 3))
    empty = [MeshPart(g, none, None, None, none.astype(int)) for g in groups if g.names and g not in full]
    return MeshFile(parts + empty)


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
    wanted = _skin_material(text, library.materials, opaque).textures
    maps, roles = Maps(), [role for role in ("colour", "specular", "roughness") if role not in given]
    if not set(_RELIEF_ROLES) & set(given):
        roles.append("normal" if "normal" in wanted else "bump")
    left = MAX_TOTAL_PIXELS
    for role in (one for one in roles if one in wanted):
        texture = wanted[role]
        file = find_referenced_file(path, texture.name)
        if file is None:
            faults.append(f"{texture.key}: {texture.name} is not in its folder")
            continue
        try:
            left -= _checked_texel_count(file, left)
            maps = replace(maps, **_load_map(role, file, texture, height_mm, normal_y))
        except DermisError as fault:
            faults.append(f"{texture.key}: {fault}")
        if texture.transformed:
            faults.append(f"{texture.key}: {texture.name} is taken without its -s, -o or -t")
    return maps, _unused_files_note(path, faults)


def _checked_texel_count(file: Path, left: int) -> int:
    """How many texels a picture has, of those that are left to a mesh file."""
    width, height = read_size(file)
    if width * height > left:
        expected = f"pictures of at most {MAX_TOTAL_PIXELS / 1e6:.0f} million texels together"
        refuse(file, expected, "with this one there are more", "Resize them")
    return width * height


def _unused_files_note(path: Path, faults: list[str]) -> str:
    if not faults:
        return ""
    advice = "Put the files beside it, or name maps yourself (--colour, --normal, ...)"
    return "\n  ".join([f"{path}: not all that its .mtl names is used. {advice}.", *faults])


def _load_map(
    role: str, file: Path, texture: Texture, height_mm: float | None, normal_y: Literal["up", "down"]
) -> dict[str, Any]:
    """The map in a file, by its role."""
    if role == "roughness":
        made = load_maps(roughness=file).roughness
        return {} if made is None else {role: made * made}
    if role == "bump" and _is_grey(file):
        made = load_maps(height=file, height_mm=height_mm).height
        return {} if made is None else {"height": _scaled(made, texture, file)}
    if role in ("bump", "normal"):
        made = load_maps(normal=file, normal_y=normal_y).normal
        return {} if made is None else {"normal": _scaled(made, texture, file)}
    return {role: getattr(load_maps(**{role: file}), role)}  # type: ignore[arg-type]


def _scaled(made: Floats, texture: Texture, file: Path) -> Floats:
    """A relief multiplied as its material says."""
    with np.errstate(over="ignore", invalid="ignore"):
        return check_finite(file, made * np.float32(texture.factor))


def _is_grey(file: Path) -> bool:
    """Whether a picture's channels agree, but for what JPEG does to them; of a large one few texels tell."""
    whole = read_image(file)
    apart = max(min(whole.shape[:2]) // _SAMPLES_PER_SIDE, 1)
    image = whole[::apart, ::apart, :3].astype(float)
    most = float(image.max()) or 1.0
    return bool((abs(image - image[..., :1]) <= 0.02 * most).all())


def _skin_material(text: str, materials: dict[str, MtlMaterial], opaque: Collection[str]) -> MtlMaterial:
    """The material of the skin: of groups called so, else of all, the one with the most faces."""
    faces = Counter(face_groups(text))
    unwanted = {name.casefold() for name in opaque}
    left = {names: count for names, count in faces.items() if not unwanted & set(map(str.casefold, names))}
    named = {names: count for names, count in left.items() if "skin" in " ".join(names).casefold()}
    counts = Counter[str]()
    for (material, _), count in (named or left).items():
        if material in materials and materials[material].textures:
            counts[material] += count
    return materials[counts.most_common(1)[0][0]] if counts else MtlMaterial()


_ROLES |= {"map_bump": "bump", "bump": "bump"}


@dataclass(frozen=True)
class Texture:
    """A picture that a material names.

    key : the statement that names it, such as map_Kd
    factor : by which its values are multiplied (-bm) [-]
    transformed : whether it is to be scaled, shifted or made turbulent (-s, -o, -t)
    """

    key: str
    name: str
    factor: float = 1.0
    transformed: bool = False


@dataclass
class MtlMaterial:
    """A material: Kd as it is written, and its pictures by role; "bump" is a relief of either kind."""

    kd: list[str] = field(default_factory=list)
    textures: dict[str, Texture] = field(default_factory=dict)


@dataclass
class Library:
    """The materials of an OBJ file by name, and the names of the .mtl files that are missing."""

    materials: dict[str, MtlMaterial] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def read_materials(path: Path, text: str) -> Library:
    """What the .mtl files say that an OBJ file names.

    text : of the OBJ file
    """
    found, left = Library(), MAX_MTL_BYTES
    for told in library_names(text)[:MAX_LIBRARIES]:
        for name in [told] if find_referenced_file(path, told) else told.split(".mtl ")[:MAX_LIBRARIES]:
            file = find_referenced_file(path, name) or find_referenced_file(path, f"{name}.mtl")
            if file is None:
                found.missing.append(name)
            else:
                data = read_file(file, "material libraries", left)
                left -= len(data)
                found.materials |= _parse_mtl(data.decode("utf-8", errors="replace"))
    return found


def _parse_mtl(text: str) -> dict[str, MtlMaterial]:
    found: dict[str, MtlMaterial] = {}
    current = MtlMaterial()
    for line in text.splitlines():
        if len(line) > _MAX_MTL_LINE:
            continue
        key, _, value = line.strip().replace("\t", " ").partition(" ")
        if key.lower() == "newmtl":
            current = found.setdefault(value.strip(), MtlMaterial())
        elif key.lower() == "kd":
            current.kd = value.split()
        elif key.lower() in _ROLES and value.strip():
            current.textures[_ROLES[key.lower()]] = _parse_texture(key, value.strip())
    return found


def _parse_texture(key: str, rest: str) -> Texture:
    """What a statement says; its name goes to the end of the line, with its spaces."""
    factor, moved, place = 1.0, False, 0
    while option := _OPTION.match(rest, place):
        factor = float(option["factor"] or factor)
        if option["place"]:
            usual = 1.0 if option["place"] in "sS" else 0.0
            moved |= any(float(number) != usual for number in option["numbers"].split())
        place = option.end()
    rest = rest[place:]
    match rest.rsplit(maxsplit=2):
        case [name, last, number] if last.lower() == "-bm" and _WHOLE_NUMBER.fullmatch(number):
            factor, rest = float(number), name  # as some programs write it
    return Texture(key, rest, factor, moved)


def library_names(text: str) -> list[str]:
    """What its lines `mtllib` say, each once."""
    return list(dict.fromkeys(line[1].strip() for line in _LIBRARY.finditer(text)))
