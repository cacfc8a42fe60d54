"""Loading of mesh files of any unit, up axis and uv origin, kept on disk by their content."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.progress import preparing
from dermis.base.reading import BROKEN, is_file, read_file, understood
from dermis.mesh.cached import Rigged, cached_rigged
from dermis.mesh.check import UV_TOLERANCE, check_amount, check_arrays, check_mesh, check_rig
from dermis.mesh.eye_names import names_eye
from dermis.mesh.formats import Array, Group, Model, Part, default_unit_mm, is_gltf, read_obj, read_ply
from dermis.mesh.geometry import build_mesh, compacted, weld
from dermis.mesh.gltf.geometry import read_gltf
from dermis.mesh.joined import joined, taken
from dermis.mesh.limits import MOST_BYTES
from dermis.mesh.mesh import Material, Mesh
from dermis.mesh.rigging import build_rig, part_points

Origin = Literal["auto", "top", "bottom"]
Up = Literal["y", "z"]

READERS: dict[str, Callable[[Path], Model]] = {
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".obj": read_obj,
    ".ply": read_ply,
}


def load_mesh(
    path: str | Path,
    *,
    unit_mm: float | None = None,
    v_origin: Origin = "auto",
    up: Up = "y",
    opaque: tuple[str, ...] = (),
    eye_groups: tuple[str, ...] = (),
) -> Mesh:
    """The mesh of a file alone; see `load_rigged`."""
    return load_rigged(
        path, unit_mm=unit_mm, v_origin=v_origin, up=up, opaque=opaque, eye_groups=eye_groups
    ).mesh


@preparing("reading the mesh")
def load_rigged(
    path: str | Path,
    *,
    unit_mm: float | None = None,
    v_origin: Origin = "auto",
    up: Up = "y",
    opaque: tuple[str, ...] = (),
    eye_groups: tuple[str, ...] = (),
) -> Rigged:
    """The mesh of a .glb, .gltf, .obj or .ply file, in millimetres, Y up, v down, and what moves it.

    A group (material, or glTF mesh or OBJ `g`) with "skin" in its name is skin and all others are opaque;
    in a file without one, every group is skin. The mesh has passed `check_mesh`; its size is not judged.

    path : the file
    unit_mm : length of the file's unit [mm]; None for the format's own (`default_unit_mm`)
    v_origin : where v = 0 lies in the map by the file, "top" as glTF has it, "bottom" as OBJ and PLY have
        it; "auto" takes the format's standard
    up : the file's axis that points up; with "z" the face looks along -Y, as in Blender
    opaque : names of groups that are not skin, whatever they are called
    eye_groups : names of groups that hold eyeballs, beside those that are called so (`names_eye`)

    Raises `DermisError` when the file is missing, damaged or not a mesh, has no uv, or fails `check_mesh`.
    """
    source = Path(path)
    unit = default_unit_mm(source) if unit_mm is None else float(unit_mm)
    check_options(source, unit, v_origin, up)

    load = partial(_loaded, source, unit, v_origin, up, opaque, eye_groups)
    glb = source.suffix.lower() == ".glb" and is_file(source)
    data = read_file(source, "a mesh file", MOST_BYTES) if glb else b""
    if not data or b'"uri"' in data:  # parts of it lie in other files
        return load()
    named = source.stem  # as a group without a name is
    return cached_rigged(data, repr((named, unit, v_origin, up, opaque, eye_groups)), load)


def _loaded(
    source: Path,
    unit: float,
    v_origin: Origin,
    up: Up,
    opaque: tuple[str, ...],
    eye_groups: tuple[str, ...],
) -> Rigged:
    """The mesh and the rig as they are in the file."""
    with np.errstate(all="ignore"), understood(source, "a mesh", *BROKEN):
        model = read_model(source)
        part, to_head = joined(model.parts, source), np.eye(4)
        assert part.uv is not None and part.normals is not None
        to_head[:3, :3] = upright(unit * np.eye(3), up).T
        place, normals = upright(unit * part.positions, up).astype(np.float32), upright(part.normals, up)
        flat = _v_down(part.uv, source, v_origin).astype(np.float32)
        check_arrays(place, flat, part.triangles, source)
        material, materials = _materials(model.parts, opaque, eye_groups, source)
        used, corners = compacted(part.triangles)
        kept, point = taken(part, used), weld(np.column_stack((place, _company(model.parts)))[used])
        if model.moves:
            point = part_points(point, kept, to_head[:3, :3], source)
        mesh = build_mesh(
            place[used], flat[used], corners, material, materials, normals[used], point, part.quads
        )
        check_mesh(mesh, source)
        rig = build_rig(mesh.positions, point, kept, model.bones, model.weights, to_head, source)
        if rig is not None:
            check_rig(rig, source)
    return Rigged(mesh, rig)


def _company(parts: list[Part]) -> NDArray[np.float32]:
    """(v,) a number for each vertex; those at one place are one point only if they share it."""
    numbers = [number if part.alone else 0 for number, part in enumerate(parts, start=1)]
    return np.repeat(np.array(numbers, np.float32), [len(part.positions) for part in parts])


def check_options(source: Path, unit: float, v_origin: str, up: str) -> None:
    """Refuse options that no file can be read with."""
    if not (math.isfinite(unit) and unit > 0):
        refuse(source, "a unit above 0 mm", f"{unit} came", "Set the millimetres per unit of the file")
    if v_origin not in ("auto", "top", "bottom"):
        refuse(source, "v_origin auto, top or bottom", f"{v_origin!r} came", "Choose one of the three")
    if up not in ("y", "z"):
        refuse(source, "up y or z", f"{up!r} came", "Choose one of the two")


def read_model(source: Path) -> Model:
    """The file as it is; whatever its reader raises on a damaged file becomes a refusal."""
    reader = READERS.get(source.suffix.lower())
    if reader is None:
        came = f"the suffix is {source.suffix!r}"
        refuse(source, f"a mesh file ({', '.join(READERS)})", came, "Export it as one of these")
    if not is_file(source):
        refuse(source, "a mesh file", "there is no such file", "Check the path")
    # a damaged file makes trimesh fail anywhere, with any exception
    with understood(source, f"a sound {source.suffix} mesh", Exception):
        model = reader(source)
    full = [part for part in model.parts if len(part.triangles)]
    if not full:
        refuse(source, "a mesh of triangles", "it has none", "Export the head as a polygon mesh")
    skins = [part for part in model.parts if _has(part.group, "skin")]
    if skins and not any(len(part.triangles) for part in skins):
        came = f"skin group {skins[0].group.names[0]!r} has no triangles"
        refuse(source, "a group of triangles that is skin", came, "Assign its faces to it, or rename it")
    check_amount(full, source)
    return replace(model, parts=full)


def upright(vectors: Array, up: Up) -> Array:
    """`vectors` (v, 3) with Y up: z-up turns about X, so that -Y, Blender's front, becomes +Z."""
    return vectors if up == "y" else np.column_stack((vectors[:, 0], vectors[:, 2], -vectors[:, 1]))


def _v_down(uv: Array, source: Path, v_origin: Origin) -> Array:
    """`uv` (v, 2) with v = 0 in the top row; what misses [0, 1] by rounding only is put back."""
    from_top = v_origin == "top" or (v_origin == "auto" and is_gltf(source))
    down = uv if from_top else np.column_stack((uv[:, 0], 1 - uv[:, 1]))
    inside = np.clip(down, 0, 1)
    return np.where(np.abs(down - inside) <= UV_TOLERANCE, inside, down)


def _materials(
    parts: list[Part], opaque: tuple[str, ...], eye_groups: tuple[str, ...], source: Path
) -> tuple[NDArray[np.int32], tuple[Material, ...]]:
    """Material of each triangle (f,) and the materials, in the order of the file."""
    groups = [part.group if part.group.names else Group((source.stem,), part.group.colour) for part in parts]
    unwanted = _chosen(groups, opaque, "opaque", source)
    eyes = _chosen(groups, eye_groups, "eye_groups", source)
    named = any(_has(group, "skin") for group in groups)
    index: dict[Material, int] = {}
    per_part = []
    for group, chosen, eye in zip(groups, unwanted, eyes, strict=True):
        kind = "opaque" if chosen or (named and not _has(group, "skin")) else "skin"
        made = Material(group.names[0], kind, group.colour, eye=eye or names_eye(group.names))
        per_part.append(index.setdefault(made, len(index)))
    counts = [len(part.triangles) for part in parts]
    return np.repeat(np.array(per_part, dtype=np.int32), counts), tuple(index)


def _chosen(groups: list[Group], names: tuple[str, ...], option: str, source: Path) -> list[bool]:
    """Whether each group is among those that an option names."""
    wanted = {name.casefold() for name in names}
    unknown = wanted - {name.casefold() for group in groups for name in group.names}
    if unknown:
        known = ", ".join(dict.fromkeys(name for group in groups for name in group.names))
        expected = f"{option} to name groups of the file ({known})"
        refuse(source, expected, f"{sorted(unknown)[0]!r} is none", "Check the spelling")
    return [any(name.casefold() in wanted for name in group.names) for group in groups]


def _has(group: Group, word: str) -> bool:
    return any(word in name.casefold() for name in group.names)
