"""Meshes and rigs from files of any unit, up axis and uv origin, kept on disk by their content."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Ints, Numbers
from dermis.base.disk import Arrays, load_or_make
from dermis.base.errors import refuse
from dermis.base.progress import logged_step
from dermis.base.reading import MALFORMED_DATA_ERRORS, is_file, parsing, read_file
from dermis.formats.mesh_checks import UV_TOLERANCE, check_arrays, check_mesh, check_rig
from dermis.formats.parts import MaterialGroup, MeshPart, default_unit_mm, is_gltf
from dermis.formats.read import Origin, Up, join_parts, read_mesh_file, select_vertices, to_y_up
from dermis.formats.rig_from_file import build_rig, split_points
from dermis.formats.size_limits import MAX_FILE_BYTES
from dermis.mesh.geometry import compacted, weld
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.outline import Outline
from dermis.mesh.rig import MorphTargets, Rig, Skeleton

_CACHE_VERSION = 5  # raise when `load_rigged` gives other results for the same file
_MESH = [field.name for field in fields(Mesh) if field.name != "materials"]
_TARGETS = [field.name for field in fields(MorphTargets) if field.name != "names"]
_SKELETON = [field.name for field in fields(Skeleton) if field.name != "names"]
_NAMES = [
    *_MESH,
    "outline",
    "told",
    "control",
    *(f"target {name}" for name in _TARGETS),
    *(f"bone {name}" for name in _SKELETON),
]
_EMPTY = np.zeros(0, np.float32)
_WORD_PATTERN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_EYE_WORDS = "eyes?|eyeballs?|sclerae?|corneas?|iris|irises|pupils?"
_EYE_PATTERN = re.compile(rf"(?:l|r|left|right)?(?:{_EYE_WORDS})(?:l|r|left|right)?", re.IGNORECASE)
_NOT_EYE_PATTERN = re.compile(
    "(?:(?:eye)?(?:lash|brow|lid|socket|shadow|wear|glass|patch|liner|duct)(?:e?s)?|occlusion|tear|tears"
    "|tearline|hairs?|skin|caruncle)",
    re.IGNORECASE,
)


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


@logged_step("reading the mesh")
def load_rigged(
    path: str | Path,
    *,
    unit_mm: float | None = None,
    v_origin: Origin = "auto",
    up: Up = "y",
    opaque: tuple[str, ...] = (),
    eye_groups: tuple[str, ...] = (),
) -> RiggedMesh:
    """The mesh of a .glb, .gltf, .obj or .ply file, in millimetres, Y up, v down, and what moves it.

    A group (material, or glTF mesh or OBJ `g`) with "skin" in its name is skin and all others are opaque;
    in a file without one, every group is skin. The mesh has passed `check_mesh`; its size is not judged.

    path : the file
    unit_mm : length of the file's unit [mm]; None for the format's own (`default_unit_mm`)
    v_origin : where v = 0 lies in the map by the file, "top" as glTF has it, "bottom" as OBJ and PLY have
        it; "auto" takes the format's standard
    up : the file's axis that points up; with "z" the face looks along -Y, as in Blender
    opaque : names of groups that are not skin, whatever they are called
    eye_groups : names of groups that hold eyeballs, beside those that are called so (`is_eye_name`)

    Raises `DermisError` when the file is missing, damaged or not a mesh, has no uv, or fails `check_mesh`.
    """
    source = Path(path)
    unit = default_unit_mm(source) if unit_mm is None else float(unit_mm)
    load = partial(_load, source, unit, v_origin, up, opaque, eye_groups)
    glb = source.suffix.lower() == ".glb" and is_file(source)
    data = read_file(source, "a mesh file", MAX_FILE_BYTES) if glb else b""
    if not data or b'"uri"' in data:  # parts of it lie in other files
        return load()
    named = source.stem  # as a group without a name is
    return cached_rigged(data, repr((named, unit, v_origin, up, opaque, eye_groups)), load)


def _load(
    source: Path,
    unit: float,
    v_origin: Origin,
    up: Up,
    opaque: tuple[str, ...],
    eye_groups: tuple[str, ...],
) -> RiggedMesh:
    """The mesh and the rig as they are in the file."""
    with np.errstate(all="ignore"), parsing(source, "a mesh", *MALFORMED_DATA_ERRORS):
        model = read_mesh_file(source)
        part, to_head = join_parts(model.parts, source), np.eye(4)
        assert part.uv is not None and part.normals is not None
        to_head[:3, :3] = to_y_up(unit * np.eye(3), up).T
        place, normals = to_y_up(unit * part.positions, up).astype(np.float32), to_y_up(part.normals, up)
        flat = _uv_from_top(part.uv, source, v_origin).astype(np.float32)
        check_arrays(place, flat, part.triangles, source)
        material, materials = _materials(model.parts, opaque, eye_groups, source)
        used, corners = compacted(part.triangles)
        kept, point = (
            select_vertices(part, used),
            weld(np.column_stack((place, _separation_numbers(model.parts)))[used]),
        )
        if model.is_deformable:
            point = split_points(point, kept, to_head[:3, :3], source)
        mesh = build_mesh(
            place[used], flat[used], corners, material, materials, normals[used], point, part.quads
        )
        check_mesh(mesh, source)
        rig = build_rig(mesh.positions, point, kept, model.bones, model.weights, to_head, source)
        if rig is not None:
            check_rig(rig, source)
    return RiggedMesh(mesh, rig)


def _separation_numbers(parts: list[MeshPart]) -> Floats:
    """(v,) a number for each vertex; those at one place are one point only if they share it."""
    numbers = [number if part.separate else 0 for number, part in enumerate(parts, start=1)]
    return np.repeat(np.array(numbers, np.float32), [len(part.positions) for part in parts])


def _uv_from_top(uv: Doubles, source: Path, v_origin: Origin) -> Doubles:
    """`uv` (v, 2) with v = 0 in the top row; what misses [0, 1] by rounding only is put back."""
    from_top = v_origin == "top" or (v_origin == "auto" and is_gltf(source))
    down = uv if from_top else np.column_stack((uv[:, 0], 1 - uv[:, 1]))
    inside = np.clip(down, 0, 1)
    return np.where(np.abs(down - inside) <= UV_TOLERANCE, inside, down)


def _materials(
    parts: list[MeshPart], opaque: tuple[str, ...], eye_groups: tuple[str, ...], source: Path
) -> tuple[Ints, tuple[Material, ...]]:
    """Material of each triangle (f,) and the materials, in the order of the file."""
    groups = [
        part.group if part.group.names else MaterialGroup((source.stem,), part.group.colour) for part in parts
    ]
    unwanted = _match_groups(groups, opaque, "opaque", source)
    eyes = _match_groups(groups, eye_groups, "eye_groups", source)
    named = any(group.name_contains("skin") for group in groups)
    index: dict[Material, int] = {}
    per_part = []
    for group, chosen, eye in zip(groups, unwanted, eyes, strict=True):
        kind = "opaque" if chosen or (named and not group.name_contains("skin")) else "skin"
        made = Material(group.names[0], kind, group.colour, eye=eye or is_eye_name(group.names))
        per_part.append(index.setdefault(made, len(index)))
    counts = [len(part.triangles) for part in parts]
    return np.repeat(np.array(per_part, dtype=np.int32), counts), tuple(index)


def _match_groups(
    groups: list[MaterialGroup], names: tuple[str, ...], option: str, source: Path
) -> list[bool]:
    """Whether each group is among those that an option names."""
    wanted = {name.casefold() for name in names}
    unknown = wanted - {name.casefold() for group in groups for name in group.names}
    if unknown:
        known = ", ".join(dict.fromkeys(name for group in groups for name in group.names))
        expected = f"{option} to name groups of the file ({known})"
        refuse(source, expected, f"{sorted(unknown)[0]!r} is none", "Check the spelling")
    return [any(name.casefold() in wanted for name in group.names) for group in groups]


class RiggedMesh(NamedTuple):
    """A mesh, and the rig that moves its points; None for none."""

    mesh: Mesh
    rig: Rig | None


def cached_rigged(data: bytes, options: str, load: Callable[[], RiggedMesh]) -> RiggedMesh:
    """What `load` makes of a file, kept on disk by its content.

    data : the file, with everything that the mesh is made of
    options : how it is read
    """
    digest = hashlib.sha256(f"{_CACHE_VERSION} {options}".encode())
    digest.update(data)
    return _from_arrays(load_or_make("meshes", digest.hexdigest()[:40], _NAMES, lambda: _to_arrays(load())))


def _to_arrays(rigged: RiggedMesh) -> Arrays:
    """All of it as arrays, empty ones for what there is not."""
    mesh, rig = rigged
    told: dict[str, Any] = {"materials": [asdict(material) for material in mesh.materials]}
    arrays = {name: getattr(mesh, name) for name in _MESH} | {"outline": mesh.outline.places_mm}
    rest: Arrays = dict.fromkeys((name for name in _NAMES if name not in arrays), _EMPTY)
    if rig is not None:
        told |= {"targets": list(rig.targets.names), "bones": None}
        rest["control"] = rig.positions_mm
        rest |= _prefixed_fields(rig.targets, "target", _TARGETS)
    if rig is not None and rig.skeleton is not None:
        told["bones"] = list(rig.skeleton.names)
        rest |= _prefixed_fields(rig.skeleton, "bone", _SKELETON)
    return arrays | rest | {"told": np.frombuffer(json.dumps(told).encode(), np.uint8)}


def _prefixed_fields(thing: MorphTargets | Skeleton, kind: str, names: list[str]) -> Arrays:
    found = {f"{kind} {name}": getattr(thing, name) for name in names}
    return {name: _EMPTY if array is None else array for name, array in found.items()}


def _from_arrays(found: Arrays) -> RiggedMesh:
    told = json.loads(found["told"].tobytes())
    kinds = [Material(**one | {"colour": tuple(one["colour"])}) for one in told["materials"]]
    mesh = Mesh(**{name: found[name] for name in _MESH}, materials=tuple(kinds))
    vars(mesh)["outline"] = Outline(found["outline"])  # finding it imports scipy, which is slower
    if "targets" not in told:
        return RiggedMesh(mesh, None)
    values: dict[str, Numbers | None] = {name: found[f"target {name}"] for name in _TARGETS}
    values["rest"] = values["rest"] if len(found["target rest"]) else None
    targets = MorphTargets(tuple(told["targets"]), **values)  # type: ignore[arg-type]
    if told["bones"] is None:
        return RiggedMesh(mesh, Rig(found["control"], targets))
    skeleton = Skeleton(tuple(told["bones"]), **{name: found[f"bone {name}"] for name in _SKELETON})
    return RiggedMesh(mesh, Rig(found["control"], targets, skeleton))


def is_eye_name(names: Sequence[str]) -> bool:
    """Whether a group is an eyeball or a part of one: eye, Eye_L, LeftEyeball, sclera, Std_Cornea_R.

    names : of the group, its material's first, which decides where it says either

    Lashes, brows, lids, and films of tears and shadows that lie on the eye are none.
    """
    for name in names:
        words = _WORD_PATTERN.findall(name)
        if any(_NOT_EYE_PATTERN.fullmatch(word) for word in words):
            return False
        if any(_EYE_PATTERN.fullmatch(word) for word in words):
            return True
    return False
