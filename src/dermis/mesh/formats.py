"""Mesh files as they lie on disk: groups of triangles in file units, with uv untouched.

trimesh parses. It flips v of glTF, drops uv of primitives without material and integer uv, and renames
groups; so the file's text is marked first, and all of that survives.
"""

from __future__ import annotations

import json
import re
import struct
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.mesh.quads import find_pairs, obj_sides, ply_sides

Colour = tuple[float, float, float]
Array = NDArray[np.float64]

GREY: Colour = (0.8, 0.8, 0.8)


def is_gltf(path: str | Path) -> bool:
    """Whether the file's suffix is glTF's."""
    return Path(path).suffix.lower() in (".glb", ".gltf")


def default_unit_mm(path: str | Path) -> float:
    """Default length of the file's unit [mm]: 1000 for glTF, which is in metres, else 1."""
    return 1000.0 if is_gltf(path) else 1.0


@dataclass(frozen=True)
class Group:
    """Names of a group, that of its material (or mesh) first; its diffuse colour, linear [-]."""

    names: tuple[str, ...]
    colour: Colour = GREY


@dataclass(frozen=True)
class Part:
    """One group's triangles in the file's units and the file's v direction.

    positions (v, 3), uv (v, 2) or None, normals (v, 3) or None, triangles (f, 3), quads (q, 2) pairs of them
    """

    group: Group
    positions: Array
    uv: Array | None
    normals: Array | None
    triangles: NDArray[np.int64]
    quads: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))


def read_gltf(path: Path) -> list[Part]:
    """Parts of a .glb or .gltf file, each node's transform applied."""
    from trimesh.resolvers import FilePathResolver

    data, binary = path.read_bytes(), path.suffix.lower() == ".glb"
    chunk = struct.unpack_from("<I", data, 12)[0] if binary else len(data)
    start = 20 if binary else 0
    tree = json.loads(data[start : start + chunk])
    groups = _mark_gltf(tree, path)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    if binary:
        rest = data[20 + chunk :]
        lengths = struct.pack("<II", 20 + len(text) + len(rest), len(text))
        text = data[:8] + lengths + data[16:20] + text + rest
    return list(_parts(text, path.suffix[1:].lower(), groups, resolver=FilePathResolver(str(path))))


def _mark_gltf(tree: dict[str, Any], path: Path) -> list[Group]:
    """Give each primitive a group of its own and its raw uv and normals names that trimesh leaves alone."""
    _refuse_extensions(tree, path)
    groups: list[Group] = []
    wanted: set[int] = set()
    for mesh in tree.get("meshes", []):
        for primitive in mesh["primitives"]:
            given = primitive["attributes"]
            kept = {"POSITION": "POSITION", "NORMAL": "_NORMAL", "TEXCOORD_0": "_UV"}
            primitive["attributes"] = {mark: given[name] for name, mark in kept.items() if name in given}
            wanted.update(primitive["attributes"].values())
            wanted.update([primitive["indices"]] if "indices" in primitive else [])
            groups.append(_gltf_group(tree, mesh, primitive))
            primitive["material"] = len(groups) - 1
    # pictures are read elsewhere, and unused accessors may ask for any amount of memory
    for key in ("textures", "images", "samplers", "cameras", "animations", "skins"):
        tree.pop(key, None)
    tree["materials"] = [{"name": str(k)} for k in range(len(groups))]
    for index, accessor in enumerate(tree.get("accessors", [])):
        if index not in wanted:
            tree["accessors"][index] = {"componentType": 5126, "count": 0, "type": "SCALAR"}
        elif "sparse" in accessor or "bufferView" not in accessor:
            came = f"accessor {index} is sparse or empty"
            refuse(path, "plain glTF accessors", came, "Export without morph targets")
    return groups


def _refuse_extensions(tree: dict[str, Any], path: Path) -> None:
    """Refuse geometry in an encoding that would be read wrongly."""
    harmless = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_")
    foreign = [name for name in tree.get("extensionsRequired", []) if not str(name).startswith(harmless)]
    if foreign:
        came = f"the file requires {', '.join(map(str, foreign))}"
        refuse(path, "plain glTF geometry", came, "Export without compression and quantisation")


def _gltf_group(tree: dict[str, Any], mesh: dict[str, Any], primitive: dict[str, Any]) -> Group:
    material = tree["materials"][primitive["material"]] if "material" in primitive else {}
    names = tuple(str(thing["name"]) for thing in (material, mesh) if thing.get("name"))
    factor = material.get("pbrMetallicRoughness", {}).get("baseColorFactor")
    return Group(names, _colour(factor) if factor else GREY)


def read_obj(path: Path) -> list[Part]:
    """Parts of a .obj file by `usemtl` and `g`; colours are Kd of its .mtl, taken as linear."""
    text = path.read_bytes().decode("utf-8", errors="replace").replace("\r\n", "\n").replace("\\\n", " ")
    text = re.sub(r"^((?:v[tn]?|f)[ \t][^#\n]*)#[^\n]*", r"\1", text, flags=re.MULTILINE)
    if re.search(r"^f[^\n]*[ /]-\d", text, re.MULTILINE):
        came = "it has relative (negative) ones"
        refuse(path, "faces by absolute index", came, "Export it again, in Blender")
    libraries = re.findall(r"^[ \t]*mtllib[ \t]+(.*?)[ \t]*$", text, re.MULTILINE)
    colours: dict[str, Colour] = {}
    for library in libraries:
        colours.update(_mtl_colours(path.parent / library))
    text, groups = _mark_obj(text, colours)
    materials = "\n".join(f"newmtl {k}" for k in range(len(groups)))
    # trimesh pops groups from the end: back to file order
    parts = list(_parts(text.encode(), "obj", groups, resolver={"marked.mtl": materials.encode()}))[::-1]
    faces = {id(group): sides for group, sides in zip(groups, obj_sides(text, len(groups)), strict=True)}
    parts = [replace(part, quads=find_pairs(faces[id(part.group)], part.triangles)) for part in parts]
    full, none = [part.group for part in parts], np.empty((0, 3))
    return parts + [Part(g, none, None, None, none.astype(int)) for g in groups if g.names and g not in full]


def _mark_obj(text: str, colours: dict[str, Colour]) -> tuple[str, list[Group]]:
    """Replace each `usemtl` and `g` by `usemtl` of a number, one for each pair of names."""
    current = {"usemtl": "", "g": ""}
    numbers: dict[tuple[str, str], int] = {("", ""): 0}

    def number(match: re.Match[str]) -> str:
        current[match[1]] = match[2] or ""
        key = (current["usemtl"], current["g"])
        return f"usemtl {numbers.setdefault(key, len(numbers))}"

    marked = re.sub(r"^[ \t]*(usemtl|g)(?:[ \t]+([^\n]*?))?[ \t]*$", number, text, flags=re.MULTILINE)
    names = [tuple(dict.fromkeys(name for name in key if name)) for key in numbers]
    groups = [Group(name, colours.get(key[0], GREY)) for name, key in zip(names, numbers, strict=True)]
    return f"mtllib marked.mtl\nusemtl 0\n{marked}", groups


def _mtl_colours(path: Path) -> dict[str, Colour]:
    """Kd of each material; nothing when there is no such file, as is common."""
    if not path.is_file():
        return {}
    colours, name = {}, ""
    for line in path.read_bytes().decode("utf-8", errors="replace").splitlines():
        key, _, value = line.strip().partition(" ")
        if key == "newmtl":
            name = value.strip()
        elif key == "Kd":
            colours[name] = _colour(value.split())
    return colours


def read_ply(path: Path) -> list[Part]:
    """The one part of a .ply file; uv from the vertex properties s, t or u, v or texture_u, texture_v."""
    data = path.read_bytes()
    header = data[: data.find(b"end_header")]
    # uv per face corner split vertices, which the file's normals may then not fit; uv per vertex do not, and
    # splitting would drop the normals as soon as one vertex is unused
    by_corner = b"texcoord" in header
    parts = list(_parts(data, "ply", [Group((path.stem,))], fix_texture=by_corner, skip_materials=True))
    return [replace(part, normals=None) for part in parts] if by_corner else parts


READERS: dict[str, Callable[[Path], list[Part]]] = {
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".obj": read_obj,
    ".ply": read_ply,
}


def _parts(data: bytes, kind: str, groups: list[Group], **options: Any) -> Iterator[Part]:
    """Parts that trimesh reads from `data`, in world space, each with the group that its material numbers."""
    from io import BytesIO

    import trimesh

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # a truncated text must not pass as a shorter mesh
        warnings.filterwarnings("error", message="string or file could not be read")
        scene = trimesh.load_scene(BytesIO(data), file_type=kind, process=False, **options)
    nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
    for transform, name in nodes or [(np.eye(4), name) for name in scene.geometry]:
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh):
            tag = getattr(getattr(mesh.visual, "material", None), "name", None)
            yield _placed(mesh, np.asarray(transform), groups[int(tag or 0) if len(groups) > 1 else 0])


def _placed(mesh: Any, transform: Array, group: Group) -> Part:
    """A trimesh's arrays, moved by `transform` (4, 4)."""
    uv = mesh.vertex_attributes.get("_UV", getattr(mesh.visual, "uv", None))
    normals = mesh.vertex_attributes.get("_NORMAL")
    if normals is None and "vertex_normals" in mesh._cache:
        normals = mesh.vertex_normals
    linear = transform[:3, :3]
    # cofactors transform normals, for singular transforms too, and keep their length; mirrors flip triangles
    cofactors = np.array([np.cross(linear[(i + 1) % 3], linear[(i + 2) % 3]) for i in range(3)])
    mirror, size = np.sign(det := np.linalg.det(linear)) or 1.0, abs(det) ** (2 / 3) or 1.0
    triangles = np.array(mesh.faces, dtype=np.int64).reshape(-1, 3)
    return Part(
        group,
        np.asarray(mesh.vertices, dtype=np.float64) @ linear.T + transform[:3, 3],
        None if uv is None else _real(uv),
        None if normals is None else _real(normals) @ (mirror / size * cofactors).T,
        triangles[:, ::-1] if mirror < 0 else triangles,
        find_pairs(ply_sides(mesh.metadata), triangles),
    )


def _real(values: Any) -> Array:
    """Values as floats; integers are fractions of their type's largest, as in glTF."""
    array = np.asarray(values)
    scale = np.iinfo(array.dtype).max if array.dtype.kind in "iu" else 1
    return np.asarray(array / scale, dtype=np.float64)


def _colour(numbers: Any) -> Colour:
    """Three numbers in [0, 1]."""
    r, g, b = (min(max(float(x), 0.0), 1.0) for x in list(numbers)[:3])
    return (r, g, b)
