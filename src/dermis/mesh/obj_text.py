"""The text of OBJ files: what of it is refused before it is parsed, and its groups by number."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.reading import read_file
from dermis.mesh.limits import MOST_BYTES, MOST_CORNERS, MOST_GROUPS, MOST_TRIANGLES, MOST_VERTICES

Index = NDArray[np.int64]

_COMMENTED = re.compile(r"^((?:v[tn]?|f)[ \t][^#\n]*)#[^\n]*", re.MULTILINE)
_NAMED = re.compile(r"^[ \t]*(usemtl|g)(?:[ \t]([^\n]*))?$", re.MULTILINE)
_FACE_OR_NUMBER = re.compile(r"^(?:usemtl (\d+)|f([ \t].*))$", re.MULTILINE)
_LIBRARY = re.compile(r"^[ \t]*mtllib[ \t]([^\n]*)", re.MULTILINE)
_LONGEST, _LONGEST_VERTEX = 1 << 17, 256  # characters of a line
_ZERO = re.compile(r"(?<![^ \t/])0+(?![^ \t/])")
_UNPARSED = re.compile(r"^[ \t]*(usemtl|g|f)(?:[ \t]([^\n]*))?$", re.MULTILINE)


def read_obj_text(path: Path) -> str:
    """The text of a .obj file with line feeds alone.

    Raises DermisError when it cannot be read or is too large.
    """
    text = read_file(path, "an OBJ file", MOST_BYTES).decode("utf-8", errors="replace")
    return text.replace("\r\n", "\n")


def joined_lines(path: Path, text: str) -> str:
    """The text with continued lines joined, and numbers without comments behind them.

    Raises DermisError for lines that are longer than any that means something, and for too many vertices.
    """
    text = text.replace("\\\n", " ")
    _check_lines(path, np.frombuffer(text.encode("utf-8", "replace"), np.uint8))
    commented = text.count("#") != text.count("\n#") + text.startswith("#")
    return _COMMENTED.sub(r"\1", text) if commented else text


def _check_lines(path: Path, data: NDArray[np.uint8]) -> None:
    ends = np.flatnonzero(data == ord("\n"))
    starts = np.concatenate([[0], ends + 1])
    long = np.diff(starts, append=len(data) + 1)
    vertex = data[np.minimum(starts, len(data) - 1)] == ord("v") if len(data) else np.zeros(1, bool)
    if long.max() > _LONGEST or long[vertex].max(initial=0) > _LONGEST_VERTEX:
        came, remedy = f"one has {long.max():,}", "The file is damaged: export it again"
        expected = f"lines of at most {_LONGEST:,} characters, {_LONGEST_VERTEX} for vertices"
        refuse(path, expected, came, remedy)
    if int(vertex.sum()) > 3 * MOST_VERTICES:
        came, remedy = f"it has {int(vertex.sum()):,}", "Decimate it (in Blender: Modifiers > Decimate)"
        refuse(path, f"at most {3 * MOST_VERTICES:,} lines of vertices, uv and normals", came, remedy)


def libraries(text: str) -> list[str]:
    """What its lines `mtllib` say, each once."""
    return list(dict.fromkeys(line[1].strip() for line in _LIBRARY.finditer(text)))


def groups_of_faces(text: str) -> Iterator[tuple[str, str]]:
    """The names `usemtl` and `g` of each face."""
    current = {"usemtl": "", "g": ""}
    for line in _UNPARSED.finditer(text):
        if line[1] == "f":
            yield current["usemtl"], current["g"]
        else:
            current[line[1]] = (line[2] or "").strip()


def numbered(path: Path, text: str) -> tuple[str, list[tuple[str, str]]]:
    """Each `usemtl` and `g` as `usemtl` of a number, one for each pair of names, and these pairs.

    Raises DermisError when they are too many.
    """
    current = {"usemtl": "", "g": ""}
    numbers: dict[tuple[str, str], int] = {("", ""): 0}

    def number(match: re.Match[str]) -> str:
        current[match[1]] = (match[2] or "").strip()
        key = (current["usemtl"], current["g"])
        return f"usemtl {numbers.setdefault(key, len(numbers))}"

    marked = _NAMED.sub(number, text)
    if len(numbers) > MOST_GROUPS:
        came, remedy = f"it has {len(numbers):,}", "Export it with fewer, or without groups"
        refuse(path, f"at most {MOST_GROUPS:,} groups", came, remedy)
    return f"mtllib marked.mtl\nusemtl 0\n{marked}", list(numbers)


def face_sides(path: Path, text: str, groups: int) -> list[Index]:
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
            came = "it has relative (negative) ones"
            refuse(path, "faces by absolute index", came, "Export it again, in Blender")
        if (" 0" in face or "/0" in face or "\t0" in face) and _ZERO.search(face):
            refuse(path, "faces by indices from 1", "it has a 0", "The file is damaged: export it again")
        count = len(face.split())
        current.append(count)
        triangles += max(count - 2, 0)
        if count > MOST_CORNERS or triangles > MOST_TRIANGLES:
            _refuse_faces(path, count)
    return [np.array(one, dtype=np.int64) for one in sides]


def _refuse_faces(path: Path, corners: int) -> None:
    if corners > MOST_CORNERS:
        came = f"one has {corners:,}"
        refuse(path, f"faces of at most {MOST_CORNERS:,} corners", came, "Cut it into smaller ones")
    came, remedy = "it has more", "Decimate it (in Blender: Modifiers > Decimate)"
    refuse(path, f"a mesh of at most {MOST_TRIANGLES:,} triangles", came, remedy)
