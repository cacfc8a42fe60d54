"""Morph targets, skeleton and gaze of the parametric human."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.human.cheeks import cheek_bulges
from dermis.human.makehuman import EXPRESSION_PREFIX, Points, makehuman_arrays, target_deltas
from dermis.mesh.rig import BoneRotation, MorphTargets, Skeleton

_BONE_ORIGINS: dict[str, tuple[str, str, float]] = {  # two joints, and the position between them, 0 to 1
    "spine": ("neck", "neck", 0.0),
    "clavicle.L": ("l-clavicle", "l-clavicle", 0.0),
    "clavicle.R": ("r-clavicle", "r-clavicle", 0.0),
    "neck01": ("neck", "head", 0.0),
    "neck02": ("neck", "head", 1 / 3),
    "neck03": ("neck", "head", 2 / 3),
    "head": ("head", "head", 0.0),
    "jaw": ("mouth", "mouth", 0.0),
    "eye.L": ("l-eye", "l-eye", 0.0),
    "eye.R": ("r-eye", "r-eye", 0.0),
}
_BONE_PARENTS = {"neck02": "neck01", "neck03": "neck02", "head": "neck03"}
_BONE_PARENTS |= dict.fromkeys(("jaw", "eye.L", "eye.R"), "head")
_BONE_PARENTS |= dict.fromkeys(("neck01", "clavicle.L", "clavicle.R"), "spine")
# rotation of an eye at a weight of 1
_GAZE_SIDEWAYS_DEGREES, _GAZE_UP_DEGREES, _GAZE_DOWN_DEGREES = 28.0, 20.0, 22.0
_GAZE_ANGLES = {
    "In": (0.0, -_GAZE_SIDEWAYS_DEGREES, 0.0),
    "Out": (0.0, _GAZE_SIDEWAYS_DEGREES, 0.0),
    "Up": (-_GAZE_UP_DEGREES, 0.0, 0.0),
    "Down": (_GAZE_DOWN_DEGREES, 0.0, 0.0),
}
"""Rotation angles of the left eye (at +X) about x, y and z for each direction of gaze [degrees].

For the right eye, the angle about y has the opposite sign.
"""


def gaze_rotations() -> tuple[BoneRotation, ...]:
    """Return the rotations of the eye bones for the ARKit targets whose names start with eyeLook."""
    return tuple(
        BoneRotation(f"eyeLook{direction}{name}", f"eye.{name[0]}", (x, side * y, z))
        for name, side in (("Left", 1.0), ("Right", -1.0))
        for direction, (x, y, z) in _GAZE_ANGLES.items()
    )


@cache
def expression_targets() -> MorphTargets:
    """Return the ARKit blend shapes of skin, teeth and tongue; eyeballs are rotated by bones instead."""
    targets, names = target_deltas(), list[str]()
    points, deltas = list[NDArray[np.int64]](), list[Points]()
    for index, full_name in enumerate(targets.names):
        if full_name.startswith(EXPRESSION_PREFIX):
            part = np.arange(*targets.first[index : index + 2])
            part = part[_blend_shape_point_mask()[targets.point[part]]]
            names.append(name := full_name.removeprefix(EXPRESSION_PREFIX))
            point, delta_mm = targets.point[part].astype(np.int64), targets.delta_mm[part].astype(np.float64)
            if name in cheek_bulges():
                point, delta_mm = _sum_displacements(point, delta_mm, *cheek_bulges()[name])
            points.append(point)
            deltas.append(delta_mm)
    first, all_points = np.cumsum([0, *map(len, points)]), np.concatenate(points)
    return MorphTargets(
        tuple(names),
        first.astype(np.int32),
        all_points.astype(np.int32),
        np.concatenate(deltas).astype(np.float32),
    )


def _sum_displacements(
    point: NDArray[np.int64], delta_mm: Points, more_points: NDArray[np.int64], more_mm: Points
) -> tuple[NDArray[np.int64], Points]:
    """Return the points that two sets of displacements move, sorted, and their sums (n, 3) [mm]."""
    union, index = np.unique(np.concatenate([point, more_points]), return_inverse=True)
    total = np.zeros((len(union), 3))
    np.add.at(total, index.reshape(-1), np.concatenate([delta_mm, more_mm]))
    return union, total


@cache
def _blend_shape_point_mask() -> NDArray[np.bool_]:
    """Return a mask (n,) of MakeHuman's points that blend shapes may move: all but joints and eyeballs."""
    arrays = makehuman_arrays()
    balls = [index for index, name in enumerate(arrays["group_names"]) if str(name).endswith("-eye")]
    moved = np.ones(len(arrays["positions_mm"]), bool)
    moved[len(moved) - len(arrays["joint_names"]) :] = False
    moved[np.unique(arrays["quads"][np.isin(arrays["group"], balls)])] = False
    return moved


def build_skeleton(
    joint_mm: Points, eye_centres_mm: tuple[Points, Points], eyeball_point_count: int
) -> Skeleton:
    """Return the skeleton of a person: spine, clavicles, three neck bones, head, jaw and eyes.

    joint_mm : (j, 3) positions of the person's joints [mm]
    eye_centres_mm : centres (3,) of rotation of the left and the right eyeball [mm]
    eyeball_point_count : number of points of an eyeball; the points of the left and then of the right eyeball
        come after all other points
    """
    arrays = makehuman_arrays()
    names = tuple(map(str, arrays["bone_names"]))
    joints = dict(zip(map(str, arrays["joint_names"]), joint_mm, strict=True))
    joints |= dict(zip(("l-eye", "r-eye"), eye_centres_mm, strict=True))
    origins_mm = np.array(
        [(1 - t) * joints[a] + t * joints[b] for a, b, t in (_BONE_ORIGINS[name] for name in names)]
    )
    parent = np.array([names.index(_BONE_PARENTS[n]) if n in _BONE_PARENTS else -1 for n in names], np.int32)
    local, bind = (np.tile(np.eye(4), (len(names), 1, 1)) for _ in range(2))
    local[:, :3, 3] = origins_mm - np.where(parent[:, None] >= 0, origins_mm[parent], 0.0)
    bind[:, :3, 3] = -origins_mm
    bone, weight = _skin_weights(tuple(names.index(name) for name in ("eye.L", "eye.R")), eyeball_point_count)
    return Skeleton(names, parent, local, bind, np.eye(4), bone, weight)


@cache
def _skin_weights(
    eye_bones: tuple[int, ...], eyeball_point_count: int
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return the indices (p, 4) of the four bones that move each point, and their skinning weights (p, 4).

    The points of an eyeball follow only the bone of that eye.

    eye_bones : indices of the bones of the left and the right eye
    eyeball_point_count : number of points of an eyeball; the points of the left and then of the right eyeball
        come after all other points
    """
    arrays = makehuman_arrays()
    weights = arrays["weight"].astype(np.float32)
    eyeball_weights = np.zeros((2 * eyeball_point_count, weights.shape[1]), np.float32)
    eyeball_weights[:, 0] = 1.0
    bone = np.concatenate([arrays["bone"], np.zeros_like(eyeball_weights)]).astype(np.int32)
    bone[len(weights) :, 0] = np.repeat(eye_bones, eyeball_point_count)
    return bone, np.concatenate([weights / weights.sum(axis=1, keepdims=True), eyeball_weights])
