"""Reading of mesh files by format, with the reader of PLY files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Index
from dermis.base.errors import refuse
from dermis.base.reading import is_file, parsing, read_file
from dermis.formats import size_limits as limits
from dermis.formats.gltf.triangles import read_gltf
from dermis.formats.mesh_checks import check_arrays, check_counts
from dermis.formats.obj import read_obj
from dermis.formats.parts import MaterialGroup, MeshFile, MeshPart, trimesh_parts

_MAX_HEADER_BYTES = 1 << 16  # bytes
_MAX_ELEMENTS = {"vertex": limits.MAX_VERTICES, "face": limits.MAX_TRIANGLES}
_MAX_PROPERTIES = 256
MAX_ABSOLUTE_UV = 1e4
"""Largest valid absolute uv coordinate; larger ones mean a damaged file, not tiles."""
S = TypeVar("S", np.int64, np.float64)
Origin = Literal["auto", "top", "bottom"]
Up = Literal["y", "z"]


def check_ply(path: Path, data: bytes) -> bytes:
    """Return the header of a PLY file after checking its counts of elements and properties.

    data : bytes of the whole file

    Raises DermisError for an invalid header.
    """
    end = data.find(b"end_header", 0, _MAX_HEADER_BYTES)
    if not data.startswith(b"ply") or end < 0:
        refuse(path, "a PLY file", "it cannot be read (its header is invalid)", limits.DAMAGED_ADVICE)
    header = data[:end]
    lines = [line.split() for line in header.splitlines()]
    properties = sum(line[:1] == [b"property"] for line in lines)
    limits.check_limit(path, properties, _MAX_PROPERTIES, "properties", limits.DAMAGED_ADVICE)
    for line in lines:
        if line[:1] == [b"element"]:
            _check_element(path, line, len(data) - end)
    return header


def _check_element(path: Path, line: list[bytes], remaining_bytes: int) -> None:
    """Refuse an "element" line of a PLY header with an implausible count for a mesh or for the file size.

    line : words of the line
    """
    name, count = (line[1].decode("latin-1"), line[2]) if len(line) == 3 else ("", b"")
    if not (count.isdigit() and len(count) < 12):
        actual = f"got {b' '.join(line)[:80]!r}"
        refuse(path, "elements with a name and a number", actual, limits.DAMAGED_ADVICE)
    limit = min(_MAX_ELEMENTS.get(name, limits.MAX_TRIANGLES), remaining_bytes)
    limits.check_limit(path, int(count), limit, f"elements named {name!r}", limits.DECIMATE_ADVICE)


def read_ply(path: Path) -> MeshFile:
    """Read a .ply file.

    uv are read from the vertex properties s, t or u, v or texture_u, texture_v, or from the face property
    texcoord.
    """
    data = read_file(path, "a PLY file", limits.MAX_FILE_BYTES)
    header = check_ply(path, data)
    # uv coordinates by face corner require split vertices, for which the file's normals may be wrong;
    # for uv by vertex, splitting would drop the normals of files with unused vertices
    by_corner = b"texcoord" in header
    groups = [MaterialGroup((path.stem,))]
    parts = list(trimesh_parts(data, "ply", groups, fix_texture=by_corner, skip_materials=True))
    return MeshFile([replace(part, normals=None) for part in parts] if by_corner else parts)


MESH_READERS: dict[str, Callable[[Path], MeshFile]] = {
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".obj": read_obj,
    ".ply": read_ply,
}


def join_parts(parts: list[MeshPart], source: Path) -> MeshPart:
    """Join mesh parts into one; vertices without normals get NaN."""
    uv = [_part_uv(part, source) for part in parts]
    for part, part_uv in zip(parts, uv, strict=True):
        check_arrays(part.positions, part_uv, part.triangles, source)
    start = np.cumsum([0, *(len(part.positions) for part in parts)])
    faces = np.cumsum([0, *(len(part.triangles) for part in parts)])
    targets: dict[str, list[tuple[Index, Doubles]]] = {}
    for part, offset in zip(parts, start, strict=False):
        for name, (vertex, delta) in part.targets.items():
            targets.setdefault(name, []).append((vertex + offset, delta))
    return MeshPart(
        parts[0].group,
        np.vstack([part.positions for part in parts]),
        np.vstack(uv),
        np.vstack([_part_normals(part) for part in parts]),
        np.vstack([part.triangles + offset for part, offset in zip(parts, start, strict=False)]),
        {
            name: (np.concatenate(i), np.concatenate(d))
            for name, (i, d) in _transpose_targets(targets).items()
        },
        _stack_padded([part.bone for part in parts]),
        _stack_padded([part.weight for part in parts]),
        np.vstack([part.quads + offset for part, offset in zip(parts, faces, strict=False)]),
        colours=_joined_colours(parts),
        other_uv={
            index: _joined_uv(parts, index) for index in sorted(set().union(*(p.other_uv for p in parts)))
        },
    )


def _joined_colours(parts: list[MeshPart]) -> Doubles | None:
    """Return the vertex colours of all parts, white for parts without; None if no part has any."""
    if all(part.colours is None for part in parts):
        return None
    return np.vstack([np.ones_like(p.positions) if p.colours is None else p.colours for p in parts])


def _joined_uv(parts: list[MeshPart], index: int) -> Doubles:
    """Return further uv coordinates of all parts, 0 for parts without."""
    return np.vstack([p.other_uv.get(index, np.zeros((len(p.positions), 2))) for p in parts])


def select_vertices(part: MeshPart, used: Index) -> MeshPart:
    """Return a mesh part with a subset of its vertices, their morph targets and bones.

    used : (n,) indices of the vertices to keep

    Triangles, uv and normals are not changed.
    """
    number = np.full(len(part.positions), -1)
    number[used] = np.arange(len(used))
    targets = {
        name: (number[vertex][number[vertex] >= 0], delta[number[vertex] >= 0])
        for name, (vertex, delta) in part.targets.items()
    }
    bone = None if part.bone is None else part.bone[used]
    weight = None if part.weight is None else part.weight[used]
    return replace(
        part,
        positions=part.positions[used],
        targets=targets,
        bone=bone,
        weight=weight,
        colours=None if part.colours is None else part.colours[used],
        other_uv={index: uv[used] for index, uv in part.other_uv.items()},
    )


def _transpose_targets(
    rows: dict[str, list[tuple[Index, Doubles]]],
) -> dict[str, tuple[list[Index], list[Doubles]]]:
    items = rows.items()
    return {name: ([first for first, _ in own], [second for _, second in own]) for name, own in items}


def _part_normals(part: MeshPart) -> Doubles:
    if part.normals is not None and len(part.normals) == len(part.positions):
        return part.normals
    return np.full(part.positions.shape, np.nan)


def _stack_padded(arrays: list[NDArray[S] | None]) -> NDArray[S] | None:
    """Stack arrays (n, k) vertically, padded with 0 to the largest k; None if one of them is None."""
    present = [array for array in arrays if array is not None]
    if len(present) < len(arrays):
        return None
    width = max(array.shape[1] for array in present)
    return np.vstack([np.pad(array, ((0, 0), (0, width - array.shape[1]))) for array in present])


def _part_uv(part: MeshPart, source: Path) -> Doubles:
    name = part.group.names[0] if part.group.names else "the mesh"
    if part.uv is None:
        return np.zeros((len(part.positions), 2))
    if part.uv.shape != (len(part.positions), 2):
        actual = f"{name!r} has {len(part.uv)} for {len(part.positions)} vertices"
        refuse(source, "uv at every vertex", actual, limits.DAMAGED_ADVICE)
    if not np.abs(part.uv).max() <= MAX_ABSOLUTE_UV:
        actual = f"{name!r} has some that are NaN, infinite or beyond {MAX_ABSOLUTE_UV:g}"
        refuse(source, "finite uv", actual, limits.DAMAGED_ADVICE)
    return part.uv


def read_mesh_file(source: Path) -> MeshFile:
    """Read a mesh file of any supported format, without parts that have no triangles.

    Raises DermisError for every fault of the file.
    """
    reader = MESH_READERS.get(source.suffix.lower())
    if reader is None:
        actual = f"the suffix is {source.suffix!r}"
        refuse(source, f"a mesh file ({', '.join(MESH_READERS)})", actual, "Export it as one of these")
    if not is_file(source):
        refuse(source, "a mesh file", "there is no such file", "Check the path")
    # trimesh raises any exception for damaged files
    with parsing(source, f"a valid {source.suffix} mesh", Exception):
        mesh_file = reader(source)
    parts = [part for part in mesh_file.parts if len(part.triangles)]
    if not parts:
        refuse(source, "a mesh of triangles", "it has none", "Export the head as a polygon mesh")
    skins = [part for part in mesh_file.parts if part.group.name_contains("skin")]
    if skins and not any(len(part.triangles) for part in skins):
        actual = f"skin group {skins[0].group.names[0]!r} has no triangles"
        refuse(source, "a group of triangles that is skin", actual, "Assign its faces to it, or rename it")
    check_counts(parts, source)
    return replace(mesh_file, parts=parts)


def to_y_up(vectors: Doubles, up: Up) -> Doubles:
    """Rotate vectors (v, 3) of a file with up axis `up` to Y up.

    A z-up head faces -Y, as in Blender; this direction becomes +Z.
    """
    return vectors if up == "y" else np.column_stack((vectors[:, 0], vectors[:, 2], -vectors[:, 1]))
