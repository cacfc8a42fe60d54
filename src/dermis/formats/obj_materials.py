"""Materials of OBJ files, from their .mtl files."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dermis.base.file_properties import drawn_property, keys_of, noted_property, property_without_effect
from dermis.base.reading import read_file, refuse_parse_errors
from dermis.formats import size_limits as limits
from dermis.formats.materials import IDENTITY_UV_TRANSFORM, FileMaterial, Role, Texture, UvTransform, Wrap
from dermis.formats.parts import DEFAULT_COLOUR, Colour, MeshPart, parse_colour
from dermis.formats.referenced_files import find_referenced_file
from dermis.formats.text_files import decode_text

TEXTURE_ROLES = {
    "map_kd": "colour",
    "map_ks": "specular",
    "map_pr": "roughness",
    "map_pm": "metalness",
    "map_ke": "emission",
    "map_d": "opacity",
    "norm": "normal",
    "map_bump": "bump",
    "bump": "bump",
}
"""Dictionary from a statement of .mtl files, in lower case, to the role of the picture that it references. A
picture with the role "bump" contains heights or normals."""
NUMERIC_STATEMENTS = {"kd": 3, "ke": 3, "d": 1, "tr": 1, "pr": 1, "pm": 1, "ns": 1}
"""Dictionary from a numeric statement of .mtl files, in lower case, to the number of values that it needs."""
MTL_PROPERTIES = (
    drawn_property("`newmtl`", "begins a material", "newmtl"),
    drawn_property("`Kd`", "linear colour; a grey of 0.8 counts as none", "Kd"),
    noted_property("`Kd` beside `map_Kd`", "no note for greys that programs usually write there"),
    drawn_property("`map_Kd`", "colour", "map_Kd"),
    drawn_property("UDIM tiles: `face.<UDIM>.png`", "a picture for each tile"),
    noted_property("`Ke`, `map_Ke`", "emission", "Ke", "map_Ke", other_parts="drawn"),
    noted_property("`d`, `Tr`, `map_d`", "opacity, cut at one half", "d", "Tr", "map_d", other_parts="drawn"),
    noted_property("`Pr`, `Ns`", "roughness; skin has a measured one", "Pr", "Ns", other_parts="drawn"),
    drawn_property("`map_Pr`", "roughness, squared for skin", "map_Pr"),
    noted_property("`Pm`, `map_Pm`", "metalness", "Pm", "map_Pm", other_parts="drawn"),
    drawn_property("`map_Ks`", "specular strength, of a single skin material", "map_Ks", other_parts="noted"),
    drawn_property("`norm`", "normal map", "norm"),
    drawn_property(
        "`bump`, `map_Bump` with normals",
        "of a single skin material",
        "bump",
        "map_Bump",
        other_parts="noted",
    ),
    noted_property("`bump`, `map_Bump` with heights", "drawn for skin with `--height-mm`"),
    drawn_property("options `-s`, `-o`, `-clamp`", "placement of a picture"),
    drawn_property("option `-bm`", "factor of normals and heights"),
    noted_property(
        "options `-mm`, `-cc`, `-boost`, `-imfchan`, `-blendu`, `-blendv`, `-t`",
        "no note for values that change nothing, such as `-mm 0 1`",
    ),
    property_without_effect(
        "options `-texres`, `-type`", "pictures keep their size; `-type` is for reflections"
    ),
    noted_property("a picture that is missing"),
    property_without_effect("`Ka`, `map_Ka`", "ambient light follows from the lights", "Ka", "map_Ka"),
    property_without_effect(
        "`illum`, `sharpness`, `map_aat`", "settings of old renderers", "illum", "sharpness", "map_aat"
    ),
    noted_property("other statements, such as `Ks`, `Ni`, `disp`"),
)
"""Statements of .mtl files."""
_STATEMENTS_WITHOUT_EFFECT = tuple(key.lower() for key in keys_of(MTL_PROPERTIES, "no effect"))
_TEXTURE_ROLE_BY_MTL_ROLE: Mapping[str, Role] = {
    "colour": "colour",
    "roughness": "roughness",
    "metalness": "metalness",
    "emission": "emission",
    "opacity": "opacity",
    "normal": "normal",
}
_NUMBER_REGEX = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_OPTION_PATTERN = re.compile(
    rf"-(?:bm\s+(?P<factor>{_NUMBER_REGEX})"
    rf"|(?P<transform>[ost])(?P<numbers>(?:\s+{_NUMBER_REGEX}(?=\s)){{1,3}})"
    r"|clamp\s+(?P<clamp>\S+)"
    r"|(?P<unused>mm\s+\S+\s+\S+|(?:blendu|blendv|boost|cc|imfchan)\s+\S+)"
    r"|(?:texres|type)\s+\S+)\s+",
    re.IGNORECASE,
)
_NEUTRAL_OPTIONS = ("mm 0 1", "blendu on", "blendv on", "boost 0", "cc off")
_NUMBER_PATTERN = re.compile(_NUMBER_REGEX)
_UDIM_PATTERN = re.compile(r"<udim>|%\(udim\)d", re.IGNORECASE)
_MISSING_FILE_ADVICE = "Put it there, or set maps by options (--colour, --normal, ...)"
_USUAL_KD_VALUES = (0.0, 0.588, 0.64, 0.8, 1.0)  # default values of programs, which accompany a colour map
_MAX_LINE_LENGTH = 4096  # characters
_LIBRARY_LINE = re.compile(r"^[ \t]*mtllib[ \t]([^\n]*)", re.MULTILINE)
_UDIM_COLUMNS, _FIRST_UDIM, _MAX_UDIM = 10, 1001, 1100


@dataclass(frozen=True)
class MtlTexture:
    """Picture that a material of an .mtl file references.

    key : statement that references the picture, such as map_Kd
    name : file name as written
    factor : option -bm, by which the map is multiplied [-]
    scale : option -s along u and v, where v points up
    offset : option -o along u and v
    wrap : how the texture continues beyond the edges of the picture, as the option -clamp states
    unused : options without effect, such as the turbulence -t
    """

    key: str
    name: str
    factor: float = 1.0
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    wrap: Wrap = "repeat"
    unused: tuple[str, ...] = ()

    @property
    def uv_transform(self) -> UvTransform:
        """Return the transform that the options -s and -o state, for uv coordinates with v down."""
        (scale_u, scale_v), (u, v) = self.scale, self.offset
        if (self.scale, self.offset) == ((1.0, 1.0), (0.0, 0.0)):
            return IDENTITY_UV_TRANSFORM
        return scale_u, 0.0, u, 0.0, scale_v, 1.0 - scale_v - v


@dataclass
class MtlMaterial:
    """Material of an .mtl file.

    numbers : dictionary from statement to its numbers, see `NUMERIC_STATEMENTS`
    textures : dictionary from role to picture, see `TEXTURE_ROLES`
    unread : first words of all other statements
    """

    numbers: dict[str, list[float]] = field(default_factory=dict)
    textures: dict[str, MtlTexture] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)

    @property
    def colour(self) -> Colour | None:
        """Return the diffuse colour Kd, taken as linear; None if it is not stated."""
        return parse_colour(self.numbers["kd"]) if "kd" in self.numbers else None


@dataclass
class MaterialLibrary:
    """Materials of an OBJ file by name, and the names of .mtl files that do not exist."""

    materials: dict[str, MtlMaterial] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def read_library(path: Path, obj_text: str) -> MaterialLibrary:
    """Read the .mtl files that an OBJ file references.

    path, obj_text : path and text of the OBJ file
    """
    library, remaining = MaterialLibrary(), limits.MAX_MTL_BYTES
    for listed in library_file_names(obj_text)[: limits.MAX_MTL_FILES]:
        found = find_referenced_file(path, listed)
        names = [listed] if found else listed.split(".mtl ")[: limits.MAX_MTL_FILES]
        for name in names:
            file = find_referenced_file(path, name) or find_referenced_file(path, f"{name}.mtl")
            if file is None:
                library.missing.append(name)
            else:
                data = read_file(file, "material libraries", remaining)
                remaining -= len(data)
                with refuse_parse_errors(file, "material libraries"):
                    library.materials |= _parse_mtl(decode_text(data))
    return library


def library_file_names(obj_text: str) -> list[str]:
    """Return the .mtl file names in the `mtllib` lines of an OBJ text, without duplicates."""
    names = (line[1].strip() for line in _LIBRARY_LINE.finditer(obj_text))
    return [name for name in dict.fromkeys(names) if name]


def _parse_mtl(mtl_text: str) -> dict[str, MtlMaterial]:
    materials: dict[str, MtlMaterial] = {}
    current = MtlMaterial()
    for line in mtl_text.splitlines():
        statement = line.strip().replace("\t", " ")
        if len(line) > _MAX_LINE_LENGTH or not statement or statement.startswith("#"):
            continue
        word, _, value = statement.partition(" ")
        key = word.lower()
        if key == "newmtl":
            current = materials.setdefault(value.strip(), MtlMaterial())
        elif key in TEXTURE_ROLES and value.strip():
            current.textures[TEXTURE_ROLES[key]] = _parse_texture(word, value.strip())
        elif key in NUMERIC_STATEMENTS and len(numbers := _parse_numbers(value)) >= NUMERIC_STATEMENTS[key]:
            current.numbers[key] = numbers
        elif key not in _STATEMENTS_WITHOUT_EFFECT:
            current.unread.append(word)
    return materials


def picture_file_name(texture: MtlTexture, udim_tile: int = _FIRST_UDIM) -> str:
    """Return the file name of a texture's picture; for UDIM tiles, the file name of the tile `udim_tile`."""
    return _UDIM_PATTERN.sub(str(udim_tile), texture.name)


def _parse_numbers(statement: str) -> list[float]:
    words = statement.split()
    return [float(word) for word in words] if all(map(_NUMBER_PATTERN.fullmatch, words)) else []


def _parse_texture(statement_key: str, statement: str) -> MtlTexture:
    """Parse a texture statement of an .mtl file; the file name extends to the end of the line.

    statement_key : first word of the statement, such as map_Kd
    statement : rest of the statement: options, then the file name
    """
    texture, start = MtlTexture(statement_key, ""), 0
    while option := _OPTION_PATTERN.match(statement, start):
        texture, start = _with_option(texture, option), option.end()
    name, factor = statement[start:], texture.factor
    match name.rsplit(maxsplit=2):
        case [first, last, number] if last.lower() == "-bm" and _NUMBER_PATTERN.fullmatch(number):
            factor, name = float(number), first  # some programs write options after the name
    return replace(texture, name=name, factor=factor)


def _with_option(texture: MtlTexture, texture_option: re.Match[str]) -> MtlTexture:
    if texture_option["factor"]:
        return replace(texture, factor=float(texture_option["factor"]))
    if texture_option["clamp"]:
        return replace(texture, wrap="clamp" if texture_option["clamp"].lower() == "on" else "repeat")
    if not texture_option["transform"]:
        words = " ".join((texture_option["unused"] or "").lower().split())
        unused = (f"-{words}",) if words and words not in _NEUTRAL_OPTIONS else ()
        return replace(texture, unused=texture.unused + unused)
    which, numbers = (
        texture_option["transform"].lower(),
        [float(number) for number in texture_option["numbers"].split()],
    )
    if which == "t":
        return replace(texture, unused=(*texture.unused, *["-t"] * any(numbers)))
    u, v = (*numbers, 1.0 if which == "s" else 0.0)[:2]
    return replace(texture, scale=(u, v)) if which == "s" else replace(texture, offset=(u, v))


def with_materials(
    path: Path, mesh_parts: Sequence[MeshPart], library: MaterialLibrary
) -> tuple[list[MeshPart], tuple[FileMaterial, ...], list[str]]:
    """Return the parts of an OBJ file with their materials, and notes on missing pictures.

    Parts whose pictures are a sequence of UDIM tiles are divided into one part for each tile.

    path : path of the OBJ file
    mesh_parts : mesh parts, whose groups have the names of their materials
    library : materials of the .mtl files by name
    """
    materials: list[FileMaterial] = []
    notes = [f"mtllib: {name} is not in its folder. {_MISSING_FILE_ADVICE}" for name in library.missing]
    index: dict[tuple[str, int], int] = {}
    assigned = []
    for part in mesh_parts:
        name = next((name for name in part.group.names if name in library.materials), None)
        if name is None:
            assigned.append(part)
            continue
        own = library.materials[name]
        has_tiles = any(_UDIM_PATTERN.search(texture.name) for texture in own.textures.values())
        for udim, piece in _udim_tiles(part) if has_tiles else ((_FIRST_UDIM, part),):
            if (name, udim) not in index:
                index[name, udim] = len(materials)
                materials.append(_file_material(path, name, own, udim))
            group = replace(piece.group, material=index[name, udim])
            assigned.append(replace(piece, group=group))
    return assigned, tuple(materials), notes


def _udim_tiles(mesh_part: MeshPart) -> list[tuple[int, MeshPart]]:
    """Divide a part by the UDIM tile of each triangle; return the number and the part of each tile."""
    if mesh_part.uv is None or not len(mesh_part.triangles):
        return [(_FIRST_UDIM, mesh_part)]
    column, row = np.floor(mesh_part.uv[mesh_part.triangles].mean(axis=1)).astype(int).T
    number = np.clip(_FIRST_UDIM + column + _UDIM_COLUMNS * row, _FIRST_UDIM, _MAX_UDIM)
    pieces = []
    for udim in np.unique(number).tolist():
        own = number == udim
        position = np.cumsum(own) - 1
        quads = (
            position[mesh_part.quads[own[mesh_part.quads].all(axis=1)]]
            if len(mesh_part.quads)
            else mesh_part.quads
        )
        pieces.append((udim, replace(mesh_part, triangles=mesh_part.triangles[own], quads=quads)))
    return pieces


def _file_material(path: Path, material_name: str, material: MtlMaterial, udim_tile: int) -> FileMaterial:
    """Convert a material of an .mtl file.

    path : path of the OBJ file
    udim_tile : number of the UDIM tile whose pictures are used, if the pictures are a sequence of tiles
    """
    textures, missing, unused = dict[Role, Texture](), dict[str, str](), list(material.unread)
    skin_only = list[str]()
    row, column = divmod(udim_tile - _FIRST_UDIM, _UDIM_COLUMNS)
    for role, texture in material.textures.items():
        written = picture_file_name(texture, udim_tile)
        file = find_referenced_file(path, written)
        if file is None:
            missing[role] = f"{texture.key}: {written} is not in its folder. {_MISSING_FILE_ADVICE}"
        elif role not in _TEXTURE_ROLE_BY_MTL_ROLE:
            skin_only.append(f"picture of {texture.key}")
        else:
            a, b, c, d, e, f = texture.uv_transform
            if written != texture.name:
                c, f = c - column, f + row
            textures[_TEXTURE_ROLE_BY_MTL_ROLE[role]] = Texture(
                file, 0, (a, b, c, d, e, f), (texture.wrap, texture.wrap)
            )
        unused += [f"option {option} of {written}" for option in texture.unused]
    numbers = {key: values[0] for key, values in material.numbers.items()}
    alpha = numbers.get("d", 1.0 - numbers.get("tr", 0.0))
    roughness = numbers.get("pr")
    if roughness is None and "ns" in numbers:
        roughness = (2.0 / (max(numbers["ns"], 0.0) + 2.0)) ** 0.25
    colour = None if material.colour == DEFAULT_COLOUR else material.colour
    if "colour" in textures and colour is not None:
        unused += (
            [] if len(set(colour)) == 1 and round(colour[0], 3) in _USUAL_KD_VALUES else ["Kd beside map_Kd"]
        )
        colour = None
    return FileMaterial(
        material_name,
        textures,
        colour,
        alpha=alpha,
        alpha_mode="blend" if alpha < 1.0 or "opacity" in textures else "opaque",
        roughness=roughness,
        stated_metalness=numbers.get("pm", 1.0 if "metalness" in textures else 0.0),
        emission=parse_colour(material.numbers.get("ke", [float("emission" in textures)] * 3)),
        normal_scale=material.textures["normal"].factor if "normal" in material.textures else 1.0,
        skin_only=tuple(skin_only),
        missing=missing,
        unused=tuple(dict.fromkeys(unused)),
    )
