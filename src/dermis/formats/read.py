"""Reading of mesh files of all formats.

The reader for the format of a file returns mesh parts; the functions here choose this reader, check and clean
the parts, and join them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Index
from dermis.base.errors import refuse
from dermis.base.reading import is_file, refuse_parse_errors
from dermis.formats import size_limits as limits
from dermis.formats.mesh_checks import check_arrays, check_mesh_counts
from dermis.formats.mesh_formats import find_format, mesh_suffixes
from dermis.formats.parts import MeshFile, MeshPart
from dermis.mesh.geometry import compact_vertices, expand_runs

MAX_ABSOLUTE_UV = 1e4
"""Largest valid absolute uv coordinate; larger ones are a sign of a damaged file, not of many tiles."""
NumberType = TypeVar("NumberType", np.int64, np.float64)
UvOrigin = Literal["auto", "top", "bottom"]
_BLENDER_ADVICE = "Convert it in Blender: {}File > Export > glTF 2.0"
_UNSUPPORTED_SUFFIXES = (".3ds", ".c4d", ".dae", ".lwo", ".ma", ".max", ".mb", ".wrl", ".x3d", ".zpr", ".ztl")
_SUFFIX_ADVICE = {
    ".fbx": _BLENDER_ADVICE.format("File > Import > FBX, then "),
    ".abc": _BLENDER_ADVICE.format("File > Import > Alembic, then "),
    ".blend": _BLENDER_ADVICE.format(""),
    **dict.fromkeys(_UNSUPPORTED_SUFFIXES, "Export it as glTF (.glb) or OBJ from the program that wrote it"),
}
"""Advice for files of formats that are not read."""


def join_parts(mesh_parts: list[MeshPart], mesh_path: Path) -> MeshPart:
    """Join mesh parts into one mesh part; the normals of vertices without a normal become NaN."""
    uv = [_part_uv(part, mesh_path) for part in mesh_parts]
    for part, part_uv in zip(mesh_parts, uv, strict=True):
        check_arrays(part.positions, part_uv, part.triangles, mesh_path)
    start = np.cumsum([0, *(len(part.positions) for part in mesh_parts)])
    faces = np.cumsum([0, *(len(part.triangles) for part in mesh_parts)])
    targets: dict[str, list[tuple[Index, Doubles]]] = {}
    for part, offset in zip(mesh_parts, start, strict=False):
        for name, (vertex, delta) in part.targets.items():
            targets.setdefault(name, []).append((vertex + offset, delta))
    return MeshPart(
        mesh_parts[0].group,
        np.vstack([part.positions for part in mesh_parts]),
        np.vstack(uv),
        np.vstack([_part_normals(part) for part in mesh_parts]),
        np.vstack([part.triangles + offset for part, offset in zip(mesh_parts, start, strict=False)]),
        {
            name: (np.concatenate(i), np.concatenate(d))
            for name, (i, d) in _transpose_targets(targets).items()
        },
        _stack_padded([part.bone for part in mesh_parts]),
        _stack_padded([part.weight for part in mesh_parts]),
        np.vstack([part.quads + offset for part, offset in zip(mesh_parts, faces, strict=False)]),
        colours=_joined_colours(mesh_parts),
        other_uv={
            index: _joined_uv(mesh_parts, index)
            for index in sorted(set().union(*(p.other_uv for p in mesh_parts)))
        },
    )


def _joined_colours(mesh_parts: list[MeshPart]) -> Doubles | None:
    """Join the vertex colours of all parts; colourless parts become white. None if no part has colours."""
    if all(part.colours is None for part in mesh_parts):
        return None
    return np.vstack([np.ones_like(p.positions) if p.colours is None else p.colours for p in mesh_parts])


def _joined_uv(mesh_parts: list[MeshPart], uv_set: int) -> Doubles:
    """Join an additional uv set of all parts, with zeros for parts that lack this uv set."""
    return np.vstack([p.other_uv.get(uv_set, np.zeros((len(p.positions), 2))) for p in mesh_parts])


def select_vertices(mesh_part: MeshPart, vertices: Index) -> MeshPart:
    """Return a mesh part with selected vertices.

    Their positions, morph targets, bones, colours and additional uv sets are selected. The fields
    `triangles`, `uv` and `normals` are unchanged and thus still refer to the vertices of `mesh_part`.

    vertices : (n,) indices of the selected vertices, possibly repeated
    """
    order, count = (
        np.argsort(vertices, kind="stable"),
        np.bincount(vertices, minlength=len(mesh_part.positions)),
    )
    first, targets = np.cumsum(count) - count, {}
    for name, (vertex, delta) in mesh_part.targets.items():
        row, copy = expand_runs(first[vertex], count[vertex])
        targets[name] = order[copy], delta[row]
    bone = None if mesh_part.bone is None else mesh_part.bone[vertices]
    weight = None if mesh_part.weight is None else mesh_part.weight[vertices]
    return replace(
        mesh_part,
        positions=mesh_part.positions[vertices],
        targets=targets,
        bone=bone,
        weight=weight,
        colours=None if mesh_part.colours is None else mesh_part.colours[vertices],
        other_uv={index: uv[vertices] for index, uv in mesh_part.other_uv.items()},
    )


def _transpose_targets(
    displacements_by_target: dict[str, list[tuple[Index, Doubles]]],
) -> dict[str, tuple[list[Index], list[Doubles]]]:
    items = displacements_by_target.items()
    return {name: ([first for first, _ in own], [second for _, second in own]) for name, own in items}


def _part_normals(mesh_part: MeshPart) -> Doubles:
    if mesh_part.normals is not None and len(mesh_part.normals) == len(mesh_part.positions):
        return mesh_part.normals
    return np.full(mesh_part.positions.shape, np.nan)


def _stack_padded(vertex_arrays: list[NDArray[NumberType] | None]) -> NDArray[NumberType] | None:
    """Stack arrays (n, k) vertically, padded with 0 to the largest k; None if one of the arrays is None."""
    present = [array for array in vertex_arrays if array is not None]
    if len(present) < len(vertex_arrays):
        return None
    width = max(array.shape[1] for array in present)
    return np.vstack([np.pad(array, ((0, 0), (0, width - array.shape[1]))) for array in present])


def _part_uv(mesh_part: MeshPart, mesh_path: Path) -> Doubles:
    name = mesh_part.group.names[0] if mesh_part.group.names else "the mesh"
    if mesh_part.uv is None:
        return np.zeros((len(mesh_part.positions), 2))
    if mesh_part.uv.shape != (len(mesh_part.positions), 2):
        actual = f"{name!r} has {len(mesh_part.uv)} for {len(mesh_part.positions)} vertices"
        refuse(mesh_path, "uv at every vertex", actual, limits.DAMAGED_ADVICE)
    if not np.abs(mesh_part.uv).max() <= MAX_ABSOLUTE_UV:
        actual = f"{name!r} has some that are NaN, infinite or beyond {MAX_ABSOLUTE_UV:g}"
        refuse(mesh_path, "finite uv", actual, limits.DAMAGED_ADVICE)
    return mesh_part.uv


def read_mesh_file(mesh_path: Path) -> MeshFile:
    """Read a mesh file of any supported format; parts without triangles are left out.

    Raises DermisError for every fault of the file.
    """
    mesh_format = find_format(mesh_path)
    if mesh_format is None:
        actual = f"the suffix is {mesh_path.suffix!r}"
        advice = _SUFFIX_ADVICE.get(mesh_path.suffix.lower(), "Export it as one of these")
        refuse(mesh_path, f"a mesh file ({', '.join(mesh_suffixes())})", actual, advice)
    if not is_file(mesh_path):
        refuse(mesh_path, "a mesh file", "there is no such file", "Check the path")
    # readers may raise any exception for damaged files
    with refuse_parse_errors(mesh_path, f"a valid {mesh_path.suffix} mesh", Exception):
        mesh_file = mesh_format.read(mesh_path)
        parts = [_without_unused_vertices(part) for part in mesh_file.parts if len(part.triangles)]
    if not parts:
        refuse(mesh_path, "a mesh of triangles", "it has none", "Export the head as a polygon mesh")
    skins = [part for part in mesh_file.parts if part.group.name_contains("skin")]
    if skins and not any(len(part.triangles) for part in skins):
        actual = f"skin group {skins[0].group.names[0]!r} has no triangles"
        refuse(mesh_path, "a group of triangles that is skin", actual, "Assign its faces to it, or rename it")
    check_mesh_counts(parts, mesh_path)
    lengths = [np.linalg.norm(part.normals, axis=1) for part in parts if part.normals is not None]
    lost = sum(int(np.count_nonzero(~((length > 0) & np.isfinite(length)))) for length in lengths)
    notes = (f"computed {lost:,} normals that are NaN or have no length",) if lost else ()
    return replace(mesh_file, parts=parts, notes=(*mesh_file.notes, *notes))


def _without_unused_vertices(mesh_part: MeshPart) -> MeshPart:
    """Remove unused vertices from a mesh part, as their coordinates may be invalid."""
    count, uv, normals = len(mesh_part.positions), mesh_part.uv, mesh_part.normals
    damaged = any(array is not None and len(array) != count for array in (uv, normals))
    if damaged or mesh_part.triangles.min() < 0 or mesh_part.triangles.max() >= count:
        return mesh_part  # `join_parts` refuses it
    used, triangles = compact_vertices(mesh_part.triangles)
    if len(used) == count:
        return mesh_part
    uv, normals = (None if array is None else array[used] for array in (uv, normals))
    return replace(select_vertices(mesh_part, used), uv=uv, normals=normals, triangles=triangles)
