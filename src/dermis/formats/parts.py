"""Parts of mesh files: groups of triangles, whose lengths and uv are as in the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Index, Ints, Numbers
from dermis.formats.axes import DEFAULT_AXES, Axes

if TYPE_CHECKING:
    from dermis.formats.materials import FileMaterial

Colour = tuple[float, float, float]

DEFAULT_COLOUR: Colour = (0.8, 0.8, 0.8)


def is_gltf(path: str | Path) -> bool:
    """Return whether a file name has one of the suffixes of glTF files: .glb, .gltf or .vrm."""
    return is_binary_gltf(path) or Path(path).suffix.lower() == ".gltf"


def is_binary_gltf(path: str | Path) -> bool:
    """Return whether a file name has one of the suffixes of binary glTF files: .glb, or .vrm for avatars."""
    return Path(path).suffix.lower() in (".glb", ".vrm")


def default_unit_mm(path: str | Path) -> float:
    """Return the default length unit of a file format [mm]: 1000 for glTF, which is in metres, else 1.

    USD files state their own unit, see `MeshFile`.
    """
    return 1000.0 if is_gltf(path) else 1.0


@dataclass(frozen=True)
class MaterialGroup:
    """Names and colour of a group of triangles.

    names : name of the group's material (unless it has none), followed by the name of the mesh or OBJ group
    colour : diffuse reflectance, linear [-]
    material : index of the file's material, -1 if there is none
    """

    names: tuple[str, ...]
    colour: Colour = DEFAULT_COLOUR
    material: int = -1

    def name_contains(self, word: str) -> bool:
        """Return whether a lower-case word occurs in one of the names."""
        return any(word in name.casefold() for name in self.names)


@dataclass(frozen=True)
class MeshPart:
    """Triangles of one group in the rest pose; the length unit and the v direction are those of the file.

    positions : (v, 3) vertex positions
    uv : (v, 2) uv of the vertices, or None
    normals : (v, 3) normals of the vertices, or None
    triangles : (f, 3) vertex indices
    targets : dictionary from morph target name to the indices (n,) of the displaced vertices and their
        displacements (n, 3) at weight 1
    bone : (v, k) bone indices of each vertex; None without bones
    weight : (v, k) weights of these bones, which sum to 1; None without bones
    quads : (q, 2) pairs of triangles that are the halves of a quad
    separate : whether the vertices must not be welded to coincident vertices of other parts
    colours : (v, 3) linear colours of vertices, or None
    other_uv : dictionary from the index of an additional uv set in the file to its coordinates (v, 2);
        contains only sets that textures use
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
    colours: Doubles | None = None
    other_uv: Mapping[int, Doubles] = field(default_factory=dict)


@dataclass(frozen=True)
class Bones:
    """Bone hierarchy of a file, parents before children.

    parent : (b,) index of each bone's parent, -1 for a root
    local : (b, 4, 4) rest transforms from each bone's space to the space of its parent
    world : (b, 4, 4) rest transforms from each bone's space to file space
    """

    names: tuple[str, ...]
    parent: Ints
    local: Doubles
    world: Doubles


@dataclass(frozen=True)
class MeshFile:
    """Geometry and bones of a mesh file.

    weights : default weights of morph targets by name; weights of 0 are omitted
    materials : materials of the file, to which the groups refer
    notes : sentences for users on content that was repaired, replaced or left out
    unit_mm : length unit that the file states [mm]; None if it states none
    axes : axes that the file states
    """

    parts: list[MeshPart]
    bones: Bones | None = None
    weights: Mapping[str, float] = field(default_factory=dict)
    materials: tuple[FileMaterial, ...] = ()
    notes: tuple[str, ...] = ()
    unit_mm: float | None = None
    axes: Axes = DEFAULT_AXES

    @property
    def is_deformable(self) -> bool:
        """Return whether the file has bones or morph targets."""
        return self.bones is not None or any(part.targets for part in self.parts)


def to_floats(stored_values: Numbers) -> Doubles:
    """Convert an array to floats; integers are divided by the largest value of their type."""
    scale = np.iinfo(stored_values.dtype.str).max if stored_values.dtype.kind in "iu" else 1
    return np.asarray(stored_values / scale, dtype=np.float64)


def parse_colour(numbers: Sequence[float | str]) -> Colour:
    """Return red, green and blue from the first three numbers, clamped to [0, 1]."""
    r, g, b = (min(max(float(x), 0.0), 1.0) for x in list(numbers)[:3])
    return (r, g, b)


def find_quads(corner_counts: NDArray[np.integer], triangles: Index) -> Index:
    """Return the pairs (q, 2) of triangles that are halves of quads; empty if quads cannot be identified.

    corner_counts : (n,) number of corners of each polygon of the file
    triangles : (f, 3) triangulated polygons, either in the order of the file, or ordered by kind: all
        triangles first, then the first halves of all quads, then the second halves, then all other polygons
    """
    none, count = np.empty((0, 2), dtype=np.int64), int((corner_counts == 4).sum())
    if count == 0 or int((corner_counts - 2).sum()) != len(triangles):
        return none
    sequential = (np.cumsum(corner_counts - 2) - 2)[corner_counts == 4]
    grouped = int((corner_counts == 3).sum()) + np.arange(count)
    for first, step in ((sequential, 1), (grouped, count)):
        pairs = np.column_stack((first, first + step))
        a, b = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
        if (a[:, [0, 2]] == b[:, [2, 0]]).all():
            return pairs
    return none
