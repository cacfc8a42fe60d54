"""Groups of triangles as they are in mesh files: in file units, with uv untouched.

trimesh parses OBJ and PLY; the groups, which it would rename, are numbered in the text of the file first.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Index, Ints, Numbers

if TYPE_CHECKING:
    from trimesh import Trimesh

Colour = tuple[float, float, float]

GREY: Colour = (0.8, 0.8, 0.8)


def is_gltf(path: str | Path) -> bool:
    """Whether the file is glTF by its suffix."""
    return Path(path).suffix.lower() in (".glb", ".gltf")


def default_unit_mm(path: str | Path) -> float:
    """Length of the file's unit if nothing else is said [mm]: 1000 for glTF, which is in metres, else 1."""
    return 1000.0 if is_gltf(path) else 1.0


@dataclass(frozen=True)
class MaterialGroup:
    """Name of the material (or mesh) first, then all other names; diffuse colour, linear [-]."""

    names: tuple[str, ...]
    colour: Colour = GREY

    def name_contains(self, word: str) -> bool:
        """Whether a word is part of one of its names."""
        return any(word in name.casefold() for name in self.names)


@dataclass(frozen=True)
class MeshPart:
    """One group's triangles in the file's units and the file's v direction, at rest.

    positions (v, 3), uv (v, 2) or None, normals (v, 3) or None, triangles (f, 3)
    targets : by name the vertices that a morph target moves (n,) and by how much at weight 1 (n, 3)
    bone, weight : (v, k) bones that each vertex follows, by shares that add up to 1; None for no bones
    quads : (q, 2) pairs of triangles that are the halves of one
    separate : whether its points are no others' at the same places, as of a skin and of the lid on its cut
    """

    group: MaterialGroup
    positions: Doubles
    uv: Doubles | None
    normals: Doubles | None
    triangles: Index
    targets: Mapping[str, tuple[Index, Doubles]] = field(default_factory=dict)
    bone: Index | None = None
    weight: Doubles | None = None
    quads: Index = field(default_factory=lambda: np.empty((0, 2), np.int64))
    separate: bool = False


@dataclass(frozen=True)
class Bones:
    """Bones of a file, parents before children; -1 for the parent of a root.

    local, world : (b, 4, 4) from each bone's space to its parent's and to the file's, at rest
    """

    names: tuple[str, ...]
    parent: Ints
    local: Doubles
    world: Doubles


@dataclass(frozen=True)
class MeshFile:
    """All that a file says of a head's shape.

    weights : of morph targets at rest, by name, where they are not 0
    """

    parts: list[MeshPart]
    bones: Bones | None = None
    weights: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_deformable(self) -> bool:
        """Whether it has bones or targets."""
        return self.bones is not None or any(part.targets for part in self.parts)


def trimesh_parts(
    data: bytes, kind: str, groups: list[MaterialGroup], **options: object
) -> Iterator[MeshPart]:
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


def _part(mesh: Trimesh, group: MaterialGroup) -> MeshPart:
    """A trimesh's arrays."""
    uv = getattr(mesh.visual, "uv", None)
    normals = mesh.vertex_normals if "vertex_normals" in mesh._cache else None
    triangles = np.array(mesh.faces, dtype=np.int64).reshape(-1, 3)
    places = np.asarray(mesh.vertices, dtype=np.float64) + 0.0  # without -0
    if places.ndim != 2 or places.shape[1] != 3:
        raise ValueError(f"its vertices have {places.shape[-1]} coordinates, not 3")
    return MeshPart(
        group,
        places,
        None if uv is None else to_floats(np.asarray(uv)),
        None if normals is None else to_floats(np.asarray(normals)) + 0.0,
        triangles,
        quads=find_quads(ply_corner_counts(mesh.metadata), triangles),
    )


def to_floats(values: Numbers) -> Doubles:
    """Numbers of which integers stand for fractions of their type's largest."""
    scale = np.iinfo(values.dtype.str).max if values.dtype.kind in "iu" else 1
    return np.asarray(values / scale, dtype=np.float64)


def parse_colour(numbers: Sequence[float | str]) -> Colour:
    """Three numbers in [0, 1]."""
    r, g, b = (min(max(float(x), 0.0), 1.0) for x in list(numbers)[:3])
    return (r, g, b)


def find_quads(sides: NDArray[np.integer], triangles: Index) -> Index:
    """(q, 2) triangles that are the halves of each quad of a file; empty when they are in no known order.

    sides : (n,) how many corners each face of the file has
    triangles : (f, 3) its faces as the reader has cut them: one after the other, or triangles first, then the
        first halves of all quads, the second halves and the fans of all others
    """
    none, count = np.empty((0, 2), dtype=np.int64), int((sides == 4).sum())
    if count == 0 or int((sides - 2).sum()) != len(triangles):
        return none
    in_place = (np.cumsum(sides - 2) - 2)[sides == 4]
    sorted_by_sides = int((sides == 3).sum()) + np.arange(count)
    for first, step in ((in_place, 1), (sorted_by_sides, count)):
        pairs = np.column_stack((first, first + step))
        a, b = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
        if (a[:, [0, 2]] == b[:, [2, 0]]).all():
            return pairs
    return none


def ply_corner_counts(metadata: Mapping[str, Any]) -> Index:
    """How many corners each face of a .ply file has, by what trimesh keeps of it; no numbers for others."""
    data = metadata.get("_ply_raw", {}).get("face", {}).get("data")
    known = data.dtype.names if isinstance(data, np.ndarray) else data
    for name in ("vertex_index", "vertex_indices"):
        if name in (known or ()):
            rows = data[name]["f1"] if isinstance(data, np.ndarray) else data[name]
            return np.fromiter(map(len, rows), np.int64) if rows.dtype == object else np.full(*rows.shape)
    return np.empty(0, np.int64)
