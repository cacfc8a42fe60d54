"""Mesh files as they lie on disk: groups of triangles in file units, with uv untouched.

trimesh parses OBJ and PLY; the groups, which it would rename, are numbered in the file's text first.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.reading import read_file
from dermis.mesh.limits import MOST_BYTES
from dermis.mesh.mtl import read_materials
from dermis.mesh.obj_text import face_sides, joined_lines, numbered, read_obj_text
from dermis.mesh.ply_header import check_ply
from dermis.mesh.quads import find_pairs, ply_sides

Colour = tuple[float, float, float]
Array = NDArray[np.float64]
Index = NDArray[np.int64]

GREY: Colour = (0.8, 0.8, 0.8)


def is_gltf(path: str | Path) -> bool:
    """Whether the file is glTF by its suffix."""
    return Path(path).suffix.lower() in (".glb", ".gltf")


def default_unit_mm(path: str | Path) -> float:
    """Length of the file's unit if nothing else is said [mm]: 1000 for glTF, which is in metres, else 1."""
    return 1000.0 if is_gltf(path) else 1.0


@dataclass(frozen=True)
class Group:
    """Name of the material (or mesh) first, then all other names; diffuse colour, linear [-]."""

    names: tuple[str, ...]
    colour: Colour = GREY


@dataclass(frozen=True)
class Part:
    """One group's triangles in the file's units and the file's v direction, at rest.

    positions (v, 3), uv (v, 2) or None, normals (v, 3) or None, triangles (f, 3)
    targets : by name the vertices that a morph target moves (n,) and by how much at weight 1 (n, 3)
    bone, weight : (v, k) bones that each vertex follows, by shares that add up to 1; None for no bones
    quads : (q, 2) pairs of triangles that are the halves of one
    alone : whether its points are no others' at the same places, as of a skin and of the lid on its cut
    """

    group: Group
    positions: Array
    uv: Array | None
    normals: Array | None
    triangles: Index
    targets: Mapping[str, tuple[Index, Array]] = field(default_factory=dict)
    bone: Index | None = None
    weight: Array | None = None
    quads: Index = field(default_factory=lambda: np.empty((0, 2), np.int64))
    alone: bool = False


@dataclass(frozen=True)
class Bones:
    """Bones of a file, parents before children; -1 for the parent of a root.

    local, world : (b, 4, 4) from each bone's space to its parent's and to the file's, at rest
    """

    names: tuple[str, ...]
    parent: NDArray[np.int32]
    local: Array
    world: Array


@dataclass(frozen=True)
class Model:
    """All that a file says of a head's shape.

    weights : of morph targets at rest, by name, where they are not 0
    """

    parts: list[Part]
    bones: Bones | None = None
    weights: Mapping[str, float] = field(default_factory=dict)

    @property
    def moves(self) -> bool:
        """Whether it has bones or targets."""
        return self.bones is not None or any(part.targets for part in self.parts)


def read_obj(path: Path) -> Model:
    """Parts of a .obj file by `usemtl` and `g`; colours are Kd of its .mtl, taken as linear."""
    return obj_model(path, read_obj_text(path))


def obj_model(path: Path, text: str) -> Model:
    """The same of a file's text."""
    text = joined_lines(path, text)
    materials = read_materials(path, text).materials
    colours = {name: colour_of(one.kd) for name, one in materials.items() if len(one.kd) >= 3}
    text, pairs = numbered(path, text)
    sides = face_sides(path, text, len(pairs))
    names = [tuple(dict.fromkeys(name for name in pair if name)) for pair in pairs]
    groups = [Group(name, colours.get(pair[0], GREY)) for name, pair in zip(names, pairs, strict=True)]
    numbers = "\n".join(f"newmtl {k}" for k in range(len(groups)))
    # trimesh pops groups from the end: file order again
    parts = list(_parts(text.encode(), "obj", groups, resolver={"marked.mtl": numbers.encode()}))[::-1]
    faces = {id(group): each for group, each in zip(groups, sides, strict=True)}
    parts = [replace(part, quads=find_pairs(faces[id(part.group)], part.triangles)) for part in parts]
    full, none = [part.group for part in parts], np.empty((0, 3))
    empty = [Part(g, none, None, None, none.astype(int)) for g in groups if g.names and g not in full]
    return Model(parts + empty)


def read_ply(path: Path) -> Model:
    """The one part of a .ply file; uv from the vertex properties s, t or u, v or texture_u, texture_v."""
    data = read_file(path, "a PLY file", MOST_BYTES)
    header = check_ply(path, data)
    # uv by face corner need vertices split, after which normals need not fit them any more; uv by vertex
    # do not, and splitting would drop the normals as soon as one vertex is unused
    by_corner = b"texcoord" in header
    parts = list(_parts(data, "ply", [Group((path.stem,))], fix_texture=by_corner, skip_materials=True))
    return Model([replace(part, normals=None) for part in parts] if by_corner else parts)


def _parts(data: bytes, kind: str, groups: list[Group], **options: Any) -> Iterator[Part]:
    """What trimesh reads from `data`, each under the group that its material numbers."""
    from io import BytesIO

    import trimesh

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # text that breaks off in the middle must not pass as a shorter mesh
        warnings.filterwarnings("error", message="string or file could not be read")
        scene = trimesh.load_scene(BytesIO(data), file_type=kind, process=False, **options)
    names = [scene.graph[node][1] for node in scene.graph.nodes_geometry]
    for mesh in (scene.geometry[name] for name in names or scene.geometry):
        if isinstance(mesh, trimesh.Trimesh):
            tag = getattr(getattr(mesh.visual, "material", None), "name", None)
            yield _part(mesh, groups[int(tag or 0) if len(groups) > 1 else 0])


def _part(mesh: Any, group: Group) -> Part:
    """A trimesh's arrays."""
    uv = getattr(mesh.visual, "uv", None)
    normals = mesh.vertex_normals if "vertex_normals" in mesh._cache else None
    triangles = np.array(mesh.faces, dtype=np.int64).reshape(-1, 3)
    places = np.asarray(mesh.vertices, dtype=np.float64) + 0.0  # without -0
    if places.ndim != 2 or places.shape[1] != 3:
        raise ValueError(f"its vertices have {places.shape[-1]} coordinates, not 3")
    return Part(
        group,
        places,
        None if uv is None else fractions(np.asarray(uv)),
        None if normals is None else fractions(np.asarray(normals)) + 0.0,
        triangles,
        quads=find_pairs(ply_sides(mesh.metadata), triangles),
    )


def fractions(values: NDArray[Any]) -> Array:
    """Numbers of which integers stand for fractions of their type's largest."""
    scale = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1
    return np.asarray(values / scale, dtype=np.float64)


def colour_of(numbers: Any) -> Colour:
    """Three numbers in [0, 1]."""
    r, g, b = (min(max(float(x), 0.0), 1.0) for x in list(numbers)[:3])
    return (r, g, b)
