"""Materials of OBJ files, from the .mtl files that these name."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from dermis.base.reading import read_file
from dermis.formats.named_files import beside
from dermis.formats.size_limits import MOST_LIBRARIES, MOST_MTL_BYTES

_ROLES = {"map_kd": "colour", "map_ks": "specular", "map_pr": "roughness", "norm": "normal"}
_ROLES |= {"map_bump": "bump", "bump": "bump"}
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_OPTION = re.compile(
    rf"-(?:bm\s+(?P<factor>{_NUMBER})"
    rf"|(?P<place>[ost])(?P<numbers>(?:\s+{_NUMBER}(?=\s)){{1,3}})"
    r"|mm\s+\S+\s+\S+"
    r"|(?:blendu|blendv|boost|cc|clamp|imfchan|texres|type)\s+\S+)\s+",
    re.IGNORECASE,
)
_WHOLE_NUMBER = re.compile(_NUMBER)
_LONGEST = 4096  # characters of a line
_LIBRARY = re.compile(r"^[ \t]*mtllib[ \t]([^\n]*)", re.MULTILINE)


@dataclass(frozen=True)
class Texture:
    """A picture that a material names.

    key : the statement that names it, such as map_Kd
    factor : by which its values are multiplied (-bm) [-]
    moved : whether it is to be scaled, shifted or made turbulent (-s, -o, -t)
    """

    key: str
    name: str
    factor: float = 1.0
    moved: bool = False


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
    found, left = Library(), MOST_MTL_BYTES
    for told in libraries(text)[:MOST_LIBRARIES]:
        for name in [told] if beside(path, told) else told.split(".mtl ")[:MOST_LIBRARIES]:
            file = beside(path, name) or beside(path, f"{name}.mtl")
            if file is None:
                found.missing.append(name)
            else:
                data = read_file(file, "material libraries", left)
                left -= len(data)
                found.materials |= _materials(data.decode("utf-8", errors="replace"))
    return found


def _materials(text: str) -> dict[str, MtlMaterial]:
    found: dict[str, MtlMaterial] = {}
    current = MtlMaterial()
    for line in text.splitlines():
        if len(line) > _LONGEST:
            continue
        key, _, value = line.strip().replace("\t", " ").partition(" ")
        if key.lower() == "newmtl":
            current = found.setdefault(value.strip(), MtlMaterial())
        elif key.lower() == "kd":
            current.kd = value.split()
        elif key.lower() in _ROLES and value.strip():
            current.textures[_ROLES[key.lower()]] = _texture(key, value.strip())
    return found


def _texture(key: str, rest: str) -> Texture:
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


def libraries(text: str) -> list[str]:
    """What its lines `mtllib` say, each once."""
    return list(dict.fromkeys(line[1].strip() for line in _LIBRARY.finditer(text)))
