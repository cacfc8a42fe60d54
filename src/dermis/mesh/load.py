"""Loading of mesh files of any unit, up axis and uv origin, kept on disk by their content."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.disk import Arrays, stored
from dermis.errors import DermisError, refuse
from dermis.mesh.check import UV_TOLERANCE, check_arrays, check_mesh
from dermis.mesh.formats import READERS, Group, Part, default_unit_mm, is_gltf
from dermis.mesh.geometry import build_mesh
from dermis.mesh.mesh import Material, Mesh
from dermis.mesh.outline import Outline

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Origin = Literal["auto", "top", "bottom"]
Up = Literal["y", "z"]

FARTHEST_UV = 1e4
"""uv beyond this are damaged data, not tiles."""
_FORM = 2  # increment when `load_mesh` gives other results for the same file


def load_mesh(
    path: str | Path,
    *,
    unit_mm: float | None = None,
    v_origin: Origin = "auto",
    up: Up = "y",
    opaque: tuple[str, ...] = (),
) -> Mesh:
    """The mesh of a .glb, .gltf, .obj or .ply file: millimetres, Y up, v down.

    A group (material, or glTF mesh or OBJ `g`) with "skin" in its name is skin and all others are opaque;
    in a file without one, every group is skin. The mesh has passed `check_mesh`; its size is not judged.

    path : the file
    unit_mm : length of the file's unit [mm]; None for the format's own (`default_unit_mm`)
    v_origin : where the file has v = 0 in the map: "top" as in glTF, "bottom" as in OBJ and PLY; "auto" takes
        the format's standard
    up : the file's axis that points up; with "z" the face looks along -Y, as in Blender
    opaque : names of groups that are not skin, even with "skin" in their name

    Raises `DermisError` when the file is missing, damaged or not a mesh, has no uv, or fails `check_mesh`.
    """
    source = Path(path)
    unit = default_unit_mm(source) if unit_mm is None else float(unit_mm)
    _check_options(source, unit, v_origin, up)

    load = partial(_loaded, source, unit, v_origin, up, opaque)
    data = source.read_bytes() if source.suffix.lower() == ".glb" and source.is_file() else b""
    if not data or b'"uri"' in data:  # parts of it lie in other files
        return load()
    named = source.stem  # the name of groups without one
    return cached_mesh(data, repr((named, unit, v_origin, up, opaque)), load)


def _loaded(source: Path, unit: float, v_origin: Origin, up: Up, opaque: tuple[str, ...]) -> Mesh:
    """The mesh as it is in the file."""
    with np.errstate(all="ignore"):
        parts = _read(source)
        positions, uv, normals, triangles, quads = _joined(parts, source)
        place, normals = _upright(unit * positions, up).astype(np.float32), _upright(normals, up)
        flat = _v_down(uv, source, v_origin).astype(np.float32)
        check_arrays(place, flat, triangles, source)
    material, materials = _materials(parts, opaque, source)
    used, compact = np.unique(triangles, return_inverse=True)
    corners = compact.reshape(-1, 3)
    mesh = build_mesh(place[used], flat[used], corners, material, materials, normals[used], quads=quads)
    check_mesh(mesh, source)
    return mesh


def _check_options(source: Path, unit: float, v_origin: str, up: str) -> None:
    if not (math.isfinite(unit) and unit > 0):
        refuse(source, "a unit above 0 mm", f"{unit} came", "Set the millimetres per unit of the file")
    if v_origin not in ("auto", "top", "bottom"):
        refuse(source, "v_origin auto, top or bottom", f"{v_origin!r} came", "Choose one of the three")
    if up not in ("y", "z"):
        refuse(source, "up y or z", f"{up!r} came", "Choose one of the two")


def _read(source: Path) -> list[Part]:
    """The file's parts; whatever its reader raises on a damaged file becomes a refusal."""
    reader = READERS.get(source.suffix.lower())
    if reader is None:
        came = f"the suffix is {source.suffix!r}"
        refuse(source, f"a mesh file ({', '.join(READERS)})", came, "Export it as one of these")
    if not source.is_file():
        refuse(source, "a mesh file", "there is no such file", "Check the path")
    try:
        parts = reader(source)
    except DermisError:
        raise
    # a damaged file makes the reader fail anywhere, with any exception
    except Exception as error:
        came = f"it cannot be read ({f'{type(error).__name__}: {error}'.splitlines()[0][:200]})"
        remedy = "The file is damaged or cut short: export it again"
        refuse(source, f"a sound {source.suffix} mesh", came, remedy)
    full = [part for part in parts if len(part.triangles)]
    if not full:
        refuse(source, "a mesh of triangles", "it has none", "Export the head as a polygon mesh")
    skins = [part for part in parts if _has(part.group, "skin")]
    if skins and not any(len(part.triangles) for part in skins):
        came = f"skin group {skins[0].group.names[0]!r} has no triangles"
        refuse(source, "a group of triangles that is skin", came, "Assign its faces to it, or rename it")
    return full


def _joined(parts: list[Part], source: Path) -> tuple[Array, Array, Array, Index, Index]:
    """Positions, uv, normals (NaN where the file has none), triangles and quads of all parts together."""
    positions, uvs, normals, triangles, offset = [], [], [], [], 0
    for part in parts:
        count = len(part.positions)
        uvs.append(_part_uv(part, source))
        check_arrays(part.positions, part.uv if part.uv is not None else uvs[-1], part.triangles, source)
        positions.append(part.positions)
        given = part.normals if part.normals is not None and len(part.normals) == count else None
        normals.append(np.full((count, 3), np.nan) if given is None else given)
        triangles.append(part.triangles + offset)
        offset += count
    first = np.cumsum([0, *map(len, triangles)])
    quads = np.vstack([part.quads + begin for part, begin in zip(parts, first, strict=False)])
    return np.vstack(positions), np.vstack(uvs), np.vstack(normals), np.vstack(triangles), quads


def _part_uv(part: Part, source: Path) -> Array:
    name = part.group.names[0] if part.group.names else "the mesh"
    if part.uv is None or part.uv.shape != (len(part.positions), 2):
        remedy = "Unwrap it (in Blender: Edit Mode, U > Unwrap) and export with uv"
        refuse(source, "uv at every vertex", f"{name!r} has none", remedy)
    if not np.abs(part.uv).max() <= FARTHEST_UV:
        came = f"{name!r} has some that are NaN, infinite or beyond {FARTHEST_UV:g}"
        refuse(source, "finite uv", came, "The file is damaged: export it again")
    return part.uv


def _upright(vectors: Array, up: Up) -> Array:
    """`vectors` (v, 3) with Y up: z-up turns about X, so that -Y, Blender's front, becomes +Z."""
    return vectors if up == "y" else np.column_stack((vectors[:, 0], vectors[:, 2], -vectors[:, 1]))


def _v_down(uv: Array, source: Path, v_origin: Origin) -> Array:
    """`uv` (v, 2) with v = 0 in the top row; what misses [0, 1] only by rounding is clamped."""
    from_top = v_origin == "top" or (v_origin == "auto" and is_gltf(source))
    down = uv if from_top else np.column_stack((uv[:, 0], 1 - uv[:, 1]))
    inside = np.clip(down, 0, 1)
    return np.where(np.abs(down - inside) <= UV_TOLERANCE, inside, down)


def _materials(
    parts: list[Part], opaque: tuple[str, ...], source: Path
) -> tuple[NDArray[np.int32], tuple[Material, ...]]:
    """Material of each triangle (f,) and the materials, in the order of the file."""
    groups = [part.group if part.group.names else Group((source.stem,), part.group.colour) for part in parts]
    unwanted = {name.casefold() for name in opaque}
    unknown = unwanted - {name.casefold() for group in groups for name in group.names}
    if unknown:
        known = ", ".join(dict.fromkeys(name for group in groups for name in group.names))
        expected = f"opaque to name groups of the file ({known})"
        refuse(source, expected, f"{sorted(unknown)[0]!r} is none", "Check the spelling")
    named = any(_has(group, "skin") for group in groups)
    index: dict[Material, int] = {}
    per_part = []
    for group in groups:
        chosen = any(name.casefold() in unwanted for name in group.names)
        kind = "opaque" if chosen or (named and not _has(group, "skin")) else "skin"
        per_part.append(index.setdefault(Material(group.names[0], kind, group.colour), len(index)))
    counts = [len(part.triangles) for part in parts]
    return np.repeat(np.array(per_part, dtype=np.int32), counts), tuple(index)


def _has(group: Group, word: str) -> bool:
    return any(word in name.casefold() for name in group.names)


def cached_mesh(data: bytes, options: str, load: Callable[[], Mesh]) -> Mesh:
    """The mesh that `load` returns for a file, kept on disk by the file's content.

    data : bytes of the file, on which alone the mesh depends
    options : how it is read
    """
    arrays = [field.name for field in fields(Mesh) if field.name != "materials"]

    def make() -> Arrays:
        mesh = load()
        told = json.dumps([asdict(material) for material in mesh.materials]).encode()
        return {name: getattr(mesh, name) for name in arrays} | {
            "outline": mesh.outline.places_mm,
            "materials": np.frombuffer(told, np.uint8),
        }

    digest = hashlib.sha256(f"{_FORM} {options}".encode())
    digest.update(data)
    found = stored("meshes", digest.hexdigest()[:40], [*arrays, "outline", "materials"], make)
    materials = json.loads(found.pop("materials").tobytes())
    outline = Outline(found.pop("outline"))
    mesh = Mesh(
        **found,
        materials=tuple(Material(one["name"], one["kind"], tuple(one["colour"])) for one in materials),
    )
    vars(mesh)["outline"] = outline  # importing scipy to find it takes longer
    return mesh
