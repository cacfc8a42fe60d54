"""Eyeballs fitted to heads from files: position, rig, and files that are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from eyed_head import EYE_MM, MIRROR, ball, ball_with_cornea, write_head
from numpy.typing import NDArray

from dermis.base.errors import DermisError, DermisWarning
from dermis.formats.load import is_eye_name
from dermis.mesh.fitted_eyes.balls import Sphere, corneal_axis, fit_sphere
from dermis.mesh.fitted_eyes.lids import lids_in_front
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import angles_matrix
from dermis.scene.gaze import looking_at
from dermis.scene.heads import load_head

Floats = NDArray[np.float64]
AHEAD = np.array([0.0, 0.0, 1.0])


def head(path: Path, **options: object) -> Head:
    return load_head(path, unit_mm=1.0, **options)


def eyes_of(made: Head, pose: Pose | None = None) -> tuple[Floats, Floats, Floats]:
    """Return the centres of the balls [mm], their directions of gaze, and radii [mm]."""
    assert made.eyes is not None
    frames = made.eyes.eye_matrices(made.control_rig, (pose or Pose()).to_arrays(made.control_rig))
    scale = np.linalg.norm(frames[:, 2, :3], axis=1)
    middle = np.column_stack([np.zeros((2, 2)), made.eyes.centre_offset_mm])
    inverse = np.linalg.inv(frames)
    places = np.einsum("kij,kj->ki", inverse, np.column_stack([middle, np.ones(2)]))[:, :3]
    ways = np.einsum("kji,kj->ki", frames[:, :3, :3], made.eyes.gaze)
    return places, ways / np.linalg.norm(ways, axis=1, keepdims=True), made.eyes.radius_mm / scale


def triangles_of(made: Head, name: str) -> NDArray[np.int32]:
    names = [material.name for material in made.mesh.materials]
    return made.mesh.triangles[made.mesh.material == names.index(name)]


def degrees_between(a: Floats, b: Floats) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1))))


EYES = "eye eyes Eye_L eye.R EyeLeft lefteye eyeball Sclera iris Std_Cornea_L Wolf3D_Eye high-poly:eyes"
NEAR = "skin eyelash Eyelashes eye_brow eyelids CC_Base_EyeOcclusion TearLine eyewear parisian"


@pytest.mark.parametrize("name", EYES.split())
def test_names_of_eyes_are_recognised(name: str) -> None:
    assert is_eye_name((name,))
    assert is_eye_name(("white", name)) and not is_eye_name(("skin", name))


@pytest.mark.parametrize("name", NEAR.split())
def test_names_of_parts_near_eyes_are_excluded(name: str) -> None:
    assert not is_eye_name((name,))


@pytest.mark.parametrize("radius", [9.0, 12.0, 16.0])
def test_fitted_eyeball_replaces_that_of_the_file(tmp_path: Path, radius: float) -> None:
    path = write_head(tmp_path / "a.gltf", ball(radius), ball(radius))
    made, plain = head(path), head(path, eyes="plain")
    middles, ways, radii = eyes_of(made)
    np.testing.assert_allclose(middles, [EYE_MM, EYE_MM * MIRROR], atol=0.05)
    np.testing.assert_allclose(radii, radius, rtol=5e-3)
    for middle, way in zip(middles, ways, strict=True):  # both at what lies a metre ahead
        target = np.array([0.0, middle[1], middle[2] + 1000.0])
        assert degrees_between(way, target - middle) < 0.1
    assert {material.name for material in made.mesh.materials} == {"skin", "left eye", "right eye"}
    assert len(triangles_of(made, "skin")) == len(triangles_of(plain, "skin")) > 0
    assert len(np.unique(made.mesh.triangles)) == len(made.mesh.positions) and made.note == ""
    left = made.mesh.positions[np.unique(triangles_of(made, "left eye"))]
    assert np.linalg.norm(left - EYE_MM, axis=1).min() == pytest.approx(radius, abs=0.05)


def test_plain_eyes_are_unchanged(tmp_path: Path) -> None:
    path = write_head(tmp_path / "a.gltf")
    made = head(path, eyes="plain")
    assert made.eyes is None and made.rig is None and made.note == ""
    assert {material.name for material in made.mesh.materials} == {"skin", "eye_L", "eye_R"}


def test_cornea_determines_the_gaze_direction(tmp_path: Path) -> None:
    axis = np.array(angles_matrix((6.0, 14.0, 0.0))) @ AHEAD
    eyes = [ball_with_cornea(12.5, one) for one in (axis, axis * MIRROR)]
    _, ways, radii = eyes_of(head(write_head(tmp_path / "a.gltf", *eyes)))
    assert degrees_between(ways[0], axis) < 0.5 and degrees_between(ways[1], axis * MIRROR) < 0.5
    np.testing.assert_allclose(radii, 12.5, rtol=0.01)


def test_a_cornea_does_not_widen_the_ball() -> None:
    points, _ = ball_with_cornea(12.0, AHEAD)
    area = np.ones(len(points))
    found = fit_sphere(points + 100.0, area)
    assert found.radius == pytest.approx(12.0, rel=5e-3)
    np.testing.assert_allclose(found.centre, 100.0, atol=0.1)
    assert corneal_axis(points, area, found._replace(centre=np.zeros(3)), AHEAD) is not None
    plain = ball(12.0)[0]
    assert corneal_axis(plain, np.ones(len(plain)), Sphere(np.zeros(3), 12.0, 0.0), AHEAD) is None


@pytest.mark.parametrize(
    ("left", "right", "words"),
    [
        (ball(25.0), ball(25.0), "ball of 25.0 mm radius, not of 8 to 20 mm"),
        (ball(6.0), ball(6.0), "ball of 6.0 mm"),
        (ball(12.0, 1.5), ball(12.0, 1.5), "deviates from a ball"),
        (ball(12.0), ball(5.0), "1 ball instead of two"),
    ],
)
def test_other_parts_stay_plain(tmp_path: Path, left: object, right: object, words: str) -> None:
    made = head(write_head(tmp_path / "a.gltf", left, right))
    assert made.eyes is None and words in made.note and "'eye_L', 'eye_R' stay plain" in made.note
    assert {material.name for material in made.mesh.materials} == {"skin", "eye_L", "eye_R"}
    with pytest.raises(DermisError, match="stay plain"):
        looking_at(made, (0, 0, 500))
    with pytest.raises(DermisError, match="stay plain"):
        head(tmp_path / "a.gltf", eye={"redness": 1.0})


def test_eye_groups_can_be_named(tmp_path: Path) -> None:
    path = write_head(tmp_path / "a.gltf", names=("white_1", "white_2"))
    with pytest.warns(DermisWarning, match="not skin: 'white_"):
        plain = head(path)
    assert plain.eyes is None and plain.note == ""
    assert head(path, eye_groups=("white_1", "White_2")).eyes is not None
    with pytest.raises(DermisError, match="eye_groups with names of groups of the file"):
        head(path, eye_groups=("white",))


def test_balls_are_found_within_one_surface(tmp_path: Path) -> None:
    path = write_head(tmp_path / "a.gltf", names=("skin", "skin"))
    made, plain = head(path, eye_groups=("skin",)), head(path)
    assert plain.eyes is None and made.eyes is not None
    lost = len(triangles_of(plain, "skin")) - len(triangles_of(made, "skin"))
    assert lost == 2 * len(ball()[1])


def test_subdivision_keeps_eyes_round(tmp_path: Path) -> None:
    made = head(write_head(tmp_path / "a.gltf"), subdivide=1)
    middles, _, radii = eyes_of(made)
    np.testing.assert_allclose(middles, [EYE_MM, EYE_MM * MIRROR], atol=0.05)
    np.testing.assert_allclose(radii, 12.0, rtol=5e-3)
    posed = made.control_rig.posed_points_mm(made.control_rig.rest)[made.mesh.point]
    np.testing.assert_allclose(posed, made.mesh.positions, atol=1e-3)


def test_head_without_bones_can_gaze_at_a_point(tmp_path: Path) -> None:
    made = head(write_head(tmp_path / "a.gltf"))
    place = np.array([120.0, 60.0, 500.0])
    pose = looking_at(made, place)
    middles, ways, _ = eyes_of(made, pose)
    np.testing.assert_allclose(middles, [EYE_MM, EYE_MM * MIRROR], atol=0.05)
    for middle, way in zip(middles, ways, strict=True):
        assert degrees_between(way, place + made.centre_mm - middle) < 0.1
    again = looking_at(made, place, pose)
    for name, angles in pose.bones.items():
        np.testing.assert_allclose(again.bones[name], angles, atol=1e-9)


def test_bones_of_the_file_rotate_fitted_eyes(tmp_path: Path) -> None:
    made = head(write_head(tmp_path / "a.glb", joints=("head", "eyeball_l", "eyeball_r")))
    assert made.bones == ("head", "eyeball_l", "eyeball_r")
    before, after = eyes_of(made)[1], eyes_of(made, Pose(bones={"eyeball_l": (0, 20, 0)}))[1]
    assert degrees_between(before[0], after[0]) == pytest.approx(20, abs=0.1)
    assert degrees_between(before[1], after[1]) < 1e-3
    place = np.array([150.0, 30.0, 400.0])
    nodding = looking_at(made, place, Pose(bones={"head": (10, 25, 5)}))
    middles, ways, _ = eyes_of(made, nodding)
    assert set(nodding.bones) == {"head", "eyeball_l", "eyeball_r"}
    for middle, way in zip(middles, ways, strict=True):
        assert degrees_between(way, place + made.centre_mm - middle) < 0.1


def test_targets_turn_and_shift_them_rigidly(tmp_path: Path) -> None:
    points, triangles = ball()
    turned = points @ np.array(angles_matrix((0.0, 15.0, 0.0))).T - points
    targets = {"eyeLookOutLeft": turned, "wide": np.tile([3.0, 0.0, 1.0], (len(points), 1))}
    made = head(write_head(tmp_path / "a.gltf", (points, triangles), targets=targets))
    rest, out = eyes_of(made), eyes_of(made, Pose({"eyeLookOutLeft": 1.0}))
    np.testing.assert_allclose(out[0], rest[0], atol=0.05)
    assert degrees_between(rest[1][0], out[1][0]) == pytest.approx(15, abs=0.1)
    assert degrees_between(rest[1][1], out[1][1]) < 1e-3
    wide = eyes_of(made, Pose({"wide": 0.5}))
    np.testing.assert_allclose(wide[0] - rest[0], [[1.5, 0, 0.5], [0, 0, 0]], atol=0.05)
    assert 0.2 < looking_at(made, (200, 12, 800)).weights["eyeLookOutLeft"] < 1.2


def test_moved_points_of_the_file_move_fitted_eyes(tmp_path: Path) -> None:
    path = write_head(tmp_path / "a.gltf")
    made, plain = head(path), head(path, eyes="plain")
    np.testing.assert_array_equal(made.positions_mm, plain.positions_mm)
    turn = np.array(angles_matrix((0.0, 30.0, 0.0)))
    pose = Pose(positions_mm=plain.positions_mm @ turn.T + [4.0, 0.0, 0.0])
    rest, moved = eyes_of(made), eyes_of(made, pose)
    np.testing.assert_allclose(moved[0], rest[0] @ turn.T + [4.0, 0.0, 0.0], atol=0.05)
    np.testing.assert_allclose(moved[1], rest[1] @ turn.T, atol=1e-4)


def lid(low_mm: float, high_mm: float, depth_mm: float) -> Floats:
    """Return a wall (2, 3, 3) across the front of a ball."""
    a, b, c, d = ([x, y, depth_mm] for x, y in ((-40, low_mm), (40, low_mm), (40, high_mm), (-40, high_mm)))
    return np.array([[a, b, c], [c, d, a]], float)


def test_an_iris_lies_between_the_lids() -> None:
    sphere = Sphere(np.zeros(3), 12.0, 0.0)
    canthi = [np.array([[x, -40, 13.0], [s * 40, -40, 13.0], [x, 40, 13.0]]) for s, x in ((1, 8), (-1, -8))]
    walls = np.concatenate([lid(2.0, 40.0, 13.0), lid(-40.0, -6.0, 13.0)])
    low = lids_in_front(np.concatenate([walls, np.array(canthi)]), sphere, AHEAD)
    across, up = low.opening_angles
    assert abs(np.degrees(across)) < 1 and np.degrees(up) == pytest.approx(-7, abs=1.5)
    assert lids_in_front(walls[:2], sphere, AHEAD).opening_angles == (0.0, 0.0)


def test_corneas_stay_behind_lids() -> None:
    sphere, near = Sphere(np.zeros(3), 16.0, 0.0), lid(3.0, 40.0, 16.1)
    assert lids_in_front(lid(3.0, 40.0, 18.5), sphere, AHEAD).cornea_recess_mm(AHEAD, 1.0) == 0.0
    assert 0.2 < lids_in_front(near, sphere, AHEAD).cornea_recess_mm(AHEAD, 1.0) < 1.2


def test_eye_appearance_can_be_given(tmp_path: Path) -> None:
    path = write_head(tmp_path / "a.gltf")
    made, plain = head(path, eye={"eumelanin": 0.1, "seed": 3}), head(path)
    assert made.eyes is not None and plain.eyes is not None
    assert made.eyes.look == replace(plain.eyes.look, eumelanin=0.1, seed=3)
    with pytest.raises(DermisError, match="colour: expected one of eumelanin"):
        head(path, eye={"colour": 1.0})
