"""A head's geometry in a USD stage: one mesh with a subset for each material, and hairs as curves; metres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, Vt

from dermis.formats.moved_points import MovedPoints
from dermis.mesh.eyeball import eye_uv
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Strands, points_of

Floats = NDArray[np.float32]
Ints = NDArray[np.int32]
METRES = 1e-3
"""Of a millimetre."""


class Faces(NamedTuple):
    """Polygons: quads first, then triangles that are no half of one.

    sides : (f,) corners of each
    corner : (n,) vertices of the mesh, face after face
    material : (f,)
    """

    sides: Ints
    corner: Ints
    material: Ints


def faces_of(mesh: Mesh) -> Faces:
    """The polygons of a mesh whose quads are in halves."""
    halves, triangles = mesh.quads, mesh.triangles
    alone = np.delete(np.arange(len(triangles)), halves.ravel())
    quads = np.column_stack([triangles[halves[:, 0]], triangles[halves[:, 1]][:, 1]])
    return Faces(
        np.concatenate([np.full(len(halves), 4), np.full(len(alone), 3)]).astype(np.int32),
        np.concatenate([quads.ravel(), triangles[alone].ravel()]).astype(np.int32),
        np.concatenate([mesh.material[halves[:, 0]], mesh.material[alone]]),
    )


def corner_of_point(mesh: Mesh) -> NDArray[np.intp]:
    """(p,) a vertex of each point."""
    return np.unique(mesh.point, return_index=True)[1]


def add_mesh(stage: Usd.Stage, path: Sdf.Path, head: Head, moved: MovedPoints) -> dict[int, UsdGeom.Subset]:
    """Write the mesh at rest; the subset's prim of each material that is used.

    moved : the head's vertices with all morph targets at 0
    """
    mesh, faces = head.mesh, faces_of(head.mesh)
    one = corner_of_point(mesh)
    made = UsdGeom.Mesh.Define(stage, path)
    points = Vt.Vec3fArray.FromNumpy(metres(moved.positions_mm[one]))
    made.CreatePointsAttr(points)
    made.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(faces.sides))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.point[faces.corner].astype(np.int32)))
    made.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(moved.normals[one])))
    made.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    _add_uv(made, texture_coordinates(head), faces)
    subsets = {}
    for kind in np.unique(faces.material).tolist():
        own = Vt.IntArray.FromNumpy(np.flatnonzero(faces.material == kind).astype(np.int32))
        subsets[kind] = UsdGeom.Subset.CreateGeomSubset(
            made, f"part_{kind}", UsdGeom.Tokens.face, own, "materialBind"
        )
    UsdGeom.Subset.SetFamilyType(made, "materialBind", UsdGeom.Tokens.partition)
    return subsets


def texture_coordinates(head: Head) -> Floats:
    """(v, 2) of the vertices, v downwards: eyes of true shape by the layout of their picture."""
    mesh, found = head.mesh, head.mesh.uv.copy()
    if head.eyes is not None:
        frames = head.eyes.frames(head.control, head.control.rest)
        for material, frame in zip(head.eyes.material, frames, strict=True):
            own = np.unique(mesh.triangles[mesh.material == material])
            found[own] = eye_uv(mesh.positions[own] @ frame[:3, :3].T + frame[:3, 3])
    return found


def _add_uv(made: UsdGeom.Mesh, uv: Floats, faces: Faces) -> None:
    """Texture coordinates (v, 2) with v upwards, one for each vertex of ours."""
    upwards = np.ascontiguousarray(np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]), np.float32)
    primvar = UsdGeom.PrimvarsAPI(made).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    primvar.Set(Vt.Vec2fArray.FromNumpy(upwards))
    primvar.SetIndices(Vt.IntArray.FromNumpy(faces.corner))


def add_hairs(stage: Usd.Stage, path: Sdf.Path, head: Head, strands: Strands) -> UsdGeom.BasisCurves:
    """Write hairs at rest as lines with a width at each knot."""
    places = strands.places_mm(head.mesh, points_of(head.mesh))
    made = UsdGeom.BasisCurves.Define(stage, path)
    count = np.full(len(places), places.shape[1], np.int32)
    points = Vt.Vec3fArray.FromNumpy(metres(places.reshape(-1, 3)))
    widths = Vt.FloatArray.FromNumpy((2.0 * METRES * strands.radius_mm.ravel()).astype(np.float32))
    made.CreateTypeAttr(UsdGeom.Tokens.linear)
    made.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(count))
    made.CreatePointsAttr(points)
    made.CreateWidthsAttr(widths)
    made.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    made.CreateExtentAttr(UsdGeom.Curves.ComputeExtent(points, widths))
    return made


def metres(places_mm: NDArray[np.floating]) -> Floats:
    """Of places in mm."""
    return np.ascontiguousarray(METRES * places_mm.astype(np.float64), np.float32)
