"""Loading of meshes and rigs from files with any unit, up axis and uv origin, with a disk cache."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields, replace
from functools import partial
from itertools import compress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Mask, Numbers
from dermis.base.disk import Arrays, load_or_make
from dermis.base.errors import refuse
from dermis.base.progress import logged_step
from dermis.base.reading import MALFORMED_DATA_ERRORS, is_file, read_file, refuse_parse_errors
from dermis.formats.axes import Axes, Axis, Front, head_axis_in_file, to_y_up
from dermis.formats.materials import FileMaterial
from dermis.formats.mesh_checks import UV_TOLERANCE, check_arrays, check_mesh, check_rig
from dermis.formats.mesh_repair import RawMesh, repair_mesh
from dermis.formats.parts import MaterialGroup, MeshFile, MeshPart, default_unit_mm, is_binary_gltf, is_gltf
from dermis.formats.read import UvOrigin, join_parts, read_mesh_file, select_vertices
from dermis.formats.rig_from_file import build_rig, split_points
from dermis.formats.size_limits import MAX_FILE_BYTES
from dermis.formats.skin_groups import choose_skin, describe_skin_groups
from dermis.formats.text_files import join_names
from dermis.mesh.face_direction import face_direction
from dermis.mesh.file_vertices import FileVertices
from dermis.mesh.geometry import compact_vertices, weld
from dermis.mesh.mesh import Material, Mesh
from dermis.mesh.outline import Outline
from dermis.mesh.rig import MorphTargets, Rig, Skeleton

_CACHE_VERSION = 9  # increment when `load_rigged` returns other results for the same file
_MESH_FIELDS = [field.name for field in fields(Mesh) if field.name != "materials"]
_TARGET_FIELDS = [field.name for field in fields(MorphTargets) if field.name != "names"]
_SKELETON_FIELDS = [field.name for field in fields(Skeleton) if field.name != "names"]
_ARRAY_NAMES = [
    *_MESH_FIELDS,
    "outline",
    "colours",
    "other uv",
    "file vertex",
    "metadata",
    "control",
    *(f"target {name}" for name in _TARGET_FIELDS),
    *(f"bone {name}" for name in _SKELETON_FIELDS),
]
_ABSENT_FIELD = np.zeros(0, np.float32)
_WORD_PATTERN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_EYE_WORDS = "eyes?|eyeballs?|sclerae?|corneas?|iris|irises|pupils?"
_EYE_PATTERN = re.compile(rf"(?:l|r|left|right)?(?:{_EYE_WORDS})(?:l|r|left|right)?", re.IGNORECASE)
_NOT_EYE_PATTERN = re.compile(
    "(?:(?:eye)?(?:lash|brow|lid|socket|shadow|wear|glass|patch|liner|duct)(?:e?s)?|occlusion|tear|tears"
    "|tearline|hairs?|skin|caruncle)",
    re.IGNORECASE,
)


@logged_step("reading the mesh")
def load_rigged(
    path: str | Path,
    *,
    unit_mm: float | None = None,
    v_origin: UvOrigin = "auto",
    up: Axis | None = None,
    front: Front = "auto",
    skin_groups: tuple[str, ...] = (),
    opaque: tuple[str, ...] = (),
    eye_groups: tuple[str, ...] = (),
) -> RiggedMesh:
    """Load the mesh and the rig of a file in one of `MESH_FORMATS`, in millimetres, with Y up and v down.

    `choose_skin` finds the groups (materials, glTF meshes or OBJ `g`) that are skin; all other groups are
    opaque. The mesh is checked by `check_mesh`. This function does not check whether the mesh is as large
    as a human head.

    unit_mm : length of the file's unit [mm]; None for the unit stated by the file or its format
        (`default_unit_mm`)
    v_origin : edge of textures at v = 0, "top" as in glTF, "bottom" as in OBJ and PLY; "auto" selects by
        format
    up : axis of the file that points upwards, see `to_y_up`; by default the axis that the file states
    front : axis of the file along which the face looks; by default the axis that `face_direction` finds
    skin_groups : names of the groups that are skin; empty to detect them
    opaque : names of groups that are not skin
    eye_groups : names of groups that contain eyeballs, besides the groups found by `is_eye_name`

    Raises `DermisError` when the file is missing, damaged or not a mesh, or fails `check_mesh`.
    """
    source = Path(path)
    unit = None if unit_mm is None else float(unit_mm)
    groups = GroupNames(skin_groups, opaque, eye_groups)
    axes = Axes(up, front)
    load = partial(_load_uncached, source, unit, v_origin, axes, groups)
    is_glb = is_binary_gltf(source) and is_file(source)
    data = read_file(source, "a mesh file", MAX_FILE_BYTES) if is_glb else b""
    if not data or b'"uri"' in data:  # such meshes depend on other files
        return load()
    default_name = source.stem  # name of groups that have none
    return cached_rigged(data, repr((default_name, unit, v_origin, axes, groups)), load)


def _load_uncached(
    mesh_path: Path,
    unit_mm: float | None,
    v_origin: UvOrigin,
    axes: Axes,
    groups: GroupNames,
) -> RiggedMesh:
    """Load mesh and rig without the disk cache; for the parameters see `load_rigged`."""
    with np.errstate(all="ignore"), refuse_parse_errors(mesh_path, "a mesh", *MALFORMED_DATA_ERRORS):
        mesh_file = read_mesh_file(mesh_path)
        stated_mm = mesh_file.unit_mm or default_unit_mm(mesh_path)
        unit = stated_mm if unit_mm is None else unit_mm
        assigned, note = _assign_materials(mesh_file, groups, mesh_path)
        part, to_head = join_parts(mesh_file.parts, mesh_path), np.eye(4)
        counts = [len(part.triangles) for part in mesh_file.parts]
        material = np.repeat(np.array(assigned.of_part, np.int32), counts)
        axes, turned = _find_front(
            _resolve_axes(axes, mesh_file.axes, mesh_path), mesh_file, part, assigned.is_skin[material]
        )
        assert part.uv is not None and part.normals is not None
        to_head[:3, :3] = to_y_up(unit * np.eye(3), axes).T
        positions = to_y_up(unit * part.positions, axes).astype(np.float32)
        normals = to_y_up(part.normals, axes)
        uv = _uv_from_top(part.uv, mesh_path, v_origin).astype(np.float32)
        check_arrays(positions, uv, part.triangles, mesh_path)
        used, corners = compact_vertices(part.triangles)
        vertices = select_vertices(part, used)
        point = weld(np.column_stack((positions, _weld_groups(mesh_file.parts)))[used])
        if mesh_file.is_deformable:
            point = split_points(point, vertices, to_head[:3, :3], mesh_path)
        arrays = positions[used], normals[used], uv[used], point, corners, material, part.quads, vertices
        in_file = [mesh_file.materials[index] if index >= 0 else None for index in assigned.in_file]
        raw, repairs = repair_mesh(RawMesh(*arrays, np.arange(len(used))), in_file, assigned.is_skin)
        raw, assigned, emptied = _without_empty_materials(raw, assigned)
        mesh, vertices, point = raw.build_mesh(assigned.materials), raw.vertices, raw.point
        has_pictures = any(one.textures for one in mesh_file.materials)
        check_mesh(mesh, mesh_path, has_pictures=has_pictures)
        rig = build_rig(
            mesh.positions, point, vertices, mesh_file.bones, mesh_file.weights, to_head, mesh_path
        )
        if rig is not None:
            check_rig(rig, mesh_path)
    notes = (*filter(None, (note, turned)), *mesh_file.notes, *repairs, *emptied)
    colours = None if vertices.colours is None else vertices.colours.astype(np.float32)
    other_uv = {index: own.astype(np.float32) for index, own in vertices.other_uv.items()}
    surface = FileSurfaceData(assigned.in_file, assigned.has_uv, colours, other_uv)
    file_vertices = FileVertices(
        len(used), raw.file_vertex.astype(np.int32), mesh.point, mesh.triangles, to_y_up(np.eye(3), axes).T
    )
    return RiggedMesh(mesh, rig, notes, surface, mesh_file.materials, stated_mm, file_vertices)


def _resolve_axes(user_axes: Axes, file_axes: Axes, mesh_path: Path) -> Axes:
    """Return the axes that the user chose, with unknown axes replaced by those that the file states.

    Raises DermisError if the front is parallel to the up axis.
    """
    axes = user_axes.fill_unknown_from(file_axes)
    if axes.front_or_default[-1] == axes.up_or_default[-1]:
        actual = f"front is {axes.front}, and up is {axes.up_or_default} in the file"
        refuse(mesh_path, "a front across the up axis of the file", actual, "Choose another front")
    return axes


def _find_front(
    axes: Axes, mesh_file: MeshFile, joined_part: MeshPart, skin_triangles: Mask
) -> tuple[Axes, str]:
    """Detect the front axis from the shape of the mesh; return the axes with this front, and a note.

    The axes are unchanged, and the note is empty, if the front is already known, if this package wrote the
    file, if no front is detected, or if the detected front is the one that is assumed by default.

    axes : up axis and front axis of the file, either of which may be unknown
    mesh_file : content of the file
    joined_part : mesh part with all vertices of the file
    skin_triangles : (f,) mask of triangles that are skin
    """
    if axes.front != "auto" or any(one.maps is not None for one in mesh_file.materials):
        return axes, ""
    eyes = [one.positions[one.triangles.ravel()] for one in mesh_file.parts if is_eye_name(one.group.names)]
    if not eyes and mesh_file.bones is not None:
        of_eyes = [is_eye_name([name]) for name in mesh_file.bones.names]
        eyes = [mesh_file.bones.world[of_eyes, :3, 3]]
    positions, points = (
        to_y_up(one, axes) for one in (joined_part.positions, np.vstack([np.empty((0, 3)), *eyes]))
    )
    direction = face_direction(positions, joined_part.triangles[skin_triangles], points)
    if direction is None or direction == "z":
        return axes, ""
    front = head_axis_in_file(direction, axes)
    advice = f"--front={axes.front_or_default} keeps it as it is"
    note = f"its face looks along {front} and is turned to the viewer; {advice}"
    return axes._replace(front=front), note


def _weld_groups(mesh_parts: list[MeshPart]) -> Floats:
    """Return the weld group (v,) of each vertex; coincident vertices of different groups are not welded."""
    numbers = [number if part.separate else 0 for number, part in enumerate(mesh_parts, start=1)]
    return np.repeat(np.array(numbers, np.float32), [len(part.positions) for part in mesh_parts])


def _uv_from_top(uv: Doubles, mesh_path: Path, v_origin: UvOrigin) -> Doubles:
    """Return uv (n, 2) with v = 0 at the top edge; rounding errors beyond [0, 1] are clamped.

    v_origin : edge of textures at which v is 0 in the file, see `load_rigged`
    """
    from_top = v_origin == "top" or (v_origin == "auto" and is_gltf(mesh_path))
    flipped = uv if from_top else np.column_stack((uv[:, 0], 1 - uv[:, 1]))
    clamped = np.clip(flipped, 0, 1)
    return np.where(np.abs(flipped - clamped) <= UV_TOLERANCE, clamped, flipped)


class _AssignedMaterials(NamedTuple):
    """Materials of the mesh, and the material of each part of the file.

    of_part : material index of each part
    in_file, has_uv : see `FileSurfaceData`
    """

    materials: tuple[Material, ...]
    of_part: list[int]
    in_file: tuple[int, ...]
    has_uv: tuple[bool, ...]

    @property
    def is_skin(self) -> Mask:
        """Return the mask (m,) of the materials that are skin."""
        return np.array([one.kind == "skin" for one in self.materials])


def _assign_materials(
    mesh_file: MeshFile, declared_names: GroupNames, mesh_path: Path
) -> tuple[_AssignedMaterials, str]:
    """Return the materials of the mesh, in the order of the file, and a note on which materials are skin."""
    parts, unnamed = mesh_file.parts, (mesh_path.stem,)
    groups = [replace(part.group, names=part.group.names or unnamed) for part in parts]
    is_opaque = _match_groups(groups, declared_names.opaque, "opaque", mesh_path)
    is_eye = _match_groups(groups, declared_names.eyes, "eye_groups", mesh_path)
    scatters = [group.material >= 0 and mesh_file.materials[group.material].scatters for group in groups]
    is_skin = _match_groups(groups, declared_names.skin, "skin_groups", mesh_path)
    if not declared_names.skin:
        candidates = [k for k, opaque in enumerate(is_opaque) if not opaque]
        chosen = choose_skin(
            [parts[k] for k in candidates], [groups[k] for k in candidates], [scatters[k] for k in candidates]
        )
        is_skin = [False] * len(parts)
        for k, skin in zip(candidates, chosen, strict=True):
            is_skin[k] = skin
    is_skin = [skin and not opaque for skin, opaque in zip(is_skin, is_opaque, strict=True)]
    stated = (
        declared_names.skin
        or declared_names.opaque
        or any(one.maps is not None for one in mesh_file.materials)  # this package wrote the file
        or all(
            skin or eye or is_eye_name(group.names)
            for skin, eye, group in zip(is_skin, is_eye, groups, strict=True)
        )
    )
    index: dict[tuple[Material, int, bool], int] = {}
    of_part = []
    for part, group, skin, eye_group in zip(parts, groups, is_skin, is_eye, strict=True):
        eye = eye_group or is_eye_name(group.names)
        material = Material(group.names[0], "skin" if skin else "opaque", group.colour, eye=eye)
        key = material, group.material, part.uv is not None
        of_part.append(index.setdefault(key, len(index)))
    materials, in_file, has_uv = zip(*index, strict=True)
    return _AssignedMaterials(materials, of_part, in_file, has_uv), "" if stated else describe_skin_groups(
        groups, is_skin
    )


def _without_empty_materials(
    mesh: RawMesh, assigned_materials: _AssignedMaterials
) -> tuple[RawMesh, _AssignedMaterials, tuple[str, ...]]:
    """Remove materials without triangles; return mesh, materials, and a note if any were removed."""
    kept = np.bincount(mesh.material, minlength=len(assigned_materials.materials)) > 0
    if kept.all() or not kept[assigned_materials.is_skin].any():
        return mesh, assigned_materials, ()
    names = join_names([one.name for one in compress(assigned_materials.materials, ~kept)])
    assigned_materials = assigned_materials._replace(
        materials=tuple(compress(assigned_materials.materials, kept)),
        in_file=tuple(compress(assigned_materials.in_file, kept)),
        has_uv=tuple(compress(assigned_materials.has_uv, kept)),
    )
    mesh = replace(mesh, material=(np.cumsum(kept) - 1)[mesh.material].astype(np.int32))
    return mesh, assigned_materials, (f"nothing remains of these groups: {names}",)


def _match_groups(
    groups: list[MaterialGroup], declared_names: tuple[str, ...], option_name: str, mesh_path: Path
) -> list[bool]:
    """Return for each group whether one of its names is in `declared_names`; refuse names that no group has.

    option_name : argument of `load_rigged` that contains `declared_names`, for the error
    """
    folded = {name.casefold() for name in declared_names}
    unknown = folded - {name.casefold() for group in groups for name in group.names}
    if unknown:
        known = ", ".join(dict.fromkeys(name for group in groups for name in group.names))
        expected = f"{option_name} with names of groups of the file ({known})"
        refuse(mesh_path, expected, f"{sorted(unknown)[0]!r} is none", "Check the spelling")
    return [any(name.casefold() in folded for name in group.names) for group in groups]


class GroupNames(NamedTuple):
    """Names of a file's groups that the user declares to be skin, not skin, or eyeballs."""

    skin: tuple[str, ...] = ()
    opaque: tuple[str, ...] = ()
    eyes: tuple[str, ...] = ()


class FileSurfaceData(NamedTuple):
    """Data needed to apply the materials and pictures of a mesh file to the mesh that was read from the file.

    in_file : (m,) index in the file of each material of the mesh, -1 for a material that is not in the file
    has_uv : (m,) mask of materials whose triangles have uv in the file
    colours : (v, 3) linear colours of vertices, or None
    other_uv : dictionary from the index of an additional uv set in the file to its coordinates (v, 2)
    """

    in_file: tuple[int, ...] = ()
    has_uv: tuple[bool, ...] = ()
    colours: Floats | None = None
    other_uv: Mapping[int, Floats] = {}


class RiggedMesh(NamedTuple):
    """Mesh with the rig that deforms it; the rig is None for a mesh that cannot be deformed.

    notes : sentences for users on content that was repaired, replaced or left out
    materials : materials of the file, to which indices in `surface` refer; empty if the mesh is from the disk
        cache
    unit_mm : length unit of the file or of its format [mm]; None if the mesh is from the disk cache
    file_vertices : correspondence between vertices of the file and points of the mesh
    """

    mesh: Mesh
    rig: Rig | None
    notes: tuple[str, ...] = ()
    surface: FileSurfaceData = FileSurfaceData()
    materials: tuple[FileMaterial, ...] = ()
    unit_mm: float | None = None
    file_vertices: FileVertices | None = None


def cached_rigged(
    file_bytes: bytes, options_text: str, load_from_file: Callable[[], RiggedMesh]
) -> RiggedMesh:
    """Return mesh and rig of a file from the disk cache; load and cache both if the cache lacks them.

    file_bytes : bytes of the file; the mesh must not depend on other files
    options_text : text with all options that influence the result, part of the cache key
    load_from_file : function that reads the file
    """
    digest = hashlib.sha256(f"{_CACHE_VERSION} {options_text}".encode())
    digest.update(file_bytes)
    return _rigged_from_arrays(
        load_or_make(
            "meshes", digest.hexdigest()[:40], _ARRAY_NAMES, lambda: _rigged_to_arrays(load_from_file())
        )
    )


def _rigged_to_arrays(rigged: RiggedMesh) -> Arrays:
    """Return mesh and rig as arrays by name for the disk cache; absent fields are empty arrays."""
    mesh, rig, notes, surface = rigged[:4]
    assert rigged.file_vertices is not None
    metadata: dict[str, Any] = {"materials": [asdict(material) for material in mesh.materials]}
    metadata |= {"notes": notes, "in_file": surface.in_file, "has_uv": surface.has_uv}
    metadata["uv_sets"] = list(surface.other_uv)
    metadata["file"] = rigged.file_vertices.count, rigged.file_vertices.to_head.tolist()
    arrays = {name: getattr(mesh, name) for name in _MESH_FIELDS} | {"outline": mesh.outline.points_mm}
    arrays["file vertex"] = rigged.file_vertices.vertex
    arrays["colours"] = _ABSENT_FIELD if surface.colours is None else surface.colours
    arrays["other uv"] = np.stack([*surface.other_uv.values()]) if surface.other_uv else _ABSENT_FIELD
    rig_arrays: Arrays = dict.fromkeys((name for name in _ARRAY_NAMES if name not in arrays), _ABSENT_FIELD)
    if rig is not None:
        metadata |= {"targets": list(rig.targets.names), "bones": None}
        rig_arrays["control"] = rig.positions_mm
        rig_arrays |= _prefixed_fields(rig.targets, "target", _TARGET_FIELDS)
    if rig is not None and rig.skeleton is not None:
        metadata["bones"] = list(rig.skeleton.names)
        rig_arrays |= _prefixed_fields(rig.skeleton, "bone", _SKELETON_FIELDS)
    encoded = np.frombuffer(json.dumps(metadata).encode(), np.uint8)
    return arrays | rig_arrays | {"metadata": encoded}


def _prefixed_fields(instance: MorphTargets | Skeleton, prefix: str, field_names: list[str]) -> Arrays:
    arrays = {f"{prefix} {name}": getattr(instance, name) for name in field_names}
    return {name: _ABSENT_FIELD if array is None else array for name, array in arrays.items()}


def _rigged_from_arrays(arrays: Arrays) -> RiggedMesh:
    metadata = json.loads(arrays["metadata"].tobytes())
    triples = ("colour", "emission")
    materials = [
        Material(**one | {name: tuple(one[name]) for name in triples}) for one in metadata["materials"]
    ]
    mesh = Mesh(**{name: arrays[name] for name in _MESH_FIELDS}, materials=tuple(materials))
    vars(mesh)["outline"] = Outline(arrays["outline"])  # computing it would import scipy
    notes, colours = tuple(metadata["notes"]), arrays["colours"] if len(arrays["colours"]) else None
    other_uv = dict(zip(metadata["uv_sets"], arrays["other uv"], strict=True))
    surface = FileSurfaceData(tuple(metadata["in_file"]), tuple(metadata["has_uv"]), colours, other_uv)
    count, to_head = metadata["file"]
    file_vertices = FileVertices(count, arrays["file vertex"], mesh.point, mesh.triangles, np.array(to_head))
    rigged = RiggedMesh(mesh, None, notes, surface, file_vertices=file_vertices)
    if "targets" not in metadata:
        return rigged
    values: dict[str, Numbers | None] = {name: arrays[f"target {name}"] for name in _TARGET_FIELDS}
    values["rest"] = values["rest"] if len(arrays["target rest"]) else None
    targets = MorphTargets(tuple(metadata["targets"]), **values)  # type: ignore[arg-type]
    if metadata["bones"] is None:
        return rigged._replace(rig=Rig(arrays["control"], targets))
    skeleton = Skeleton(
        tuple(metadata["bones"]), **{name: arrays[f"bone {name}"] for name in _SKELETON_FIELDS}
    )
    return rigged._replace(rig=Rig(arrays["control"], targets, skeleton))


def is_eye_name(group_names: Sequence[str]) -> bool:
    """Return whether a group's names denote an eyeball or its parts, such as Eye_L, sclera, Std_Cornea_R.

    group_names : names of the group, the name of its material first; the result is decided by the first
        name that contains a word for an eyeball, or a word such as "lash" that excludes an eyeball

    Lashes, brows, lids and transparent layers on the eye, such as tear films, are not eyes.
    """
    for name in group_names:
        words = _WORD_PATTERN.findall(name)
        if any(_NOT_EYE_PATTERN.fullmatch(word) for word in words):
            return False
        if any(_EYE_PATTERN.fullmatch(word) for word in words):
            return True
    return False
