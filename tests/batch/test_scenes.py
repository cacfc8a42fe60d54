"""Scenes of data sets: dependence on parameters, framing of the face, and lighting."""

from __future__ import annotations

import gc
import tomllib
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.apps.batch.cameras import face_hull_indices
from dermis.apps.batch.lighting import blackbody_colour, sampled_lights
from dermis.apps.batch.scenes import SceneBuilder, sampled_person
from dermis.apps.batch.spec import Spec, example_toml, parse_spec
from dermis.apps.batch.spec_tables import StateTable
from dermis.base.errors import DermisError
from dermis.human.living.zones import STATE_NAMES
from dermis.human.person import Human
from dermis.human.person_file import write_person_json
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import angles_matrix
from dermis.scene.lights import light_presets, preset_lights
from dermis.scene.model import Scene

WILD = """
images_per_person = 40
size = [96, 64]
[expression]
name = "mixture"
[head]
yaw_deg = {uniform = [-60, 60]}
pitch_deg = {uniform = [-40, 40]}
roll_deg = {uniform = [-35, 35]}
[gaze]
at = {choice = ["camera", "angles"]}
yaw_deg = {uniform = [-20, 20]}
[camera]
distance_mm = {uniform = [300, 1500]}
yaw_deg = {uniform = [-180, 180]}
pitch_deg = {uniform = [-85, 85]}
roll_deg = {uniform = [-180, 180]}
frame_mm = {uniform = [50, 800]}
offset_x = {uniform = [-1, 1]}
offset_y = {uniform = [-1, 1]}
"""


def spec(text: str, **more: Any) -> Spec:
    return parse_spec(tomllib.loads(text) | {"count": 100} | more)


@pytest.fixture(scope="module")
def wild() -> tuple[Spec, list[tuple[dict[str, Any], Scene]]]:
    made = spec(WILD)
    builder = SceneBuilder(made)
    return made, [(one, builder.build(one)[0]) for one in map(made.parameters, range(40))]


def project(scene: Scene, positions: Any, size: tuple[int, int]) -> Any:
    """Return the pixels (n, 2) of positions of the head [mm]."""
    K, R, t = scene.camera.to_opencv(size)
    x, y, z = K @ (R @ (positions - np.array(scene.head.centre_mm)).T + t[:, None])
    assert z.min() > 0
    return np.stack([x / z, y / z], axis=1)


def test_the_whole_face_is_in_the_picture_for_all_samples(wild: Any) -> None:
    drawn, scenes = wild
    for _, scene in scenes:
        rig = scene.head.control_rig
        around = rig.positions_mm - np.array(scene.head.centre_mm)
        face = np.flatnonzero((np.abs(around[:, 0]) < 80) & (abs(around[:, 1]) < 90) & (around[:, 2] > 10))
        pixels = project(scene, rig.pose_points(face.astype(np.int32), scene.pose_arrays), drawn.size)
        assert pixels.min() > -0.5 and (pixels < np.array(drawn.size) - 0.5).all()


def test_cameras_have_the_sampled_parameters_if_the_face_fits() -> None:
    drawn = spec("[camera]\nyaw_deg = 90\npitch_deg = 30\ndistance_mm = 1000\nframe_mm = 500\noffset_x = 0.2")
    scene, settings = SceneBuilder(drawn).build(drawn.parameters(0))
    camera, head = scene.camera, scene.head
    face = head.control_rig.pose_points(face_hull_indices(head), scene.pose_arrays) - np.array(head.centre_mm)
    middle = 0.5 * (face.min(axis=0) + face.max(axis=0))
    away = np.array(camera.position) - middle
    assert np.linalg.norm(away) == pytest.approx(1000)
    assert away / 1000 == pytest.approx([np.cos(np.pi / 6), 0.5, 0.0], abs=1e-6)
    assert 2 * camera.half_view_tangent * 1000 == pytest.approx(500)
    (x, _), width = project(scene, middle[None] + head.centre_mm, settings.size)[0], settings.size[0]
    assert (x + 0.5) / width == pytest.approx(0.5 + 0.5 * 0.2, abs=2e-3)
    lens = spec("[camera]\nfocal_mm = 48\ndistance_mm = 1200")
    assert SceneBuilder(lens).build(lens.parameters(0))[0].camera.frame_mm == pytest.approx(600)


def test_roll_turns_the_camera_clockwise() -> None:
    upright, rolled = (
        SceneBuilder(one).build(one.parameters(0))[0] for one in (spec(""), spec("[camera]\nroll_deg = 20"))
    )
    assert np.dot(rolled.camera.up, upright.camera.up) == pytest.approx(np.cos(np.radians(20)), abs=1e-6)
    assert rolled.camera.up[0] > 0.3  # the head's left, which is right in the picture


def test_neck_and_head_rotate_by_the_sampled_angles(wild: Any) -> None:
    for parameters, scene in wild[1][:8]:
        head, names = scene.head, scene.head.control_rig.skeleton.names
        nod, turn, tilt = (parameters[f"head.{name}_deg"] for name in ("pitch", "yaw", "roll"))
        made = scene.pose_arrays.matrices[names.index("head")][:3, :3]
        assert made == pytest.approx(np.array(angles_matrix((nod, turn, tilt))), abs=1e-5)
        assert set(scene.pose.bones) == {"head", "neck01", "neck02", "neck03"} and head.rig is not None


def test_eyes_look_at_the_camera_or_in_the_sampled_direction() -> None:
    text = "[head]\nyaw_deg = 20\n[camera]\nyaw_deg = 10\n"
    at_camera, at_angles = spec(text), spec(text + "[gaze]\nat = 'angles'\nyaw_deg = -15\npitch_deg = 10")
    for drawn in (at_camera, at_angles):
        scene, _ = SceneBuilder(drawn).build(drawn.parameters(0))
        assert scene.head.eyes is not None and scene.pose_arrays is not None
        frames = scene.head.eyes.eye_matrices(scene.head.control_rig, scene.pose_arrays)
        for frame in frames:
            if drawn is at_camera:
                place = np.array(scene.camera.position) + scene.head.centre_mm
                way = (frame @ np.append(place, 1.0))[:3]
            else:
                turned = np.radians([20 - 15, -10])
                x, z = np.cos(turned[1]) * np.array([np.sin(turned[0]), np.cos(turned[0])])
                way = frame[:3, :3] @ [x, np.sin(turned[1]), z]
            assert np.degrees(np.arccos(way[2] / np.linalg.norm(way))) < 1.5


def test_scenes_depend_only_on_their_parameters(wild: Any) -> None:
    drawn, scenes = wild
    builder = SceneBuilder(drawn)
    for k in (30, 2):
        again, before = builder.build(drawn.parameters(k))[0], scenes[k][1]
        assert again.camera == before.camera and again.lights == before.lights and again.skin == before.skin
        assert (
            again.pose_arrays is not None
            and again.pose_arrays.weights.tobytes() == before.pose_arrays.weights.tobytes()
        )
        assert again.head.positions_mm.tobytes() == before.head.positions_mm.tobytes()
    heads = [scene.head for _, scene in scenes]
    assert all(head is heads[0] for head in heads)  # forty images of one person


def test_people_follow_their_seed_except_for_sampled_fields() -> None:
    drawn = spec(
        "[person]\nage = 70\ncaucasian = 1\n[person.skin]\nmelanin = 0.01\n[person.hair]\nstyle = 'none'"
    )
    parameters = drawn.parameters(3)
    person, plain = sampled_person(parameters), Human.sampled(int(parameters["person.seed"]))
    assert (person.age, person.caucasian, person.african) == (70, 1, 0)
    assert person.look.melanin == 0.01 and person.hair_look.style == "none"
    assert person.look.age > 0.5 and person.sex == plain.sex
    assert person.look.seed == plain.look.seed and dict(person.targets) == dict(plain.targets)


@pytest.mark.parametrize("given", [{"age": 200}, {"african": 0}, {"skin": {"melanin": 3}}, {"sex": "male"}])
def test_impossible_people_are_refused(given: dict[str, Any]) -> None:
    with pytest.raises(DermisError):
        Human.sampled(3, **given)


def test_heads_are_loaded_from_files_of_people_and_scenes(tmp_path: Path) -> None:
    (tmp_path / "people").mkdir()
    write_person_json(tmp_path / "people" / "one.json", Human(age=60))
    (tmp_path / "people" / "two.toml").write_text('[head]\nname = "human:4"\n[skin]\noiliness = 0.9\n')
    told = tomllib.loads(
        "count = 9\nsize = 64\n[person]\nhead = {files = 'people/*'}\n[skin]\nroughness = 0.4"
    )
    made = parse_spec(told, tmp_path)
    named = {made.parameters(k)["person.head"]: made.parameters(k) for k in range(9)}
    assert sorted(named) == ["people/one.json", "people/two.toml"] == sorted(made.files)
    builder = SceneBuilder(made)
    one, two = (builder.build(named[name])[0] for name in sorted(named))
    assert one.head.name.endswith("one.json") and one.skin.pigments is not None
    assert two.head.name == "human:4" and (two.skin.oiliness, two.skin.roughness) == (0.9, 0.4)


def test_the_pose_combines_expression_and_weights() -> None:
    own = "[expressions.wink]\neyeBlinkLeft = 1\nmouthSmile = 0.5\n[pose]\njawOpen = 0.2"
    drawn = spec(f"[expression]\nname = 'wink'\n{own}")
    parameters = drawn.parameters(0)
    weights = {name[5:]: value for name, value in parameters.items() if name.startswith("pose.")}
    assert weights == {"eyeBlinkLeft": 1, "mouthSmileLeft": 0.5, "mouthSmileRight": 0.5, "jawOpen": 0.2}
    scene, _ = SceneBuilder(drawn).build(parameters)
    assert isinstance(scene.pose, Pose) and weights.items() <= scene.pose.weights.items()
    unknown = spec("[pose]\nnoseGrow = 0.5")
    with pytest.raises(DermisError, match="noseGrow"):
        SceneBuilder(unknown).build(unknown.parameters(0))


def test_lights_are_those_of_the_sampled_rig() -> None:
    told = "yaw_deg = 90\npitch_deg = 0\ndistance_mm = 1000\nstrength = 2\nkelvin = 3000"
    key, fill, rim = sampled_lights(spec(f"[light]\nkind = 'rig'\n[light.key]\n{told}").parameters(0))
    assert key.position == pytest.approx((1000, 0, 0), abs=1e-6)
    assert np.dot(key.irradiance, (0.2126, 0.7152, 0.0722)) == pytest.approx(2 * np.pi)
    assert key.irradiance[0] > key.irradiance[2] and fill.position[2] > 0 > rim.position[2]
    assert (
        blackbody_colour(6500) == pytest.approx((1, 1, 1))
        and blackbody_colour(12000)[2] > 1 > blackbody_colour(12000)[0]
    )
    for kind in light_presets():
        around = "[environment]\nname = 'uniform'\n" * (kind == "none")
        turned = sampled_lights(
            spec(f"{around}[light]\nkind = '{kind}'\nturn_deg = 90\nstrength = 0.5").parameters(0)
        )
        for light, plain in zip(turned, preset_lights(kind), strict=True):
            assert light.irradiance == pytest.approx(np.multiply(plain.irradiance, 0.5))
            if hasattr(plain, "position"):
                x, y, z = plain.position
                assert light.position == pytest.approx((z, y, -x), abs=1e-6)  # the front to the head's left


def test_the_background_environment_is_that_of_the_image() -> None:
    around = "[environment]\nname = {choice = ['none', 'uniform']}\nstrength = 0.5\n"
    drawn = spec(f"images_per_person = 9\n{around}[background]\nkind = 'environment'\nblur = 0.3")
    builder = SceneBuilder(drawn)
    for k in range(8):
        parameters = drawn.parameters(k)
        assert (parameters["background.kind"] == "environment") == (
            parameters["environment.name"] == "uniform"
        )
        scene, settings = builder.build(parameters)
        assert (settings.background == "environment") == (scene.environment is not None)
        assert settings.background_blur == (0.3 if scene.environment else 0.0)
    plain = spec("[background]\nkind = 'colour'\nred = 0.1\ngreen = 0.2\nblue = 0.3")
    assert SceneBuilder(plain).build(plain.parameters(0))[1].background == (0.1, 0.2, 0.3)


def test_every_image_of_the_example_is_a_scene() -> None:
    drawn = parse_spec(tomllib.loads(example_toml()))
    builder = SceneBuilder(drawn)
    for k in range(3):
        scene, settings = builder.build(drawn.parameters(k))
        assert scene.lights and settings.size == (512, 512) and settings.exposure == "auto"


def test_a_sampled_person_is_released_after_its_images() -> None:
    """People are never reused; caching sixteen of them took half a gigabyte."""
    spec = parse_spec({"count": 2, "size": [32, 32], "person": {"hair": {"style": "none"}}})
    builder = SceneBuilder(spec)
    first = weakref.ref(builder.build(spec.parameters(0))[0].head)
    assert first() is not None
    builder.build(spec.parameters(1))
    gc.collect()
    assert first() is None


def test_states_of_the_skin_are_sampled_recorded_and_rendered() -> None:
    """Clips keep their state, beside the pulse, and other parameters are as without the table."""
    state = {"state": {"blush": {"uniform": [0.2, 1]}, "cold": 0}}
    clip = {"clip": {"frames": 2, "pulse_per_min": 60}}
    plain, stated, moving = spec(""), spec("", **state), spec("", **state, **clip)
    builder, weights = SceneBuilder(stated), []
    for number in range(3):
        parameters = stated.parameters(number)
        assert parameters == plain.parameters(number) | {
            name: parameters[name] for name in ("state.blush", "state.cold")
        }
        weights.append(parameters["state.blush"])
        assert [moving.parameters(2 * number + k)["state.blush"] for k in (0, 1)] == [weights[-1]] * 2
    scene, _ = builder.build(stated.parameters(1))
    assert scene.state is not None and scene.state.weights == {"blush": weights[1]}
    beating, _ = SceneBuilder(moving).build(moving.parameters(3))
    assert beating.state is not None and beating.state.weights == {"blush": weights[1]}
    assert beating.state.blood is not None and len({*weights}) == 3
    assert builder.build(plain.parameters(0))[0].state is None and "[state]" not in plain.to_toml()
    assert tuple(StateTable.model_fields) == STATE_NAMES
    assert {"state.blush", "state.cold"} <= {*stated.parameter_names}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"blush": 2}, "^state: blush: expected numbers from 0 to 1"),
        ({"heat": 1}, "^state: heat: expected one of blush, pallor"),
        (0.5, "^state: expected a table with blush"),
    ],
)
def test_invalid_states_are_refused(table: object, message: str) -> None:
    with pytest.raises(DermisError, match=message):
        spec("", state=table)
