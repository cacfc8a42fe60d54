"""What moves a head, in a USD stage: blend shapes and a skeleton (UsdSkel)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Tf, Usd, UsdSkel, Vt

from dermis.apps.export.targets.usd.geometry import METRES, corner_of_point, metres
from dermis.formats.moved_points import MovedPoints, influences
from dermis.mesh.skeleton import Skeleton

Doubles = NDArray[np.float64]


def add_motion(stage: Usd.Stage, root: Sdf.Path, mesh: Usd.Prim, moved: MovedPoints) -> None:
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
    """Names that a stage can have, each once: letters, digits and low lines."""
    found: list[str] = []
    for name in names:
        plain = Tf.MakeValidIdentifier(name)
        number = sum(one == plain or one.startswith(f"{plain}_again") for one in found)
        found.append(f"{plain}_again{number}" if number else plain)
    return found


def _add_joints(made: UsdSkel.Skeleton, skeleton: Skeleton | None) -> list[str]:
    """Bones as paths from the root; a head without has one that stays, for blend shapes need a skeleton."""
    joints, local, bound = ["root"], np.eye(4)[None], np.eye(4)[None]
    if skeleton is not None:
        joints = []
        for name, parent in zip(valid_names(skeleton.names), skeleton.parent.tolist(), strict=True):
            joints.append(f"{joints[parent]}/{name}" if parent >= 0 else name)
        local, bound = _places(skeleton)
    made.CreateJointsAttr(joints)
    for attribute, matrices in (
        (made.CreateRestTransformsAttr, local),
        (made.CreateBindTransformsAttr, bound),
    ):
        attribute(Vt.Matrix4dArray([Gf.Matrix4d(matrix.T) for matrix in matrices]))
    return joints


def _places(skeleton: Skeleton) -> tuple[Doubles, Doubles]:
    """(b, 4, 4) from each bone to its parent at rest, and to the head where its points are bound [m]."""
    to_file = np.diag([METRES, METRES, METRES, 1.0]) @ skeleton.to_head
    size = float(np.cbrt(abs(np.linalg.det(to_file[:3, :3]))))
    grown, shrunk = (np.diag([one, one, one, 1.0]) for one in (size, 1.0 / size))
    above = np.where((skeleton.parent < 0)[:, None, None], to_file, grown)
    bound = np.linalg.inv(grown @ skeleton.inverse_bind @ np.linalg.inv(to_file))
    return np.asarray(above @ skeleton.local @ shrunk), np.asarray(bound)


def _bind_joints(binding: UsdSkel.BindingAPI, moved: MovedPoints) -> None:
    count = int(moved.head.mesh.point.max()) + 1
    still = np.zeros((count, 1), np.int64), np.ones((count, 1))
    bone, share = still if moved.rig.skeleton is None else influences(moved.rig, moved.finer)
    bones = Vt.IntArray.FromNumpy(np.ascontiguousarray(bone, np.int32).ravel())
    shares = Vt.FloatArray.FromNumpy(np.ascontiguousarray(share, np.float32).ravel())
    binding.CreateJointIndicesPrimvar(False, bone.shape[1]).Set(bones)
    binding.CreateJointWeightsPrimvar(False, bone.shape[1]).Set(shares)
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))


def _add_shapes(stage: Usd.Stage, mesh: Usd.Prim, moved: MovedPoints, names: Sequence[str]) -> None:
    one = corner_of_point(moved.head.mesh)
    point = np.full(len(moved.head.mesh.positions), -1, np.int32)
    point[one] = np.arange(len(one))
    own_names = moved.rig.targets.names
    for name, told, target in zip(names, own_names, moved.targets(), strict=True):
        shape = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(name))
        kept = point[target.vertex] >= 0
        order = np.argsort(point[target.vertex][kept])
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(metres(target.delta_mm[kept][order])))
        shape.CreateNormalOffsetsAttr(
            Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(target.normal[kept][order]))
        )
        shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(point[target.vertex][kept][order]))
        if name != told:
            shape.GetPrim().SetDisplayName(told)
