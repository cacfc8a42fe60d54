"""Scene files: written values, files relative to the scene, and defaults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_head import HEIGHT_MM, write_head

from dermis.base.errors import DermisError
from dermis.human.regions.region_table import REGIONS
from dermis.images.io import write_png
from dermis.scene import (
    Camera,
    Scene,
    Settings,
    Skin,
    load_camera,
    load_lights,
    load_scene,
    portrait,
    three_quarter,
)
from dermis.scene.heads import load_head
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight, studio

WHOLE = """
[head]
name = "head.obj"
colour = "maps/skin.png"
height = "maps/grey.png"
height_mm = 0.02
unit_mm = 2.0
v_origin = "top"
up = "y"
subdivide = 1

[skin]
profile = "own.csv"
albedo = "map"
mix = 0.25
roughness = 0.4
rho_s = 0.1

[[lights]]
position = [0, 100, 900]
irradiance = [1, 2, 3]

[[lights]]
kind = "spot"
position = [500, 0, 500]
target = [0, 10, 0]
inner_degrees = 10
outer_degrees = 20
shadows = false

[[lights]]
kind = "directional"
direction = [0, -1, 0]
softness_mm = 4

[camera]
position = [100, 0, 800]
target = [0, 20, 0]
frame_mm = 300

[render]
size = [48, 32]
atlas = 128
samples = 2
technique = "none"
shadow_size = 256
exposure = 1.5
background = [0.1, 0.2, 0.3]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a head, maps, a profile and lights, which is not the current one."""
    write_head(tmp_path / "head.obj")
    (tmp_path / "maps").mkdir()
    write_png(tmp_path / "maps" / "skin.png", np.full((16, 16, 3), 128, np.uint8))
    write_png(tmp_path / "maps" / "grey.png", np.full((16, 16), 100, np.uint8))
    (tmp_path / "own.csv").write_text("variance_mm2,red,green,blue\n1,1,1,1\n")
    (tmp_path / "lights.toml").write_text("[[lights]]\nposition = [0, 0, 900]\n")
    (tmp_path / "camera.toml").write_text("[camera]\nposition = [0, 0, 900]\n")
    return tmp_path


def _load(folder: Path, text: str) -> tuple[Scene, Settings]:
    path = folder / "scene.toml"
    path.write_text(text)
    return load_scene(path)


def test_all_keys_are_read(folder: Path) -> None:
    scene, settings = _load(folder, WHOLE)
    expected = load_head(
        folder / "head.obj",
        colour=folder / "maps" / "skin.png",
        height=folder / "maps" / "grey.png",
        height_mm=0.02,
        unit_mm=2.0,
        v_origin="top",
        subdivide=1,
    )
    assert scene.head.mesh.size_mm[1] == pytest.approx(2 * HEIGHT_MM, rel=0.05)
    for name in ("positions", "uv", "triangles"):
        np.testing.assert_array_equal(getattr(scene.head.mesh, name), getattr(expected.mesh, name))
    np.testing.assert_array_equal(scene.head.maps.colour, expected.maps.colour)
    np.testing.assert_array_equal(scene.head.maps.height, expected.maps.height)
    own = str(folder / "own.csv")
    assert scene.skin == Skin(profile=own, albedo="map", mix=0.25, roughness=0.4, rho_s=0.1)
    assert scene.lights == (
        PointLight(position=(0, 100, 900), irradiance=(1, 2, 3)),
        SpotLight(
            position=(500, 0, 500), target=(0, 10, 0), inner_degrees=10, outer_degrees=20, shadows=False
        ),
        DirectionalLight(direction=(0, -1, 0), softness_mm=4),
    )
    assert scene.camera == Camera(position=(100, 0, 800), target=(0, 20, 0), frame_mm=300)
    assert settings == Settings(
        size=(48, 32),
        atlas=128,
        samples=2,
        technique="none",
        shadow_size=256,
        exposure=1.5,
        background=(0.1, 0.2, 0.3),
    )


def test_missing_keys_have_defaults(folder: Path) -> None:
    scene, settings = _load(folder, '[head]\nname = "head.obj"\n')
    assert (scene.skin, settings) == (Skin(), Settings())
    assert (scene.lights, scene.camera) == (studio(), portrait(scene.head))


def test_presets_are_loaded_by_name(folder: Path) -> None:
    scene, _ = _load(folder, 'lights = "studio"\ncamera = "three-quarter"\n[head]\nname = "head.obj"\n')
    assert (scene.lights, scene.camera) == (studio(), three_quarter(scene.head))


def test_lights_and_camera_files_are_relative_to_the_scene(folder: Path) -> None:
    scene, _ = _load(folder, 'lights = "lights.toml"\ncamera = "camera.toml"\n[head]\nname = "head.obj"\n')
    assert scene.lights == (PointLight(position=(0, 0, 900)),)
    assert scene.camera == Camera(position=(0, 0, 900))
    assert load_lights(str(folder / "lights.toml")) == scene.lights
    assert load_camera(str(folder / "camera.toml"), scene.head) == scene.camera


def test_a_folder_beside_the_scene_does_not_hide_a_sample(folder: Path) -> None:
    (folder / "lebombo").mkdir()
    with pytest.raises(DermisError, match="this sample is an environment"):
        _load(folder, '[head]\nname = "lebombo"\n')


def test_absolute_names_are_kept(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    text = f'[head]\nname = "{folder / "head.obj"}"\ncolour = "{folder / "maps" / "skin.png"}"\n'
    scene, _ = _load(elsewhere, text)
    assert scene.head.maps.colour is not None


def test_studio_is_three_shadowed_spots_from_three_sides() -> None:
    lights = studio()
    assert [light.kind for light in lights] == ["spot"] * 3
    assert all(light.shadows for light in lights)
    key, fill, rim = (np.array(light.position) for light in lights)
    assert key[0] < 0 < fill[0] and rim[2] < 0 < min(key[2], fill[2])
    assert sum(lights[0].irradiance) > sum(lights[1].irradiance)


def test_face_regions_are_read_from_a_table(folder: Path) -> None:
    values = "".join(f'["{region}"]\nm = 0.4\nrho_s = 0.25\n' for region in REGIONS)
    (folder / "face.toml").write_text('labels = "face.png"\n' + values)
    write_png(folder / "face.png", np.zeros((16, 16), np.uint8))
    scene, _ = _load(folder, '[head]\nname = "head.obj"\nregions = "face.toml"\n[skin]\noiliness = 0.5\n')
    for picture, level in ((scene.head.maps.roughness, 0.4), (scene.head.maps.specular, 0.25)):
        np.testing.assert_allclose(picture, level, rtol=1e-5)
    assert scene.skin.rho_s == pytest.approx(0.25, rel=1e-5)
    assert scene.skin == Skin(oiliness=0.5, rho_s=scene.skin.rho_s)


@pytest.mark.parametrize(
    ("head", "skin", "said"),
    [
        ('regions = "default"', "rho_s = 0.2", "scene.toml: skin: rho_s: expected one or the other"),
        ('regions = "other"', "", "other: expected default, or regions in TOML"),
        ('regions = "default"', "", "a head whose regions are known"),
        ("regions = 3", "", "regions"),
    ],
)
def test_invalid_regions_are_refused(folder: Path, head: str, skin: str, said: str) -> None:
    with pytest.raises(DermisError, match=said):
        _load(folder, f'[head]\nname = "head.obj"\n{head}\n[skin]\n{skin}\n')


def test_old_keyword_of_the_head_warns(tmp_path: Path) -> None:
    head = load_head(write_head(tmp_path / "head.obj"))
    (tmp_path / "scene.toml").write_text('[head]\nname = "absent.obj"\n')
    with pytest.warns(DeprecationWarning, match="known is now head"):
        scene, _ = load_scene(tmp_path / "scene.toml", known=head)  # type: ignore[call-arg]
    assert scene.head is head
