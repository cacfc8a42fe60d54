"""Program that reads the meshes and materials of a USD file, see `native_decoding`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index, Numbers
from dermis.base.disk import Arrays
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.base.native_decoding import answer_request, array_from_text, text_from_array
from dermis.formats import size_limits as limits
from dermis.formats.usd.layers import open_stage
from dermis.formats.usd.shading import MaterialReader, Tree
from dermis.mesh.geometry import expand_runs

if TYPE_CHECKING:
    from pxr import Usd, UsdGeom, UsdShade

_MM_PER_METRE = 1000.0
_UV_NAMES = ("st", "UVMap", "map1", "st0", "st_0", "uv")
_PRIM_TYPES_WITHOUT_NOTE = ("", "Xform", "Scope", "Mesh", "GeomSubset", "Material", "Shader", "NodeGraph")
_HIDDEN_PURPOSES = ("guide", "proxy")
_SEVERAL_UV_NOTE = "faces of one mesh read different texture coordinates: those of the first are used"


class _Primvar(NamedTuple):
    """Primitive variable: values (n, k), and the index (c,) of the value of each corner."""

    values: Doubles
    corner_index: Index


class _Faces(NamedTuple):
    """Polygons of a mesh.

    counts : (n,) number of corners of each polygon
    start : (n,) index of the first corner of each polygon
    vertex : (c,) vertex index of each corner
    """

    counts: Index
    start: Index
    vertex: Index

    def element_of_corner(self, interpolation: str) -> Index | None:
        """Return the index (c,) of the primvar element at each corner; None for an unknown interpolation."""
        corners = len(self.vertex)
        return {
            "constant": np.zeros(corners, np.int64),
            "uniform": np.repeat(np.arange(len(self.counts)), self.counts),
            "vertex": self.vertex,
            "varying": self.vertex,
            "faceVarying": np.arange(corners),
        }.get(interpolation)

    def reversed_corners(self) -> Index:
        """Return the order of corners (c,) that reverses each polygon."""
        corner, step = expand_runs(np.zeros_like(self.counts), self.counts)
        return np.asarray((self.start + self.counts - 1)[corner] - step)


class _SceneReader:
    """Reader of the meshes of a stage, which collects arrays, materials and notes for the user."""

    def __init__(self, path: Path, stage: Usd.Stage, layer_folder: Path) -> None:
        task = f"{path}: USD scenes"
        self.usd, self.geom, self.shade = (
            import_extra(f"pxr.{name}", task) for name in ("Usd", "UsdGeom", "UsdShade")
        )
        self.path, self.stage = path, stage
        self.time = self.usd.TimeCode.EarliestTime()
        self.transform_cache = self.geom.XformCache(self.time)
        self.material_reader = MaterialReader(path, layer_folder, self.time)
        self.material_index: dict[str, int] = {}
        self.materials: list[Tree] = []
        self.arrays, self.notes = Arrays(), dict[str, None]()
        self.vertices = self.triangles = 0

    def read(self) -> Arrays:
        """Return the arrays of all meshes, and the scene as JSON under the name "scene".

        The name of an array begins with the number of the mesh.
        """
        meshes, unread = list[Tree](), Counter[str]()
        for count, prim in enumerate(self._prims()):
            limits.check_limit(self.path, count, limits.MAX_NODES, "prims", "Export the head alone")
            if prim.IsA(self.geom.Mesh):
                if self._is_visible(prim):
                    limits.check_limit(self.path, len(meshes), limits.MAX_GROUPS, "meshes", "Join some")
                    meshes.append(self._add_mesh(self.geom.Mesh(prim), str(len(meshes))))
            elif prim.GetTypeName() not in _PRIM_TYPES_WITHOUT_NOTE:
                unread[str(prim.GetTypeName())] += 1
        if unread:
            names = ", ".join(f"{name} ({count})" for name, count in unread.most_common(8))
            self.notes[f"these prims are left out: {names}"] = None
        scene = {
            "unit_mm": self._unit_mm(),
            "up": str(self.geom.GetStageUpAxis(self.stage)).lower(),
            "meshes": meshes,
            "materials": self.materials,
            "notes": list(self.notes),
        }
        return self.arrays | {"scene": array_from_text(json.dumps(scene))}

    def _prims(self) -> Iterator[Usd.Prim]:
        predicate = self.usd.TraverseInstanceProxies(self.usd.PrimDefaultPredicate)
        return iter(self.usd.PrimRange(self.stage.GetPseudoRoot(), predicate))

    def _unit_mm(self) -> float:
        if not self.geom.StageHasAuthoredMetersPerUnit(self.stage):
            self.notes["its unit is not stated: USD's default is 10 mm; --unit-mm sets another"] = None
        unit_mm = _MM_PER_METRE * float(self.geom.GetStageMetersPerUnit(self.stage))
        if not 0 < unit_mm < np.inf:
            actual = f"it is {unit_mm / _MM_PER_METRE:g}"
            refuse(self.path, "metersPerUnit above 0", actual, "Correct it, or export again")
        return unit_mm

    def _is_visible(self, prim: Usd.Prim) -> bool:
        shown = self.geom.Imageable(prim)
        is_hidden = shown.ComputePurpose() in _HIDDEN_PURPOSES
        return not is_hidden and shown.ComputeVisibility(self.time) != "invisible"

    def _add_mesh(self, mesh: UsdGeom.Mesh, mesh_number: str) -> Tree:
        """Add the arrays of a mesh to `arrays`; return the name, materials and colour of the mesh."""
        prim, matrix = mesh.GetPrim(), np.array(self.transform_cache.GetLocalToWorldTransform(mesh.GetPrim()))
        points, faces = self._points_and_faces(mesh)
        materials, group = self._material_groups(prim, len(faces.counts))
        uv = self._find_uv(prim, faces, materials)
        normals = self._read_normals(mesh, faces)
        colour, colours = self._read_colours(prim, faces, materials, len(points))
        arrays: dict[str, Numbers] = {"points": points @ matrix[:3, :3] + matrix[3, :3]}
        arrays |= {"counts": faces.counts, "group": group}
        order = self._corner_order(mesh, faces, matrix)
        arrays["vertex"] = faces.vertex[order]
        for name, primvar in (("uv", uv), ("normals", normals)):
            if primvar is not None:
                arrays |= {name: primvar.values, f"{name} index": primvar.corner_index[order]}
        if normals is not None and np.linalg.det(matrix[:3, :3]) != 0:
            arrays["normals"] = _normalise(normals.values @ np.linalg.inv(matrix[:3, :3]).T)
        if colours is not None:
            arrays["colours"] = colours
        self.arrays |= {
            f"{mesh_number} {name}": np.ascontiguousarray(array) for name, array in arrays.items()
        }
        return {"name": prim.GetName(), "materials": materials, "colour": colour}

    def _points_and_faces(self, mesh: UsdGeom.Mesh) -> tuple[Doubles, _Faces]:
        """Return the points (v, 3) and polygons of a mesh, after checking their number and indices."""
        attributes = mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()
        given = [attribute.Get(self.time) for attribute in attributes]
        points = np.array(given[0] or [], np.float64).reshape(-1, 3)
        counts, vertex = (np.array(one or [], np.int64) for one in given[1:])
        self.vertices += len(points)
        self.triangles += int(np.maximum(counts - 2, 0).sum())
        advice = limits.DECIMATE_ADVICE
        limits.check_limit(self.path, self.vertices, limits.MAX_VERTICES, "vertices", advice)
        limits.check_limit(self.path, self.triangles, limits.MAX_TRIANGLES, "triangles", advice)
        outside = len(vertex) and (vertex.min() < 0 or vertex.max() >= len(points))
        if (counts < 0).any() or counts.sum() != len(vertex) or outside:
            actual = f"those of {mesh.GetPath()} do not fit its {len(points)} points"
            refuse(self.path, "valid faces", actual, limits.DAMAGED_ADVICE)
        return points, _Faces(counts, np.cumsum(counts) - counts, vertex)

    def _corner_order(self, mesh: UsdGeom.Mesh, faces: _Faces, matrix: Doubles) -> Index:
        """Return the order of corners (c,) in which polygons are anticlockwise when seen from outside.

        matrix : (4, 4) transform from the mesh to the scene
        """
        is_left = mesh.GetOrientationAttr().Get(self.time) == "leftHanded"
        if is_left != bool(np.linalg.det(matrix[:3, :3]) < 0):
            return faces.reversed_corners()
        return np.arange(len(faces.vertex))

    def _material_groups(self, prim: Usd.Prim, face_count: int) -> tuple[list[int], Index]:
        """Return the material indices of a mesh, and the position of each face's material in this list.

        The material index -1 means no material. The positions have the shape (face_count,); faces that are
        holes have the position -1.
        """
        binding = self.shade.MaterialBindingAPI(prim)
        materials, group = [self._bound_material_index(binding)], np.zeros(face_count, np.int64)
        for subset in binding.GetMaterialBindSubsets():
            faces = np.array(subset.GetIndicesAttr().Get(self.time) or [], np.int64)
            self._check_face_indices(faces, face_count, subset.GetPath())
            group[faces] = len(materials)
            materials.append(self._bound_material_index(self.shade.MaterialBindingAPI(subset.GetPrim())))
        holes = np.array(self.geom.Mesh(prim).GetHoleIndicesAttr().Get(self.time) or [], np.int64)
        self._check_face_indices(holes, face_count, prim.GetPath())
        group[holes] = -1
        return materials, group

    def _check_face_indices(self, faces: Index, face_count: int, prim_path: object) -> None:
        if len(faces) and (faces.min() < 0 or faces.max() >= face_count):
            actual = f"{prim_path} has some from {faces.min()} to {faces.max()}"
            refuse(self.path, f"indices of faces from 0 to {face_count - 1}", actual, limits.DAMAGED_ADVICE)

    def _bound_material_index(self, binding: UsdShade.MaterialBindingAPI) -> int:
        material = binding.ComputeBoundMaterial()[0]
        if not material:
            return -1
        key = str(material.GetPath())
        if key not in self.material_index:
            self.material_index[key] = len(self.materials)
            self.materials.append(self.material_reader.read(material))
        return self.material_index[key]

    def _find_uv(self, prim: Usd.Prim, faces: _Faces, material_indices: list[int]) -> _Primvar | None:
        """Return the uv set that the materials use, or else one with a usual name; None if there is none."""
        named = dict.fromkeys(
            one for k in material_indices if k >= 0 and (one := self.materials[k].get("uv"))
        )
        if len(named) > 1:
            self.notes[_SEVERAL_UV_NOTE] = None
        primvars = self.geom.PrimvarsAPI(prim)
        typed = [one for one in primvars.GetPrimvars() if "texCoord2" in str(one.GetTypeName())]
        names = (*named, *_UV_NAMES, *(str(one.GetPrimvarName()) for one in typed))
        found = (self._read_primvar(primvars.FindPrimvarWithInheritance(name), faces, 2) for name in names)
        return next((one for one in found if one is not None), None)

    def _read_primvar(self, primvar: UsdGeom.Primvar, faces: _Faces, component_count: int) -> _Primvar | None:
        """Convert a primvar of the file; return None unless its elements have `component_count` numbers."""
        if not primvar or not primvar.HasValue():
            return None
        values = np.array(primvar.Get(self.time), np.float64)
        if values.size == 0 or values.shape[-1] != component_count:
            return None
        element = faces.element_of_corner(str(primvar.GetInterpolation()))
        if element is not None and primvar.IsIndexed():
            element = np.array(primvar.GetIndices(self.time), np.int64)[element]
        return self._checked_primvar(
            values.reshape(-1, component_count), element, primvar.GetAttr().GetPath()
        )

    def _checked_primvar(
        self, primvar_values: Doubles, element_index: Index | None, attribute_path: object
    ) -> _Primvar:
        if element_index is None or (
            len(element_index) and (element_index.min() < 0 or element_index.max() >= len(primvar_values))
        ):
            actual = f"{attribute_path} has other numbers of values"
            refuse(self.path, "a value for each vertex or corner", actual, limits.DAMAGED_ADVICE)
        return _Primvar(primvar_values, element_index)

    def _read_normals(self, mesh: UsdGeom.Mesh, faces: _Faces) -> _Primvar | None:
        """Return the normals of a mesh; None for a subdivision surface, and for a mesh without normals."""
        if mesh.GetSubdivisionSchemeAttr().Get(self.time) != "none":
            return None
        primvars = self.geom.PrimvarsAPI(mesh.GetPrim())
        found = self._read_primvar(primvars.GetPrimvar("normals"), faces, 3)
        given = mesh.GetNormalsAttr().Get(self.time)
        if found is not None or not given:
            return found
        element = faces.element_of_corner(str(mesh.GetNormalsInterpolation()))
        return self._checked_primvar(np.array(given, np.float64), element, mesh.GetPath())

    def _read_colours(
        self, prim: Usd.Prim, faces: _Faces, material_indices: list[int], vertex_count: int
    ) -> tuple[list[float] | None, Doubles | None]:
        """Return the colour of a whole mesh, and vertex colours (vertex_count, 3); one or both are None."""
        named = [one for k in material_indices if k >= 0 and (one := self.materials[k].get("vertex_colours"))]
        if not named and any(k >= 0 for k in material_indices):
            return None, None
        primvars = self.geom.PrimvarsAPI(prim)
        primvar = primvars.FindPrimvarWithInheritance(named[0] if named else "displayColor")
        found = self._read_primvar(primvar, faces, 3)
        if found is None or not len(faces.vertex):
            return None, None
        if primvar.GetInterpolation() == "constant" and not named:
            return found.values[0].tolist(), None
        weight = np.maximum(np.bincount(faces.vertex, minlength=vertex_count), 1)
        sums = [
            np.bincount(faces.vertex, found.values[found.corner_index, k], vertex_count) for k in range(3)
        ]
        return None, np.clip(np.column_stack(sums) / weight[:, None], 0.0, 1.0)


def _normalise(vectors: Doubles) -> Doubles:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def decode(request: Arrays) -> Arrays:
    """Return the meshes of a file, see `_SceneReader.read`.

    request : absolute path of the file under "file", and the path that the user typed under "path"
    """
    file, path = (Path(text_from_array(request[name])) for name in ("file", "path"))
    stage, folder = open_stage(file, path, Path.cwd())
    return _SceneReader(path, stage, folder).read()


if __name__ == "__main__":
    answer_request(decode)
