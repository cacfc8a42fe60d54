"""Light presets, lights of each kind and environments in scene files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_head import write_head

from dermis.base.errors import DermisError
from dermis.scene import Environment, Scene, load_lights, load_scene
from dermis.scene.lights import RectangleLight, SphereLight, SpotLight, StripeLight, light_presets, studio

KINDS = """
[[lights]]
kind = "rectangle"
position = [0, 0, 900]
width_mm = 500
height_mm = 300

[[lights]]
kind = "sphere"
position = [400, 0, 900]
radius_mm = 40

[[lights]]
kind = "stripe"
direction = [-1, 0, 0]
position = [80, 0, 0]
up = [0, 1, 1]
width_mm = 2
length_mm = 60
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_head(tmp_path / "head.obj")
    return tmp_path


def _scene(folder: Path, text: str) -> Scene:
    path = folder / "scene.toml"
    path.write_text(text + '\n[head]\nname = "head.obj"\n')
    return load_scene(path)[0]


def test_all_light_types_are_read(folder: Path) -> None:
    scene = _scene(folder, KINDS)
    assert scene.lights == (
        RectangleLight(position=(0, 0, 900), width_mm=500, height_mm=300),
        SphereLight(position=(400, 0, 900), radius_mm=40),
        StripeLight(direction=(-1, 0, 0), position=(80, 0, 0), up=(0, 1, 1), width_mm=2, length_mm=60),
    )


@pytest.mark.parametrize("name", light_presets())
def test_every_rig_loads_and_has_a_description(name: str) -> None:
    lights = load_lights(name)
    assert (len(lights) == 0) == (name == "none")
    if lights:
        file = Path(load_lights.__code__.co_filename).parent / "presets" / f"{name}.toml"
        assert file.read_text().startswith("# ")
        keys = [sum(light.irradiance) for light in lights]
        assert max(keys) > 3 and all(light.shadows for light in lights)


def test_named_rig_is_loaded() -> None:
    assert light_presets() == [
        *("backlit", "beauty", "laser", "none", "overcast", "portrait"),
        *("raking", "rembrandt", "rim", "studio", "top", "window"),
    ]
    assert load_lights("studio") == studio()
    assert isinstance(load_lights("laser")[0], StripeLight)
    top, rim = load_lights("top")[0], load_lights("rim")[0]
    assert isinstance(top, RectangleLight) and top.position[1] > 2 * abs(top.position[2])
    assert isinstance(rim, RectangleLight) and rim.position[2] < 0
    assert max(max(light.irradiance) for light in load_lights("rim")) < np.pi  # white skin is not clipped
    ears = [light for light in load_lights("backlit") if light.position[2] < 0]
    assert sorted(np.sign(light.target[0]) for light in ears) == [-1, 1]
    for light in ears:  # hair over the ears is left dark, or it would clip
        assert isinstance(light, SpotLight)
        ear, up = np.array(light.target), np.array([0.0, 50.0, 0.0])
        ways = ear + up - light.position, ear - light.position
        cosine = ways[0] @ ways[1] / np.prod([np.linalg.norm(way) for way in ways])
        assert np.degrees(np.arccos(cosine)) > light.outer_degrees


def test_an_environment_replaces_the_lights_that_are_not_named(folder: Path) -> None:
    text = '[environment]\nname = "uniform"\nrotation_degrees = 30\nexposure = 0.5\n'
    scene = _scene(folder, text)
    assert scene.environment == Environment(name="uniform", rotation_degrees=30, exposure=0.5)
    assert scene.lights == ()
    assert _scene(folder, 'lights = "studio"\n' + text).lights == studio()
    assert Scene(scene.head, environment=scene.environment).lights == ()
    assert Scene(scene.head).lights == studio()


def test_environment_path_is_relative_to_the_scene(folder: Path) -> None:
    (folder / "sky.hdr").write_bytes(b"")
    scene = _scene(folder, '[environment]\nname = "sky.hdr"\n')
    assert scene.environment is not None and scene.environment.name == str(folder / "sky.hdr")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[environment]\nexposure = 2\n", "name: expected a value"),
        ('[environment]\nname = "uniform"\nturn = 2\n', "turn"),
        ('[environment]\nname = "uniform"\nexposure = -1\n', "-1"),
        ('[environment]\nname = "uniform"\nvisible = true\n', 'background = "environment"'),
        ('[[lights]]\nkind = "sphere"\nposition = [0, 0, 90]\nradius_mm = 100\n', "outside the sphere"),
        ('[[lights]]\nkind = "stripe"\ndirection = [0, -1, 0]\n', "not parallel to the direction"),
        ('[[lights]]\nkind = "stripe"\ndirection = [1, 0, 0]\nangle_degrees = 2\n', "angle_degrees of 0"),
        ('[[lights]]\nkind = "rectangle"\nposition = [0, 0, 900]\nwidth_mm = 0\n', "width_mm"),
    ],
)
def test_invalid_light_files_are_refused(folder: Path, text: str, said: str) -> None:
    with pytest.raises(DermisError, match=said):
        _scene(folder, text)
