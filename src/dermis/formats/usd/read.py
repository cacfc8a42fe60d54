"""Mesh parts and materials of USD files: .usd, .usda, .usdc, and packages (.usdz)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from dermis.base.arrays import Index, Mask
from dermis.base.disk import Arrays
from dermis.base.errors import refuse
from dermis.base.file_properties import (
    drawn_property,
    drawn_property_with_note,
    noted_property,
    property_without_effect,
    refused_property,
)
from dermis.base.native_decoding import array_from_text, run_decoder, text_from_array
from dermis.base.reading import parse_json, read_file
from dermis.formats.axes import Axes, Axis
from dermis.formats.maps import PathLike
from dermis.formats.materials import FileMaterial, Role, Texture, check_pictures
from dermis.formats.parts import DEFAULT_COLOUR, MaterialGroup, MeshFile, MeshPart, parse_colour
from dermis.formats.polygons import Polygons, check_polygon_sizes, missing_uv_notes, without_small_polygons
from dermis.formats.referenced_files import find_referenced_file
from dermis.formats.size_limits import DAMAGED_ADVICE, MAX_FILE_BYTES
from dermis.images.io import EmbeddedPicture
from dermis.mesh.geometry import expand_runs

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_DECODER_MODULE = "dermis.formats.usd.decoder"
_PACKAGE_SUFFIX = ".usdz"
Tree = dict[str, Any]
USD_PROPERTIES = (
    drawn_property("`metersPerUnit`", "unless `--unit-mm` is given"),
    drawn_property_with_note("a file without `metersPerUnit`", "its unit is USD's default, 10 mm"),
    drawn_property("`upAxis`", "unless an `--up` other than `y` is given"),
    drawn_property("meshes, with transforms, instances, `orientation`, holes"),
    property_without_effect(
        "meshes that are invisible or of purpose `guide` or `proxy`", "hidden in all programs"
    ),
    drawn_property("time samples", "the state at the first time"),
    drawn_property("`subdivisionScheme`", "normals are used if it is `none`; `--subdivide` subdivides"),
    drawn_property(
        "primvars of each interpolation, with indices",
        "uv (`st`, `UVMap` or the name in the material), normals, colours",
    ),
    drawn_property_with_note("several sets of uv in one mesh", "that of the first material is used"),
    drawn_property(
        "`displayColor` of a mesh without material, or read by its material",
        "linear colours of vertices; those of faces are averaged at vertices",
    ),
    drawn_property("materials of meshes and of subsets of faces"),
    drawn_property(
        "pictures",
        "in the package, or in the folder of the file and below; of other paths only the last part is used",
    ),
    drawn_property(
        "sublayers, references, payloads", "from the folder of the file and below, or from the package"
    ),
    refused_property("layers in other places, value clips", "before any of them is opened"),
    noted_property("cameras, lights, skeletons, blend shapes, points, curves, spheres, other prims"),
)
"""Properties of USD files, except those of materials."""


def read_usd(path: Path) -> MeshFile:
    """Read the meshes of a USD file at its first time code, with their materials.

    Raises DermisError if the package usd-core is missing, for damaged files, and for layers outside the
    folder of the file.
    """
    data = read_file(path, "a USD file", MAX_FILE_BYTES)
    request = {"file": array_from_text(str(path.resolve())), "path": array_from_text(str(path))}
    answer = run_decoder(_DECODER_MODULE, request, len(data), path, "a valid USD file")
    scene: Tree = parse_json(text_from_array(answer["scene"]), path, "a valid USD file")
    pictures = _UsdPictures(path, data)
    materials = tuple(pictures.read_material(tree) for tree in scene["materials"])
    check_pictures(path, materials)
    parts, notes = list[MeshPart](), dict.fromkeys(scene["notes"])
    for number, mesh in enumerate(scene["meshes"]):
        mesh_parts, mesh_notes = _mesh_parts(path, answer, f"{number} ", _material_groups(mesh, materials))
        parts += mesh_parts
        notes |= dict.fromkeys(mesh_notes)
    axes = Axes(cast(Axis, scene["up"]))
    return MeshFile(parts, materials=materials, notes=tuple(notes), unit_mm=scene["unit_mm"], axes=axes)


def _material_groups(mesh_tree: Tree, materials: Sequence[FileMaterial]) -> list[MaterialGroup]:
    """Return the groups of a mesh: one for each of its materials."""
    groups = []
    for index in mesh_tree["materials"]:
        material = materials[index] if index >= 0 else FileMaterial(colour=mesh_tree["colour"])
        names = tuple(dict.fromkeys(name for name in (material.name, mesh_tree["name"]) if name))
        groups.append(MaterialGroup(names, parse_colour(material.colour or DEFAULT_COLOUR), index))
    return groups


def _mesh_parts(
    path: Path, decoded_arrays: Arrays, array_prefix: str, groups: list[MaterialGroup]
) -> tuple[list[MeshPart], list[str]]:
    """Return the parts of a mesh, one for each group, and notes for the user.

    The notes concern polygons that have fewer than three corners, and polygons without uv.

    decoded_arrays : arrays of all meshes, see `_SceneReader.read`
    array_prefix : prefix of the names of this mesh's arrays
    """
    mesh = {
        name.removeprefix(array_prefix): own
        for name, own in decoded_arrays.items()
        if name.startswith(array_prefix)
    }
    check_polygon_sizes(path, mesh["counts"])
    none, vertex = np.empty((0, 3)), mesh["vertex"]
    missing = np.full(len(vertex), -1)
    columns = [vertex, mesh.get("uv index", missing), mesh.get("normals index", missing)]
    kept: Mask = np.asarray(mesh["group"] >= 0)
    counts, corners = _select_polygons(mesh["counts"], np.column_stack(columns).astype(np.int64), kept)
    counts, corners, polygons, notes = without_small_polygons(counts, corners)
    if not len(counts):
        return [], notes
    geometry = Polygons(
        counts,
        corners,
        mesh["points"],
        mesh.get("uv", none[:, :2]),
        mesh.get("normals", none),
        mesh.get("colours"),
    )
    return geometry.mesh_parts(groups, mesh["group"][kept][polygons], "by polygon"), notes + missing_uv_notes(
        geometry
    )


def _select_polygons(corner_counts: Index, corners: Index, polygon_mask: Mask) -> tuple[Index, Index]:
    """Return the polygons that a mask (n,) selects: their numbers of corners, and their corners."""
    corner = expand_runs(
        (np.cumsum(corner_counts) - corner_counts)[polygon_mask], corner_counts[polygon_mask]
    )[1]
    return corner_counts[polygon_mask], corners[corner]


class _UsdPictures:
    """Pictures of a USD file: files in its package (.usdz), or in its folder and subfolders.

    file_bytes : bytes of the USD file
    """

    def __init__(self, path: Path, file_bytes: bytes) -> None:
        self.path, self.package = path, None
        if path.suffix.lower() == _PACKAGE_SUFFIX:
            self.package = zipfile.ZipFile(io.BytesIO(file_bytes))
            self.sizes = {one.filename: one.file_size for one in self.package.infolist()}

    def read_material(self, material_tree: Tree) -> FileMaterial:
        """Return a material; pictures that are missing are left out, with a note.

        material_tree : material as returned by `MaterialReader.read`
        """
        textures, missing = dict[Role, Texture](), dict[str, str]()
        for role, one in material_tree["textures"].items():
            picture = self._find_picture(one["file"])
            if picture is None:
                missing[role] = f"its picture {one['file']!r} is not in the {self._picture_location()}"
            else:
                textures[role] = Texture(
                    picture, 0, tuple(one["transform"]), tuple(one["wrap"]), one["channel"]
                )
        names = ("name", "colour", "alpha", "alpha_mode", "alpha_cutoff", "roughness", "stated_metalness")
        values = {
            name: material_tree[name]
            for name in (*names, "emission", "normal_scale")
            if name in material_tree
        }
        for name in ("colour", "emission"):
            values[name] = tuple(values.get(name, ())) or getattr(FileMaterial(), name)
        return FileMaterial(
            textures=textures, missing=missing, unused=tuple(material_tree["unused"]), **values
        )

    def _picture_location(self) -> str:
        return "folder of the file" if self.package is None else "package"

    def _find_picture(self, picture_name: str) -> PathLike | None:
        """Return the picture that a name refers to, in the package or the folder; None if it is missing."""
        if self.package is None:
            return find_referenced_file(self.path, picture_name) if picture_name else None
        if picture_name not in self.sizes:
            return None
        if self.sizes[picture_name] > MAX_FILE_BYTES:
            expected = f"pictures of at most {MAX_FILE_BYTES >> 20} MiB"
            refuse(self.path, expected, f"{picture_name!r} is larger", DAMAGED_ADVICE)
        return EmbeddedPicture(f"{self.path}, {picture_name}", self.package.read(picture_name))
