"""Every field of a saved scene is read back unchanged."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from random_rig import random_rig

from dermis.base.errors import DermisError
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.pose import Pose
from dermis.mesh.primitives import uv_sphere
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.files import load_scene
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.lights import (
    DirectionalLight,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    StripeLight,
)
from dermis.scene.model import Scene
from dermis.scene.saving import save_scene, scene_text
from dermis.scene.settings import Settings
from dermis.scene.skin import Pigments, Skin, TissueLayer

HEAD = Head("ball", uv_sphere(100.0, 16, 8), Maps())
SHARED: dict[str, Any] = {"irradiance": (0.1, 2.0, 1e-7), "shadows": False, "softness_mm": np.float64(2.5)}
BULB: dict[str, Any] = SHARED | {"position": (100.0, 20.0, 700.0), "target": (1.0, 2.0, 3.0)}
SHEET: dict[str, Any] = SHARED | {"direction": (1.0, 0.0, -1.0)}
LIGHTS = (
    PointLight(**BULB),
    SpotLight(**BULB, inner_degrees=3.0, outer_degrees=8.0),
    RectangleLight(**BULB, width_mm=30.0, height_mm=90.0),
    SphereLight(**BULB, radius_mm=3.0),
    DirectionalLight(**SHEET, angle_degrees=0.53),
    StripeLight(**SHEET, position=(1.0, 2.0, 3.0), up=(1.0, 0.2, 0.0), width_mm=3.0, length_mm=20.0),
)
CAMERA = Camera(
    position=(1.0, 2.0, 900.0),
    target=(1e-7, 3.0, 0.0),
    up=(0.1, 1.0, 0.0),
    frame_mm=33.0,
    principal_point=(0.4, 1.2),
    pixel_aspect=1.1,
)
PIGMENTS = Pigments(
    structure="donner2008",
    melanin=0.1,
    eumelanin=0.2,
    blood=0.01,
    oxygen=0.5,
    epidermis_mm=0.1,
    epidermal_blood=0.02,
    baseline=0.8,
)
LAYERS = (
    TissueLayer(
        name='epi"dermis',
        thickness_mm=0.25,
        absorption_per_mm=(0.2, 1e-7, 0.5),
        scattering_per_mm=(4.8, 6.0, 6.5),
    ),
    TissueLayer(absorption_per_mm=(0.0, 0.1, 0.2), scattering_per_mm=(3.0, 4.0, 5.0)),
)
SKIN = Skin(
    profile="medium",
    profile_map="mask.png",
    other_profiles=("dark", "light"),
    albedo="profile",
    mix=0.1,
    roughness=0.2,
    rho_s=0.3,
    oiliness=0.1,
    specular="torrance-sparrow",
    fresnel="exact",
    specular_colour="wrong",
    energy="published",
    anisotropy=0.8,
    direction="lambertian",
    pigments=PIGMENTS,
    layers=LAYERS,
)
ROOM = Environment(name="uniform", rotation_degrees=33.0, exposure=0.5)
SETTINGS = Settings(
    size=(10, 20),
    atlas=128,
    samples=2,
    technique="gpu-gems-3",
    stretch="axes",
    seams="multi-uv",
    seam_colour=(0.1, 0.2, 0.3),
    transmission="none",
    shadow_size=128,
    occlusion="none",
    exposure=1e-6,
    bloom=0.2,
    tone="filmic",
    gamma="wrong",
    strands=False,
    interreflection=False,
    background=(0.1, 0.0, 0.0),
    background_blur=0.2,
    parts="diffuse",
    polarisation="cross",
)


@pytest.mark.parametrize(
    "plain", [CAMERA, SKIN, PIGMENTS, ROOM, SETTINGS, *LIGHTS], ids=lambda p: type(p).__name__
)
def test_test_values_differ_from_defaults(plain: FrozenModel) -> None:
    """Check the test data, as the round trip could not detect an unsaved default."""
    fixed = {"kind", "angle_degrees"} if isinstance(plain, StripeLight) else {"kind"}
    for name in type(plain).model_fields.keys() - fixed:
        assert getattr(plain, name) != type(plain).model_fields[name].default, name


@pytest.mark.parametrize(
    "scene",
    [
        Scene(HEAD, LIGHTS, CAMERA, SKIN, ROOM),
        Scene(HEAD, (), CAMERA, Skin(pigments=Pigments(), profile="dark")),
        Scene(HEAD, environment=ROOM),
        Scene(HEAD),
    ],
)
def test_scene_round_trip(scene: Scene, tmp_path: Path) -> None:
    save_scene(tmp_path / "scene.toml", scene, SETTINGS, {"name": "human"})
    made, settings = load_scene(tmp_path / "scene.toml", HEAD)
    assert (made.camera, made.skin, made.environment, settings) == (
        scene.camera,
        scene.skin,
        scene.environment,
        SETTINGS,
    )
    assert tuple(made.lights) == tuple(scene.lights)


def test_pose_round_trip(tmp_path: Path) -> None:
    rig = random_rig()
    rig = replace(rig, targets=replace(rig.targets, names=("mouth open", "é", *rig.targets.names[2:])))
    head = replace(HEAD, rig=rig)
    matrix = np.diag([1.0, 2.0, 1.0, 1.0])
    bones = {"head": np.float32([1, 2, 3]), "jaw": (0.5, 0, 0), "neck": matrix}
    given = Pose({"mouth open": 0.1, "é": np.float32(-2), "target2": 1}, bones)
    save_scene(tmp_path / "scene.toml", Scene(head, pose=given), SETTINGS, {"name": "human"})
    made, _ = load_scene(tmp_path / "scene.toml", head)
    assert isinstance(made.pose, Pose)
    assert made.pose.weights == {"mouth open": 0.1, "é": -2.0, "target2": 1.0}
    assert made.pose.bones == {"head": [1, 2, 3], "jaw": [0.5, 0, 0], "neck": matrix.tolist()}
    for mine, other in zip(made.pose_arrays, given.to_arrays(rig), strict=True):
        np.testing.assert_array_equal(mine, other)


def test_empty_pose_round_trip(tmp_path: Path) -> None:
    save_scene(tmp_path / "scene.toml", Scene(HEAD, pose=Pose()), SETTINGS, {"name": "human"})
    made, _ = load_scene(tmp_path / "scene.toml", HEAD)
    assert isinstance(made.pose, Pose) and not made.pose.weights and not made.pose.bones


def test_point_positions_are_not_saved_as_text(tmp_path: Path) -> None:
    scene = Scene(HEAD, pose=Pose(positions_mm=HEAD.positions_mm))
    with pytest.raises(DermisError, match=r"weights and bones, .* but it has positions_mm"):
        save_scene(tmp_path / "scene.toml", scene, SETTINGS, {"name": "human"})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ('weights = {target9 = 1.0}', r"scene\.toml: pose: weights: .*no 'target9'"),
        ('weights = {target1 = "much"}', r"scene\.toml: pose: weights\.target1: expected a number from"),
        ('weights = {target1 = nan}', r"scene\.toml: pose: weights\.target1: expected a number"),
        ('weights = 1', r"scene\.toml: pose: weights: expected"),
        ('bones = {head = [1, 2]}', r"scene\.toml: pose: bones\.head: expected three angles"),
        ('bones = {chin = [1, 2, 3]}', r"scene\.toml: pose: bones: .*no 'chin'"),
        (
            'positions_mm = [[0, 0, 0]]',
            r"scene\.toml: pose: positions_mm: expected one of expression, weights, bones",
        ),
    ],
)  # fmt: skip
def test_invalid_pose_names_file_and_key(tmp_path: Path, table: str, words: str) -> None:
    (tmp_path / "scene.toml").write_text(f'[head]\nname = "human"\n[pose]\n{table}\n')
    with pytest.raises(DermisError, match=words):
        load_scene(tmp_path / "scene.toml", replace(HEAD, rig=random_rig()))


@pytest.mark.parametrize("name", ['a"b\\c.obj', "tab\tline\n.obj", "delete\x7f.obj", "é\u2028ø.obj"])
def test_unusual_file_names_round_trip(name: str) -> None:
    text = scene_text(Scene(HEAD), Settings(), {"name": name})
    assert tomllib.loads(text)["head"]["name"] == name
