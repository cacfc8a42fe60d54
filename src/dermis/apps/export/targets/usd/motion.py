"""What moves a head, in a USD stage: blend shapes and a skeleton (UsdSkel)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.usd.geometry import METRES, TASK, corner_of_point, metres
from dermis.base.extras import needed
from dermis.formats.moved_points import MovedPoints, influences
from dermis.mesh.skeleton import Skeleton

Doubles = NDArray[np.float64]


def add_motion(stage: Any, root: Any, mesh: Any, moved: MovedPoints) -> None:
    """Write blend shapes and bones beside a mesh, and how both rest.

    root : path of the UsdSkelRoot
    mesh : the prim that they move
    """
    skel, sdf = needed("pxr.UsdSkel", TASK), needed("pxr.Sdf", TASK)
    path = root.AppendChild("skeleton")
    made = skel.Skeleton.Define(stage, path)
    skeleton = moved.rig.skeleton
    joints = _add_joints(made, skeleton)
    rest = skel.Animation.Define(stage, path.AppendChild("rest"))
    binding = skel.BindingAPI.Apply(mesh)
    binding.CreateSkeletonRel().SetTargets([path])
    skel.BindingAPI.Apply(made.GetPrim()).CreateAnimationSourceRel().SetTargets([rest.GetPath()])
    _bind_joints(binding, moved)
    rest.CreateJointsAttr(joints)
    rest.SetTransforms(made.GetRestTransformsAttr().Get())
    names = valid_names(moved.rig.targets.names)
    if names:
        _add_shapes(stage, mesh, moved, names)
        binding.CreateBlendShapesAttr(names)
        shapes = [mesh.GetPath().AppendChild(name) for name in names]
        binding.CreateBlendShapeTargetsRel().SetTargets([sdf.Path(str(shape)) for shape in shapes])
        weights = moved.rig.targets.rest
        rest.CreateBlendShapesAttr(names)
        rest.CreateBlendShapeWeightsAttr([0.0] * len(names) if weights is None else weights.tolist())


def valid_names(names: Sequence[str]) -> list[str]:
    """Names that a stage can have, each once: letters, digits and low lines."""
    tf = needed("pxr.Tf", TASK)
    found: list[str] = []
    for name in names:
        plain = tf.MakeValidIdentifier(name)
        number = sum(one == plain or one.startswith(f"{plain}_again") for one in found)
        found.append(f"{plain}_again{number}" if number else plain)
    return found


def _add_joints(made: Any, skeleton: Skeleton | None) -> list[str]:
    """Bones as paths from the root; a head without has one that stays, for blend shapes need a skeleton."""
    gf, vt = needed("pxr.Gf", TASK), needed("pxr.Vt", TASK)
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
        attribute(vt.Matrix4dArray([gf.Matrix4d(matrix.T) for matrix in matrices]))
    return joints


def _places(skeleton: Skeleton) -> tuple[Doubles, Doubles]:
    """(b, 4, 4) from each bone to its parent at rest, and to the head where its points are bound [m]."""
    to_file = np.diag([METRES, METRES, METRES, 1.0]) @ skeleton.to_head
    size = float(np.cbrt(abs(np.linalg.det(to_file[:3, :3]))))
    grown, shrunk = (np.diag([one, one, one, 1.0]) for one in (size, 1.0 / size))
    above = np.where((skeleton.parent < 0)[:, None, None], to_file, grown)
    bound = np.linalg.inv(grown @ skeleton.inverse_bind @ np.linalg.inv(to_file))
    return np.asarray(above @ skeleton.local @ shrunk), np.asarray(bound)


def _bind_joints(binding: Any, moved: MovedPoints) -> None:
    count = int(moved.head.mesh.point.max()) + 1
    still = np.zeros((count, 1), np.int64), np.ones((count, 1))
    bone, share = still if moved.rig.skeleton is None else influences(moved.rig, moved.finer)
    gf, vt = needed("pxr.Gf", TASK), needed("pxr.Vt", TASK)
    bones = vt.IntArray.FromNumpy(np.ascontiguousarray(bone, np.int32).ravel())
    shares = vt.FloatArray.FromNumpy(np.ascontiguousarray(share, np.float32).ravel())
    binding.CreateJointIndicesPrimvar(False, bone.shape[1]).Set(bones)
    binding.CreateJointWeightsPrimvar(False, bone.shape[1]).Set(shares)
    binding.CreateGeomBindTransformAttr(gf.Matrix4d(1.0))


def _add_shapes(stage: Any, mesh: Any, moved: MovedPoints, names: Sequence[str]) -> None:
    skel, vt = needed("pxr.UsdSkel", TASK), needed("pxr.Vt", TASK)
    one = corner_of_point(moved.head.mesh)
    point = np.full(len(moved.head.mesh.positions), -1, np.int32)
    point[one] = np.arange(len(one))
    own_names = moved.rig.targets.names
    for name, told, target in zip(names, own_names, moved.targets(), strict=True):
        shape = skel.BlendShape.Define(stage, mesh.GetPath().AppendChild(name))
        kept = point[target.vertex] >= 0
        order = np.argsort(point[target.vertex][kept])
        shape.CreateOffsetsAttr(vt.Vec3fArray.FromNumpy(metres(target.delta_mm[kept][order])))
        shape.CreateNormalOffsetsAttr(
            vt.Vec3fArray.FromNumpy(np.ascontiguousarray(target.normal[kept][order]))
        )
        shape.CreatePointIndicesAttr(vt.IntArray.FromNumpy(point[target.vertex][kept][order]))
        if name != told:
            shape.GetPrim().SetDisplayName(told)
