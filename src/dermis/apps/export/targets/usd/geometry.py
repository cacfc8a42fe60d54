"""Geometry of a head in a USD stage in metres: mesh, hairs, blend shapes and skeleton (UsdSkel)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt

from dermis.base.arrays import Numbers
from dermis.formats.deformable_mesh import DeformableMesh, VertexMorphTarget
from dermis.formats.gltf.write import part_name
from dermis.mesh.eyeball import eye_uv
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material, Mesh
from dermis.mesh.skeleton import Skeleton

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
    """Return the index of the first vertex at each point of the stage, in the order of the points.

    The vertices at a uv seam share a point. Points of the mesh without vertices are not in the stage.
    """
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
    corner = np.searchsorted(mesh.point[vertex], mesh.point[polygons.vertices]).astype(np.int32)
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(corner))
    prim.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(deformable_mesh.normals[vertex])))
    prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    if head.maps.parts is not None:
        prim.CreateDoubleSidedAttr(True)
    _add_uv(prim, texture_coordinates(head), polygons)
    subsets, family, tokens = {}, "materialBind", UsdGeom.Tokens
    used = np.unique(polygons.material).tolist()
    taken = deformable_mesh.rig.targets.names  # blend shapes are children of the mesh, too
    names = unique_usd_names([*taken, *(_subset_name(mesh.materials[k]) for k in used)])[len(taken) :]
    for k, name in zip(used, names, strict=True):
        faces = Vt.IntArray.FromNumpy(np.flatnonzero(polygons.material == k).astype(np.int32))
        subsets[k] = UsdGeom.Subset.CreateGeomSubset(prim, name, tokens.face, faces, family)
    UsdGeom.Subset.SetFamilyType(prim, family, tokens.partition)
    return subsets


def _subset_name(material: Material) -> str:
    """Return the name of the subset with a material: "skin", "eye_left", "teeth_upper" ..."""
    return (material.name or "skin") if material.kind == "skin" else part_name(material)


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


def rest_points_mm(deformable_mesh: DeformableMesh) -> Doubles:
    """Return the points (p, 3) of the mesh with all morph targets at weight 0 [mm]."""
    return replace(deformable_mesh.head.mesh, positions=deformable_mesh.positions_mm).points_mm


def to_metres(positions_mm: NDArray[np.floating]) -> Floats:
    """Return positions converted from mm to the metres of the stage."""
    return np.ascontiguousarray(METRES_PER_MM * positions_mm.astype(np.float64), np.float32)


class Rig(NamedTuple):
    """Skeleton of a stage, with the animation that poses it.

    skeleton_path : path of the skeleton
    animation : animation with the rest pose and the weights of the blend shapes
    names : names of the blend shapes in the stage, in the order of the head's morph targets
    """

    skeleton_path: Sdf.Path
    animation: UsdSkel.Animation
    names: list[str]


def add_rig(
    usd_stage: Usd.Stage, rig_root_path: Sdf.Path, mesh_prim: Usd.Prim, deformable_mesh: DeformableMesh
) -> Rig:
    """Add a skeleton and an animation that holds the rest pose, and bind the mesh to them.

    rig_root_path : path of the UsdSkelRoot
    mesh_prim : mesh that the blend shapes and the skeleton deform
    deformable_mesh : the head's mesh with morph targets and bone weights, all morph targets at weight 0
    """
    path = rig_root_path.AppendChild("skeleton")
    skeleton = UsdSkel.Skeleton.Define(usd_stage, path)
    joints = _add_joints(skeleton, deformable_mesh.rig.skeleton)
    rest = UsdSkel.Animation.Define(usd_stage, path.AppendChild("rest"))
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([rest.GetPath()])
    vertex = first_vertex_by_point(deformable_mesh.head.mesh)
    bone: Numbers = np.zeros((len(vertex), 1))
    weight: Numbers = np.ones((len(vertex), 1))
    if deformable_mesh.rig.skeleton is not None:
        bone, weight = (values[vertex] for values in deformable_mesh.bone_influences)
    bind_to_skeleton(path, mesh_prim, bone, weight)
    rest.CreateJointsAttr(joints)
    rest.SetTransforms(skeleton.GetRestTransformsAttr().Get())
    names = unique_usd_names(deformable_mesh.rig.targets.names)
    if names:
        rest.CreateBlendShapesAttr(names)
    return Rig(path, rest, names)


def bind_to_skeleton(
    skeleton_path: Sdf.Path,
    bound_prim: Usd.Prim,
    bone: NDArray[np.number],
    weight: NDArray[np.number],
    is_rigid: bool = False,
) -> UsdSkel.BindingAPI:
    """Bind points to the joints of a skeleton.

    bone, weight : (n, b) joint indices and weights of each point; (1, b) for all points if `is_rigid`
    is_rigid : whether all points move as one rigid body
    """
    binding = UsdSkel.BindingAPI.Apply(bound_prim)
    binding.CreateSkeletonRel().SetTargets([skeleton_path])
    indices = Vt.IntArray.FromNumpy(np.ascontiguousarray(bone, np.int32).ravel())
    weights = Vt.FloatArray.FromNumpy(np.ascontiguousarray(weight, np.float32).ravel())
    binding.CreateJointIndicesPrimvar(is_rigid, bone.shape[1]).Set(indices)
    binding.CreateJointWeightsPrimvar(is_rigid, bone.shape[1]).Set(weights)
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    return binding


def bind_blend_shapes(binding: UsdSkel.BindingAPI, shape_names: Sequence[str]) -> None:
    """Set the blend shapes of a bound prim, which are children of the prim."""
    if shape_names:
        path = binding.GetPrim().GetPath()
        binding.CreateBlendShapesAttr(list(shape_names))
        binding.CreateBlendShapeTargetsRel().SetTargets([path.AppendChild(name) for name in shape_names])


def add_blend_shape(
    usd_stage: Usd.Stage,
    shape_path: Sdf.Path,
    point: NDArray[np.integer],
    delta_mm: NDArray[np.floating],
    normal: NDArray[np.floating] | None = None,
) -> UsdSkel.BlendShape:
    """Add a blend shape to the stage.

    point : (n,) indices of the moved points
    delta_mm, normal : (n, 3) changes of position [mm], and of the unit normals
    """
    shape = UsdSkel.BlendShape.Define(usd_stage, shape_path)
    shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(to_metres(delta_mm)))
    if normal is not None:
        shape.CreateNormalOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(normal, np.float32)))
    shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(point, np.int32)))
    return shape


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


def add_mesh_blend_shapes(
    usd_stage: Usd.Stage,
    mesh_prim: Usd.Prim,
    deformable_mesh: DeformableMesh,
    targets: Mapping[str, VertexMorphTarget],
) -> None:
    """Add the blend shapes of the mesh.

    targets : morph targets of the head by their names in the stage
    """
    vertex = first_vertex_by_point(deformable_mesh.head.mesh)
    point = np.full(len(deformable_mesh.head.mesh.positions), -1, np.int32)
    point[vertex] = np.arange(len(vertex))
    titles = deformable_mesh.rig.targets.names
    for (name, target), title in zip(targets.items(), titles, strict=True):
        points = point[target.vertex]
        order = np.flatnonzero(points >= 0)
        order = order[np.argsort(points[order])]
        path = mesh_prim.GetPath().AppendChild(name)
        shape = add_blend_shape(usd_stage, path, points[order], target.delta_mm[order], target.normal[order])
        if name != title:
            shape.GetPrim().SetDisplayName(title)
    bind_blend_shapes(UsdSkel.BindingAPI(mesh_prim), list(targets))
