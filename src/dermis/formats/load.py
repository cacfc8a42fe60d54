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
from dermis.base.disk import Arrays, stored
from dermis.base.errors import refuse
from dermis.base.progress import preparing
from dermis.base.reading import BROKEN, is_file, read_file, understood
from dermis.formats.mesh_checks import UV_TOLERANCE, check_arrays, check_mesh, check_rig
from dermis.formats.parts import Group, Part, default_unit_mm, is_gltf
from dermis.formats.read import Origin, Up, joined, read_model, taken, upright
from dermis.formats.rig_from_file import build_rig, part_points
from dermis.formats.size_limits import MOST_BYTES
from dermis.mesh.geometry import compacted, weld
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.outline import Outline
from dermis.mesh.rig import MorphTargets, Rig, Skeleton

_FORM = 5  # raise when `load_rigged` gives other results for the same file
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
_NONE = np.zeros(0, np.float32)
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_PART = "eyes?|eyeballs?|sclerae?|corneas?|iris|irises|pupils?"
_EYE = re.compile(rf"(?:l|r|left|right)?(?:{_PART})(?:l|r|left|right)?", re.IGNORECASE)
_OTHER = re.compile(
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


def _company(parts: list[Part]) -> Floats:
    """(v,) a number for each vertex; those at one place are one point only if they share it."""
    numbers = [number if part.alone else 0 for number, part in enumerate(parts, start=1)]
    return np.repeat(np.array(numbers, np.float32), [len(part.positions) for part in parts])


def _v_down(uv: Doubles, source: Path, v_origin: Origin) -> Doubles:
    """`uv` (v, 2) with v = 0 in the top row; what misses [0, 1] by rounding only is put back."""
    from_top = v_origin == "top" or (v_origin == "auto" and is_gltf(source))
    down = uv if from_top else np.column_stack((uv[:, 0], 1 - uv[:, 1]))
    inside = np.clip(down, 0, 1)
    return np.where(np.abs(down - inside) <= UV_TOLERANCE, inside, down)


def _materials(
    parts: list[Part], opaque: tuple[str, ...], eye_groups: tuple[str, ...], source: Path
) -> tuple[Ints, tuple[Material, ...]]:
    """Material of each triangle (f,) and the materials, in the order of the file."""
    groups = [part.group if part.group.names else Group((source.stem,), part.group.colour) for part in parts]
    unwanted = _chosen(groups, opaque, "opaque", source)
    eyes = _chosen(groups, eye_groups, "eye_groups", source)
    named = any(group.has("skin") for group in groups)
    index: dict[Material, int] = {}
    per_part = []
    for group, chosen, eye in zip(groups, unwanted, eyes, strict=True):
        kind = "opaque" if chosen or (named and not group.has("skin")) else "skin"
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


class Rigged(NamedTuple):
    """A mesh, and the rig that moves its points; None for none."""

    mesh: Mesh
    rig: Rig | None


def cached_rigged(data: bytes, options: str, load: Callable[[], Rigged]) -> Rigged:
    """What `load` makes of a file, kept on disk by its content.

    data : the file, with everything that the mesh is made of
    options : how it is read
    """
    digest = hashlib.sha256(f"{_FORM} {options}".encode())
    digest.update(data)
    return _unpacked(stored("meshes", digest.hexdigest()[:40], _NAMES, lambda: _packed(load())))


def _packed(rigged: Rigged) -> Arrays:
    """All of it as arrays, empty ones for what there is not."""
    mesh, rig = rigged
    told: dict[str, Any] = {"materials": [asdict(material) for material in mesh.materials]}
    arrays = {name: getattr(mesh, name) for name in _MESH} | {"outline": mesh.outline.places_mm}
    rest: Arrays = dict.fromkeys((name for name in _NAMES if name not in arrays), _NONE)
    if rig is not None:
        told |= {"targets": list(rig.targets.names), "bones": None}
        rest["control"] = rig.positions_mm
        rest |= _fields(rig.targets, "target", _TARGETS)
    if rig is not None and rig.skeleton is not None:
        told["bones"] = list(rig.skeleton.names)
        rest |= _fields(rig.skeleton, "bone", _SKELETON)
    return arrays | rest | {"told": np.frombuffer(json.dumps(told).encode(), np.uint8)}


def _fields(thing: MorphTargets | Skeleton, kind: str, names: list[str]) -> Arrays:
    found = {f"{kind} {name}": getattr(thing, name) for name in names}
    return {name: _NONE if array is None else array for name, array in found.items()}


def _unpacked(found: Arrays) -> Rigged:
    told = json.loads(found["told"].tobytes())
    kinds = [Material(**one | {"colour": tuple(one["colour"])}) for one in told["materials"]]
    mesh = Mesh(**{name: found[name] for name in _MESH}, materials=tuple(kinds))
    vars(mesh)["outline"] = Outline(found["outline"])  # finding it imports scipy, which is slower
    if "targets" not in told:
        return Rigged(mesh, None)
    values: dict[str, Numbers | None] = {name: found[f"target {name}"] for name in _TARGETS}
    values["rest"] = values["rest"] if len(found["target rest"]) else None
    targets = MorphTargets(tuple(told["targets"]), **values)  # type: ignore[arg-type]
    if told["bones"] is None:
        return Rigged(mesh, Rig(found["control"], targets))
    skeleton = Skeleton(tuple(told["bones"]), **{name: found[f"bone {name}"] for name in _SKELETON})
    return Rigged(mesh, Rig(found["control"], targets, skeleton))


def names_eye(names: Sequence[str]) -> bool:
    """Whether a group is an eyeball or a part of one: eye, Eye_L, LeftEyeball, sclera, Std_Cornea_R.

    names : of the group, its material's first, which decides where it says either

    Lashes, brows, lids, and films of tears and shadows that lie on the eye are none.
    """
    for name in names:
        words = _WORD.findall(name)
        if any(_OTHER.fullmatch(word) for word in words):
            return False
        if any(_EYE.fullmatch(word) for word in words):
            return True
    return False
