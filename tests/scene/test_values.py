"""Scene data are immutable and validated, with uniform error messages."""

from __future__ import annotations

import re

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.scene import Camera, Environment, Settings, Skin
from dermis.scene.field_errors import InvalidFieldsError
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight

FORM = re.compile(r"\w+: (\S+: )?expected .+, but .+\. Correct it\.")
BAD = [
    (Skin, {"mix": 1.5}, "got 1.5"),
    (Skin, {"mix": float("nan")}, "got nan"),
    (Skin, {"roughness": 0.0}, "0.05"),
    (Skin, {"rho_s": -0.1}, "got -0.1"),
    (Skin, {"albedo": "both"}, "'map' or 'profile'"),
    (Skin, {"colour": 1}, "one of profile, profile_map"),
    (Settings, {"size": (0, 64)}, "size.0: expected a whole number from 1 to 16384 (pixels"),
    (Settings, {"size": (64,)}, "size.1"),
    (Settings, {"size": (64, 64, 64)}, "2 items"),
    (Settings, {"size": (16384, 16384), "samples": 2}, "134 million"),
    (Settings, {"atlas": 63}, "got 63"),
    (Settings, {"shadow_size": 0}, "got 0"),
    (Settings, {"samples": 65}, "got 65"),
    (Settings, {"exposure": 0}, "got 0"),
    (Settings, {"exposure": float("inf")}, "got inf"),
    (
        Settings,
        {"exposure": "bright"},
        "auto, skin or a number from 1e-06 to 1000000 (20 stops either way), but got 'bright'",
    ),
    (Settings, {"background": (0, 0, -1)}, "background.2"),
    (Settings, {"background": "#12345"}, "none, gradient, environment or a colour: three linear numbers"),
    (Settings, {"background_blur": 2}, "got 2"),
    (Settings, {"technique": "wet"}, "got 'wet'"),
    (Camera, {}, "position: expected a value, but there is none"),
    (Camera, {"position": (0, 0, 0)}, "away from the target"),
    (Camera, {"position": (0, 900, 0)}, "parallel to up"),
    (Camera, {"position": (0, 0, 1e30)}, "1000000"),
    (Camera, {"position": (0, 0, 900), "up": (0, 0, 0)}, "a direction other than"),
    (Camera, {"position": (0, 0, 900), "frame_mm": float("nan")}, "got nan"),
    (PointLight, {"position": (1, 2, 3), "target": (1, 2, 3)}, "away from the target"),
    (PointLight, {"position": (0, 0, 900), "irradiance": (1, 1, float("inf"))}, "irradiance.2"),
    (PointLight, {"position": (0, 0, 900), "softness_mm": 1e300}, "softness_mm"),
    (SpotLight, {"position": (0, 0, 900), "inner_degrees": 35}, "inner_degrees less than outer_degrees"),
    (SpotLight, {"position": (0, 0, 900), "outer_degrees": 90}, "got 90"),
    (DirectionalLight, {"direction": (0, 0, 0)}, "a direction other than"),
]


@pytest.mark.parametrize(("kind", "values", "says"), BAD)
def test_impossible_values_are_refused(kind: type, values: dict, says: str) -> None:
    with pytest.raises(DermisError) as caught:
        kind(**values)
    message = str(caught.value)
    assert message.startswith(f"{kind.__name__}: ") and says in message
    assert FORM.fullmatch(message), message


def test_all_errors_are_reported_at_once() -> None:
    with pytest.raises(InvalidFieldsError) as caught:
        Skin(mix=2, roughness=-1)
    assert list(caught.value.messages) == ["mix", "roughness"]


def test_range_limits_are_allowed() -> None:
    Skin(mix=0, roughness=0.05, rho_s=0), Skin(mix=1, roughness=1, rho_s=1)
    Settings(size=(1, 1), atlas=64, samples=1), Settings(size=(16384, 1), samples=64)


def test_scene_data_are_frozen_and_copied_with_other_values() -> None:
    skin = Skin(roughness=0.4)
    with pytest.raises(DermisError, match=r"Skin: .*got one to mix\. Write replace\(mix=0\.1\)"):
        skin.mix = 0.1  # type: ignore[misc]
    assert skin.replace(mix=0.1) == Skin(roughness=0.4, mix=0.1)
    with pytest.raises(DermisError, match="got 7"):
        skin.replace(mix=7)


def test_single_required_value_may_be_positional() -> None:
    assert Environment("lebombo") == Environment(name="lebombo")
    assert Camera((0, 0, 900), frame_mm=200) == Camera(position=(0, 0, 900), frame_mm=200)
    assert PointLight(np.array([0, 0, 900])) == PointLight(position=(0, 0, 900))
    with pytest.raises(DermisError, match=r"Skin: expected values by name, such as .*got 'olive'"):
        Skin("olive")
    with pytest.raises(DermisError, match="by name"):
        Camera((0, 0, 900), (0, 0, 0))


def test_unambiguous_values_are_converted() -> None:
    assert Settings(size=64) == Settings(size=(64, 64)) == Settings(size=np.array([64, 64]))
    assert PointLight(position=[0, 0, 9], irradiance=2) == PointLight(
        position=(0, 0, 9), irradiance=(2, 2, 2)
    )
    wide = Camera(position=np.array([0, 0, 900], np.float32), frame_mm=np.float32(200))
    assert wide == Camera(position=(0, 0, 900), frame_mm=200)


@pytest.mark.parametrize(
    ("kind", "values", "says"),
    [
        (Skin, {"roughnes": 0.3}, "roughnes: expected roughness, but"),
        (PointLight, {"position": (0, 0, 9), "intensity": 3}, "intensity: expected irradiance, but"),
        (Camera, {"position": (0, 0, 9), "fov": 30}, "fov: expected frame_mm (height"),
        (Settings, {"rho_s": 0.2}, "unknown here (it is one of Skin)"),
        (Settings, {"size": "64x64"}, "expected a list of 2 numbers, but got '64x64'"),
        (PointLight, {"position": (0, 0, 9), "irradiance": "white"}, "expected a list of 3 numbers, but"),
    ],
)
def test_wrong_names_and_types_suggest_the_right_ones(kind: type, values: dict, says: str) -> None:
    with pytest.raises(DermisError) as caught:
        kind(**values)
    assert says in str(caught.value)


def test_equality_compares_values() -> None:
    assert Skin(mix=0.3) == Skin(mix=0.3) and hash(Skin(mix=0.3)) == hash(Skin(mix=0.3))
    assert Skin(mix=0.3) != Skin(mix=0.4)
    assert PointLight(position=(0, 0, 9)) != SpotLight(position=(0, 0, 9))
    assert Skin() != "skin"


def test_names_may_replace_numbers() -> None:
    """Check that words are kept, also in files, and that encoded colours become linear."""
    settings = Settings(exposure="auto", background="gradient")
    assert Settings(**settings.model_dump()) == settings
    assert (settings.exposure, settings.background) == ("auto", "gradient")
    half = Settings(background="#bcbcbc").background
    assert half == Settings(background=half).background and half == pytest.approx((0.503,) * 3, abs=1e-3)
    assert Settings(background="0,0.5,1").background == (0.0, 0.5, 1.0)
