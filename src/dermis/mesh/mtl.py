"""Materials of OBJ files: colours and the names of pictures in the .mtl files that they name."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath

_ROLES = {"map_kd": "colour", "map_ks": "specular", "map_pr": "roughness", "norm": "normal"}
_ROLES |= {"map_bump": "bump", "bump": "bump"}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_OPTION = re.compile(
    rf"-(?:bm\s+(?P<factor>{_NUMBER})"
    rf"|(?P<place>[ost])(?P<numbers>(?:\s+{_NUMBER}(?=\s)){{1,3}})"
    r"|mm\s+\S+\s+\S+"
    r"|(?:blendu|blendv|boost|cc|clamp|imfchan|texres|type)\s+\S+)\s+",
    re.IGNORECASE,
)
_LAST = re.compile(rf"\s+-bm\s+(?P<factor>{_NUMBER})$", re.IGNORECASE)


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
    found = Library()
    for told in re.findall(r"^[ \t]*mtllib[ \t]+(.*?)[ \t]*$", text, re.MULTILINE):
        for name in [told] if beside(path, told) else told.split(".mtl "):
            file = beside(path, name) or beside(path, f"{name}.mtl")
            if file is None:
                found.missing.append(name)
            else:
                found.materials |= _materials(file.read_bytes().decode("utf-8", errors="replace"))
    return found


def beside(path: Path, name: str) -> Path | None:
    """The file of that name in the folder of `path` or below it; None for one that is elsewhere or nowhere.

    Names with the separators of Windows will do. Of a name that leads elsewhere the last part is looked for.
    """
    told = PureWindowsPath(name.strip().strip('"'))
    try:
        folder = path.parent.resolve()
        for part in (told, PureWindowsPath(told.name)):
            file = folder.joinpath(*part.parts).resolve()
            if not part.anchor and file.is_relative_to(folder) and file.is_file():
                return file
    except (OSError, ValueError):  # no file can have such a name
        return None
    return None


def _materials(text: str) -> dict[str, MtlMaterial]:
    found: dict[str, MtlMaterial] = {}
    current = MtlMaterial()
    for line in text.splitlines():
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
    factor, moved = 1.0, False
    while option := _OPTION.match(rest):
        factor = float(option["factor"] or factor)
        if option["place"]:
            usual = 1.0 if option["place"] in "sS" else 0.0
            moved |= any(float(number) != usual for number in option["numbers"].split())
        rest = rest[option.end() :]
    if last := _LAST.search(rest):  # as some programs write it
        factor, rest = float(last["factor"]), rest[: last.start()]
    return Texture(key, rest, factor, moved)
