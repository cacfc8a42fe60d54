"""PLY files, whose header is checked before their elements are read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from dermis.base.errors import refuse
from dermis.base.reading import read_file
from dermis.formats.parts import Group, Model, trimesh_parts
from dermis.formats.size_limits import MOST_BYTES, MOST_TRIANGLES, MOST_VERTICES

_MOST_HEADER = 1 << 16  # bytes
_MOST = {"vertex": MOST_VERTICES, "face": MOST_TRIANGLES}
_MOST_PROPERTIES = 256
_DAMAGED = "The file is damaged: export it again"


def check_ply(path: Path, data: bytes) -> bytes:
    """The header of a PLY file whose numbers of elements and properties are those of a mesh.

    data : the whole file

    Raises DermisError for others.
    """
    end = data.find(b"end_header", 0, _MOST_HEADER)
    if not data.startswith(b"ply") or end < 0:
        refuse(path, "a PLY file", "it cannot be read (its header does not begin or end as one)", _DAMAGED)
    header = data[:end]
    lines = [line.split() for line in header.splitlines()]
    properties = sum(line[:1] == [b"property"] for line in lines)
    if properties > _MOST_PROPERTIES:
        refuse(path, f"a PLY file of at most {_MOST_PROPERTIES} properties", f"it has {properties}", _DAMAGED)
    for line in lines:
        if line[:1] == [b"element"]:
            _check_element(path, line, len(data) - end)
    return header


def _check_element(path: Path, line: list[bytes], left: int) -> None:
    """Refuse an element of which there are more than may be, or than bytes are left for."""
    name, count = (line[1].decode("latin-1"), line[2]) if len(line) == 3 else ("", b"")
    if not (count.isdigit() and len(count) < 12):
        refuse(path, "elements with a name and a number", f"{b' '.join(line)[:80]!r} came", _DAMAGED)
    most = min(_MOST.get(name, MOST_TRIANGLES), left)
    if int(count) > most:
        came, remedy = f"its header says {int(count):,}", "Decimate it (in Blender: Modifiers > Decimate)"
        refuse(path, f"at most {most:,} elements called {name!r}", came, remedy)


def read_ply(path: Path) -> Model:
    """The one part of a .ply file; uv from the vertex properties s, t or u, v or texture_u, texture_v."""
    data = read_file(path, "a PLY file", MOST_BYTES)
    header = check_ply(path, data)
    # uv by face corner need vertices split, after which normals need not fit them any more; uv by vertex
    # do not, and splitting would drop the normals as soon as one vertex is unused
    by_corner = b"texcoord" in header
    parts = list(
        trimesh_parts(data, "ply", [Group((path.stem,))], fix_texture=by_corner, skip_materials=True)
    )
    return Model([replace(part, normals=None) for part in parts] if by_corner else parts)
