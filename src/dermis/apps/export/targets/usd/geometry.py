"""Geometry of a head in a USD stage in metres, and what moves it.

One mesh with a subset for each material, hairs as curves, blend shapes and a skeleton (UsdSkel).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt

from dermis.formats.deformable_mesh import DeformableMesh, influences
from dermis.mesh.eyeball import eye_uv
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.skeleton import Skeleton
from dermis.mesh.strands import Strands

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]
METRES_PER_MM = 1e-3
"""Of a millimetre."""


class Polygons(NamedTuple):
    """Polygons: quads first, then triangles that are no half of one.

    sides : (f,) corners of each
    corner : (n,) vertices of the mesh, face after face
    material : (f,)
    """

    corner_counts: Ints
    vertices: Ints
    material: Ints


def mesh_polygons(mesh: Mesh) -> Polygons:
    """Return the polygons of a mesh whose quads are in halves."""
    halves, triangles = mesh.quads, mesh.triangles
    alone = np.delete(np.arange(len(triangles)), halves.ravel())
    quads = np.column_stack([triangles[halves[:, 0]], triangles[halves[:, 1]][:, 1]])
    return Polygons(
        np.concatenate([np.full(len(halves), 4), np.full(len(alone), 3)]).astype(np.int32),
        np.concatenate([quads.ravel(), triangles[alone].ravel()]).astype(np.int32),
        np.concatenate([mesh.material[halves[:, 0]], mesh.material[alone]]),
    )


def point_vertices(mesh: Mesh) -> NDArray[np.intp]:
    """Return a vertex of each point (p,)."""
    return np.unique(mesh.point, return_index=True)[1]


def add_mesh(
    stage: Usd.Stage, path: Sdf.Path, head: Head, moved: DeformableMesh
) -> dict[int, UsdGeom.Subset]:
    """Write the mesh at rest; return the subset of each material that is used.

    moved : the head's vertices with all morph targets at 0
    """
    mesh, faces = head.mesh, mesh_polygons(head.mesh)
    one = point_vertices(mesh)
    made = UsdGeom.Mesh.Define(stage, path)
    points = Vt.Vec3fArray.FromNumpy(to_metres(moved.positions_mm[one]))
    made.CreatePointsAttr(points)
    made.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(faces.corner_counts))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.point[faces.vertices].astype(np.int32)))
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
    """Return texture coordinates (v, 2) with v downwards, those of eyes by the layout of their picture."""
    mesh, found = head.mesh, head.mesh.uv.copy()
    if head.eyes is not None:
        frames = head.eyes.frames(head.control, head.control.rest)
        for material, frame in zip(head.eyes.material, frames, strict=True):
            own = np.unique(mesh.triangles[mesh.material == material])
            found[own] = eye_uv(mesh.positions[own] @ frame[:3, :3].T + frame[:3, 3])
    return found


def _add_uv(made: UsdGeom.Mesh, uv: Floats, faces: Polygons) -> None:
    """Write texture coordinates (v, 2) with v upwards, one for each vertex of ours."""
    upwards = np.ascontiguousarray(np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]), np.float32)
    primvar = UsdGeom.PrimvarsAPI(made).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    primvar.Set(Vt.Vec2fArray.FromNumpy(upwards))
    primvar.SetIndices(Vt.IntArray.FromNumpy(faces.vertices))


def add_hairs(stage: Usd.Stage, path: Sdf.Path, head: Head, strands: Strands) -> UsdGeom.BasisCurves:
    """Write hairs at rest as lines with a width at each knot."""
    places = strands.places_mm(head.mesh, head.mesh.points_mm)
    made = UsdGeom.BasisCurves.Define(stage, path)
    count = np.full(len(places), places.shape[1], np.int32)
    points = Vt.Vec3fArray.FromNumpy(to_metres(places.reshape(-1, 3)))
    widths = Vt.FloatArray.FromNumpy((2.0 * METRES_PER_MM * strands.radius_mm.ravel()).astype(np.float32))
    made.CreateTypeAttr(UsdGeom.Tokens.linear)
    made.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(count))
    made.CreatePointsAttr(points)
    made.CreateWidthsAttr(widths)
    made.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    made.CreateExtentAttr(UsdGeom.Curves.ComputeExtent(points, widths))
    return made


def to_metres(places_mm: NDArray[np.floating]) -> Floats:
    """Return places in metres."""
    return np.ascontiguousarray(METRES_PER_MM * places_mm.astype(np.float64), np.float32)


def add_motion(stage: Usd.Stage, root: Sdf.Path, mesh: Usd.Prim, moved: DeformableMesh) -> None:
    """Write blend shapes and bones beside a mesh, and how both rest.

    root : path of the UsdSkelRoot
    mesh : the prim that they move
    """
    path = root.AppendChild("skeleton")
    made = UsdSkel.Skeleton.Define(stage, path)
    skeleton = moved.rig.skeleton
    joints = _add_joints(made, skeleton)
    rest = UsdSkel.Animation.Define(stage, path.AppendChild("rest"))
    binding = UsdSkel.BindingAPI.Apply(mesh)
    binding.CreateSkeletonRel().SetTargets([path])
    UsdSkel.BindingAPI.Apply(made.GetPrim()).CreateAnimationSourceRel().SetTargets([rest.GetPath()])
    _bind_joints(binding, moved)
    rest.CreateJointsAttr(joints)
    rest.SetTransforms(made.GetRestTransformsAttr().Get())
    names = valid_names(moved.rig.targets.names)
    if names:
        _add_shapes(stage, mesh, moved, names)
        binding.CreateBlendShapesAttr(names)
        shapes = [mesh.GetPath().AppendChild(name) for name in names]
        binding.CreateBlendShapeTargetsRel().SetTargets([Sdf.Path(str(shape)) for shape in shapes])
        weights = moved.rig.targets.rest
        rest.CreateBlendShapesAttr(names)
        rest.CreateBlendShapeWeightsAttr([0.0] * len(names) if weights is None else weights.tolist())


def valid_names(names: Sequence[str]) -> list[str]:
    """Return names that a stage can have, each once: letters, digits and underscores."""
    found: list[str] = []
    for name in names:
        plain = Tf.MakeValidIdentifier(name)
        number = sum(one == plain or one.startswith(f"{plain}_again") for one in found)
        found.append(f"{plain}_again{number}" if number else plain)
    return found


def _add_joints(made: UsdSkel.Skeleton, skeleton: Skeleton | None) -> list[str]:
    """Write bones and return their paths; a head without bones has one, as blend shapes need a skeleton."""
    joints, local, bound = ["root"], np.eye(4)[None], np.eye(4)[None]
    if skeleton is not None:
        joints = []
        for name, parent in zip(valid_names(skeleton.names), skeleton.parent.tolist(), strict=True):
            joints.append(f"{joints[parent]}/{name}" if parent >= 0 else name)
        local, bound = _bone_transforms(skeleton)
    made.CreateJointsAttr(joints)
    for attribute, matrices in (
        (made.CreateRestTransformsAttr, local),
        (made.CreateBindTransformsAttr, bound),
    ):
        attribute(Vt.Matrix4dArray([Gf.Matrix4d(matrix.T) for matrix in matrices]))
    return joints


def _bone_transforms(skeleton: Skeleton) -> tuple[Doubles, Doubles]:
    """Return matrices (b, 4, 4) from bones to their parents at rest, and to the head when bound [m]."""
    to_file = np.diag([METRES_PER_MM, METRES_PER_MM, METRES_PER_MM, 1.0]) @ skeleton.to_head
    size = float(np.cbrt(abs(np.linalg.det(to_file[:3, :3]))))
    grown, shrunk = (np.diag([one, one, one, 1.0]) for one in (size, 1.0 / size))
    above = np.where((skeleton.parent < 0)[:, None, None], to_file, grown)
    bound = np.linalg.inv(grown @ skeleton.inverse_bind @ np.linalg.inv(to_file))
    return np.asarray(above @ skeleton.local @ shrunk), np.asarray(bound)


def _bind_joints(binding: UsdSkel.BindingAPI, moved: DeformableMesh) -> None:
    count = int(moved.head.mesh.point.max()) + 1
    still = np.zeros((count, 1), np.int64), np.ones((count, 1))
    bone, share = still if moved.rig.skeleton is None else influences(moved.rig, moved.refinement)
    bones = Vt.IntArray.FromNumpy(np.ascontiguousarray(bone, np.int32).ravel())
    shares = Vt.FloatArray.FromNumpy(np.ascontiguousarray(share, np.float32).ravel())
    binding.CreateJointIndicesPrimvar(False, bone.shape[1]).Set(bones)
    binding.CreateJointWeightsPrimvar(False, bone.shape[1]).Set(shares)
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))


def _add_shapes(stage: Usd.Stage, mesh: Usd.Prim, moved: DeformableMesh, names: Sequence[str]) -> None:
    one = point_vertices(moved.head.mesh)
    point = np.full(len(moved.head.mesh.positions), -1, np.int32)
    point[one] = np.arange(len(one))
    own_names = moved.rig.targets.names
    for name, own_name, target in zip(names, own_names, moved.targets(), strict=True):
        shape = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(name))
        kept = point[target.vertex] >= 0
        order = np.argsort(point[target.vertex][kept])
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(to_metres(target.delta_mm[kept][order])))
        shape.CreateNormalOffsetsAttr(
            Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(target.normal[kept][order]))
        )
        shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(point[target.vertex][kept][order]))
        if name != own_name:
            shape.GetPrim().SetDisplayName(own_name)
