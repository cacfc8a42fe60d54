"""Geometry of a head in a USD stage in metres: mesh, hairs, blend shapes and skeleton (UsdSkel)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt

from dermis.formats.deformable_mesh import DeformableMesh, point_bone_influences
from dermis.mesh.eyeball import eye_uv
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.skeleton import Skeleton
from dermis.mesh.strands import Strands

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]
METRES_PER_MM = 1e-3


class Polygons(NamedTuple):
    """Polygons of a mesh: first the quads, then triangles that belong to no quad.

    vertex_counts : (f,) number of vertices of each polygon, 4 or 3
    vertices : (n,) vertex indices of all polygons, one polygon after another
    material : (f,) material index of each polygon
    """

    vertex_counts: Ints
    vertices: Ints
    material: Ints


def mesh_polygons(mesh: Mesh) -> Polygons:
    """Return the polygons of a mesh, with the two triangles of each quad joined."""
    halves, triangles = mesh.quads, mesh.triangles
    single = np.delete(np.arange(len(triangles)), halves.ravel())
    quads = np.column_stack([triangles[halves[:, 0]], triangles[halves[:, 1]][:, 1]])
    return Polygons(
        np.concatenate([np.full(len(halves), 4), np.full(len(single), 3)]).astype(np.int32),
        np.concatenate([quads.ravel(), triangles[single].ravel()]).astype(np.int32),
        np.concatenate([mesh.material[halves[:, 0]], mesh.material[single]]),
    )


def first_vertex_by_point(mesh: Mesh) -> NDArray[np.intp]:
    """Return the index (p,) of the first vertex at each point; the vertices at a uv seam share a point."""
    return np.unique(mesh.point, return_index=True)[1]


def add_mesh(
    usd_stage: Usd.Stage, mesh_path: Sdf.Path, head: Head, deformable_mesh: DeformableMesh
) -> dict[int, UsdGeom.Subset]:
    """Add the head's mesh in its rest pose to the stage; return the geometry subsets by material index.

    deformable_mesh : the head's mesh with morph targets and bone weights, all morph targets at weight 0
    """
    mesh, polygons = head.mesh, mesh_polygons(head.mesh)
    vertex = first_vertex_by_point(mesh)
    prim = UsdGeom.Mesh.Define(usd_stage, mesh_path)
    points = Vt.Vec3fArray.FromNumpy(to_metres(deformable_mesh.positions_mm[vertex]))
    prim.CreatePointsAttr(points)
    prim.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(polygons.vertex_counts))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.point[polygons.vertices].astype(np.int32)))
    prim.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(deformable_mesh.normals[vertex])))
    prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    if head.maps.parts is not None:
        prim.CreateDoubleSidedAttr(True)
    _add_uv(prim, texture_coordinates(head), polygons)
    subsets, family, tokens = {}, "materialBind", UsdGeom.Tokens
    for k in np.unique(polygons.material).tolist():
        faces = Vt.IntArray.FromNumpy(np.flatnonzero(polygons.material == k).astype(np.int32))
        subsets[k] = UsdGeom.Subset.CreateGeomSubset(prim, f"part_{k}", tokens.face, faces, family)
    UsdGeom.Subset.SetFamilyType(prim, family, tokens.partition)
    return subsets


def texture_coordinates(head: Head) -> Floats:
    """Return the texture coordinates (v, 2) of all vertices, with v downwards.

    Vertices of eyes have coordinates in the painted eye textures.
    """
    mesh, uv = head.mesh, head.mesh.uv.copy()
    if head.eyes is not None:
        frames = head.eyes.eye_matrices(head.control_rig, head.control_rig.rest)
        for material, frame in zip(head.eyes.material, frames, strict=True):
            eye = np.unique(mesh.triangles[mesh.material == material])
            uv[eye] = eye_uv(mesh.positions[eye] @ frame[:3, :3].T + frame[:3, 3])
    return uv


def _add_uv(mesh_prim: UsdGeom.Mesh, uv: Floats, polygons: Polygons) -> None:
    """Add texture coordinates to a mesh as face-varying values, with v upwards as in USD.

    uv : (v, 2) texture coordinates of the vertices, with v downwards
    """
    upwards = np.ascontiguousarray(np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]), np.float32)
    types, tokens = Sdf.ValueTypeNames, UsdGeom.Tokens
    primvar = UsdGeom.PrimvarsAPI(mesh_prim).CreatePrimvar("st", types.TexCoord2fArray, tokens.faceVarying)
    primvar.Set(Vt.Vec2fArray.FromNumpy(upwards))
    primvar.SetIndices(Vt.IntArray.FromNumpy(polygons.vertices))


def add_hairs(
    usd_stage: Usd.Stage, curves_path: Sdf.Path, head: Head, strands: Strands
) -> UsdGeom.BasisCurves:
    """Add hairs in the rest pose to the stage, as linear curves with a width at each knot."""
    knots = strands.knot_positions_mm(head.mesh, head.mesh.points_mm)
    prim = UsdGeom.BasisCurves.Define(usd_stage, curves_path)
    count = np.full(len(knots), knots.shape[1], np.int32)
    points = Vt.Vec3fArray.FromNumpy(to_metres(knots.reshape(-1, 3)))
    widths = Vt.FloatArray.FromNumpy((2.0 * METRES_PER_MM * strands.radius_mm.ravel()).astype(np.float32))
    prim.CreateTypeAttr(UsdGeom.Tokens.linear)
    prim.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(count))
    prim.CreatePointsAttr(points)
    prim.CreateWidthsAttr(widths)
    prim.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    prim.CreateExtentAttr(UsdGeom.Curves.ComputeExtent(points, widths))
    return prim


def to_metres(positions_mm: NDArray[np.floating]) -> Floats:
    """Return positions converted from mm to the metres of the stage."""
    return np.ascontiguousarray(METRES_PER_MM * positions_mm.astype(np.float64), np.float32)


def add_rig(
    usd_stage: Usd.Stage, rig_root_path: Sdf.Path, mesh_prim: Usd.Prim, deformable_mesh: DeformableMesh
) -> None:
    """Add blend shapes and a skeleton, which programs can pose, and an animation that holds the rest pose.

    rig_root_path : path of the UsdSkelRoot
    mesh_prim : mesh that the blend shapes and the skeleton deform
    deformable_mesh : the head's mesh with morph targets and bone weights, all morph targets at weight 0
    """
    path = rig_root_path.AppendChild("skeleton")
    skeleton = UsdSkel.Skeleton.Define(usd_stage, path)
    joints = _add_joints(skeleton, deformable_mesh.rig.skeleton)
    rest = UsdSkel.Animation.Define(usd_stage, path.AppendChild("rest"))
    binding = UsdSkel.BindingAPI.Apply(mesh_prim)
    binding.CreateSkeletonRel().SetTargets([path])
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([rest.GetPath()])
    _bind_joints(binding, deformable_mesh)
    rest.CreateJointsAttr(joints)
    rest.SetTransforms(skeleton.GetRestTransformsAttr().Get())
    names = unique_usd_names(deformable_mesh.rig.targets.names)
    if names:
        _add_blend_shapes(usd_stage, mesh_prim, deformable_mesh, names)
        binding.CreateBlendShapesAttr(names)
        shapes = [mesh_prim.GetPath().AppendChild(name) for name in names]
        binding.CreateBlendShapeTargetsRel().SetTargets([Sdf.Path(str(shape)) for shape in shapes])
        weights = deformable_mesh.rig.targets.rest
        rest.CreateBlendShapesAttr(names)
        rest.CreateBlendShapeWeightsAttr([0.0] * len(names) if weights is None else weights.tolist())


def unique_usd_names(original_names: Sequence[str]) -> list[str]:
    """Return the names made unique, and reduced to letters, digits and underscores as USD requires."""
    valid: list[str] = []
    for name in original_names:
        identifier = Tf.MakeValidIdentifier(name)
        number = sum(one == identifier or one.startswith(f"{identifier}_again") for one in valid)
        valid.append(f"{identifier}_again{number}" if number else identifier)
    return valid


def _add_joints(usd_skeleton: UsdSkel.Skeleton, skeleton: Skeleton | None) -> list[str]:
    """Set the joints of a USD skeleton, and return their paths; a head without bones gets one joint."""
    joints, rest, bind = ["root"], np.eye(4)[None], np.eye(4)[None]
    if skeleton is not None:
        joints = []
        for name, parent in zip(unique_usd_names(skeleton.names), skeleton.parent.tolist(), strict=True):
            joints.append(f"{joints[parent]}/{name}" if parent >= 0 else name)
        rest, bind = _bone_transforms(skeleton)
    usd_skeleton.CreateJointsAttr(joints)
    for create, matrices in (
        (usd_skeleton.CreateRestTransformsAttr, rest),
        (usd_skeleton.CreateBindTransformsAttr, bind),
    ):
        create(Vt.Matrix4dArray([Gf.Matrix4d(matrix.T) for matrix in matrices]))
    return joints


def _bone_transforms(skeleton: Skeleton) -> tuple[Doubles, Doubles]:
    """Return the rest and bind transforms of the bones, each (b, 4, 4), in metres.

    The rest transform of a bone is relative to the bone's parent; the bind transform is relative to the head.
    """
    to_file = np.diag([METRES_PER_MM, METRES_PER_MM, METRES_PER_MM, 1.0]) @ skeleton.to_head
    scale = float(np.cbrt(abs(np.linalg.det(to_file[:3, :3]))))
    enlarge, reduce = (np.diag([factor, factor, factor, 1.0]) for factor in (scale, 1.0 / scale))
    parent = np.where((skeleton.parent < 0)[:, None, None], to_file, enlarge)
    bind = np.linalg.inv(enlarge @ skeleton.inverse_bind @ np.linalg.inv(to_file))
    return np.asarray(parent @ skeleton.local @ reduce), np.asarray(bind)


def _bind_joints(mesh_binding: UsdSkel.BindingAPI, deformable_mesh: DeformableMesh) -> None:
    rig, count = deformable_mesh.rig, int(deformable_mesh.head.mesh.point.max()) + 1
    rigid = np.zeros((count, 1), np.int64), np.ones((count, 1))
    bone, weight = (
        rigid if rig.skeleton is None else point_bone_influences(rig, deformable_mesh.subdivision_matrix)
    )
    indices = Vt.IntArray.FromNumpy(np.ascontiguousarray(bone, np.int32).ravel())
    weights = Vt.FloatArray.FromNumpy(np.ascontiguousarray(weight, np.float32).ravel())
    mesh_binding.CreateJointIndicesPrimvar(False, bone.shape[1]).Set(indices)
    mesh_binding.CreateJointWeightsPrimvar(False, bone.shape[1]).Set(weights)
    mesh_binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))


def _add_blend_shapes(
    usd_stage: Usd.Stage, mesh_prim: Usd.Prim, deformable_mesh: DeformableMesh, shape_names: Sequence[str]
) -> None:
    vertex = first_vertex_by_point(deformable_mesh.head.mesh)
    point = np.full(len(deformable_mesh.head.mesh.positions), -1, np.int32)
    point[vertex] = np.arange(len(vertex))
    titles = deformable_mesh.rig.targets.names
    for name, title, target in zip(shape_names, titles, deformable_mesh.targets(), strict=True):
        shape = UsdSkel.BlendShape.Define(usd_stage, mesh_prim.GetPath().AppendChild(name))
        points = point[target.vertex]
        order = np.flatnonzero(points >= 0)
        order = order[np.argsort(points[order])]
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(to_metres(target.delta_mm[order])))
        shape.CreateNormalOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(target.normal[order])))
        shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(points[order]))
        if name != title:
            shape.GetPrim().SetDisplayName(title)
