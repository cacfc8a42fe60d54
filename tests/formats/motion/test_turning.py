"""Bones that rotate head and eyes, by names that programs use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_rig import random_rig
from scipy.spatial.transform import Rotation

from dermis.formats.motion.captures import (
    find_rotation_bones,
    head_bone_angles,
    match_targets,
    rotation_quaternions,
)
from dermis.mesh.pose import Pose
from dermis.mesh.rig import Rig

SKELETON = random_rig().skeleton
assert SKELETON is not None


def _named(*names: str):
    return replace(SKELETON, names=names)


@pytest.mark.parametrize(
    ("names", "fractions"),
    [
        (("root", "neck", "head", "jaw"), {"neck": 0.5, "head": 0.5}),
        (
            ("mixamorig:Spine", "mixamorig:Neck", "mixamorig:Head", "x"),
            {"mixamorig:Neck": 0.5, "mixamorig:Head": 0.5},
        ),
        (("neck01", "neck02", "Head", "HeadTop_End"), {"neck01": 0.25, "neck02": 0.25, "Head": 0.5}),
        (
            ("a", "CC_Base_NeckTwist01", "CC_Base_Head", "b"),
            {"CC_Base_NeckTwist01": 0.5, "CC_Base_Head": 0.5},
        ),
        (("a", "b", "Bip01 Head", "Forehead"), {"Bip01 Head": 1.0}),
        (("a", "DEF-neck", "b", "c"), {"DEF-neck": 1.0}),
        (("a", "b", "head", "neck"), {"head": 1.0}),  # a neck that is not above the head
        (("a", "b", "c", "d"), {}),
    ],
)
def test_head_and_neck_bones_are_found(names: tuple[str, ...], fractions: dict[str, float]) -> None:
    assert find_rotation_bones(_named(*names)).head == fractions


@pytest.mark.parametrize(
    "pair",
    [("LeftEye", "RightEye"), ("eye.L", "eye.R"), ("CC_Base_L_Eye", "CC_Base_R_Eye"), ("Eye_l", "Eye_r")],
)
def test_eye_bones_are_found(pair: tuple[str, str]) -> None:
    assert find_rotation_bones(_named("Eyelid_L", "LeftEyeBrow", *pair)).eyes == {
        "left": pair[0],
        "right": pair[1],
    }


def test_missing_bones_rotate_nothing() -> None:
    assert find_rotation_bones(None).head == {} and find_rotation_bones(None).eyes == {}


@pytest.mark.parametrize("names", [("root", "neck", "head", "jaw"), ("neck1", "neck2", "head", "jaw")])
def test_bone_shares_add_up_to_the_full_rotation(names: tuple[str, ...]) -> None:
    """Neck and head together rotate the head as captured; positions may differ."""
    skeleton = _named(*names)
    turns = Rotation.from_euler("zxy", [[10, 20, 60], [0, -30, 5]], degrees=True)
    angles = head_bone_angles(find_rotation_bones(skeleton), turns.as_quat())
    for frame, turn in enumerate(turns):
        pose = Pose(bones={name: rows[frame] for name, rows in angles.items()})
        matrices = pose.to_arrays(Rig(random_rig().positions_mm, skeleton=skeleton)).matrices
        np.testing.assert_allclose(matrices[2, :, :3], turn.as_matrix(), atol=1e-5)


def test_matrix_rotations_ignore_scale() -> None:
    turns = Rotation.random(5, random_state=4)
    matrices = np.tile(np.eye(4), (5, 1, 1))
    matrices[:, :3, :3] = 1.7 * turns.as_matrix()
    matrices[:, :3, 3] = 40
    found = Rotation.from_quat(rotation_quaternions(list(matrices)))
    np.testing.assert_allclose((found.inv() * turns).magnitude(), 0, atol=1e-6)


def test_bone_names_ignore_case() -> None:
    targets = ("eyeBlinkLeft", "jawOpen", "JAWOPEN", "mouthSmile_L", "browInnerUp")
    names = (
        "EyeBlinkLeft",
        "jawopen",
        "JAWOPEN",
        "mouthSmileLeft",
        "Face.brow_inner_up",
        "tongueOut",
        "BrowInnerUp",
    )
    assert match_targets(names, targets) == {
        "EyeBlinkLeft": "eyeBlinkLeft",
        "jawopen": "jawOpen",
        "JAWOPEN": "JAWOPEN",
        "mouthSmileLeft": "mouthSmile_L",
        "Face.brow_inner_up": "browInnerUp",
    }
