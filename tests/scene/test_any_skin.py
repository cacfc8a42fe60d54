"""Cameras and lights of hands, patches of skin and whole bodies, and the colour of skin without one."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from small_figure import CENTRE, arm, figure, patch, write_obj

import dermis
from dermis.formats.parts import DEFAULT_COLOUR
from dermis.frame.features.shading.view import camera_views, world_space_pinhole
from dermis.human.skin.measured import measured_medians
from dermis.images.colour import lab
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.scene import Camera, Settings
from dermis.scene.camera import CAMERA_PRESETS, find_camera_preset
from dermis.scene.lights import PointLight, SpotLight, light_presets, preset_lights
from dermis.scene.skin_tone import default_skin_colour

UPWARDS = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
PIECES = {"arm": arm(), "patch": patch(), "patch that faces up": patch(UPWARDS)}
WHOLE = ("portrait", "three-quarter", "profile", "full_body")


def head_of(mesh: Mesh) -> Head:
    return Head("skin", mesh, Maps())


def seen(camera: Camera, head: Head) -> np.ndarray:
    """Return where the vertices are in the picture: x to the right, y up, -1 to 1."""
    (clip,) = camera_views(
        world_space_pinhole(camera, head, Settings(size=(64, 64))), head.mesh.outline, 1
    ).clips
    x, y, _, w = clip @ np.column_stack((head.mesh.positions, np.ones(len(head.mesh.positions)))).T
    assert (w > 0).all()
    return np.column_stack((x / w, y / w))


@pytest.mark.parametrize("name", WHOLE)
@pytest.mark.parametrize("piece", PIECES)
def test_camera_presets_fit_a_skin_patch_in_the_picture(piece: str, name: str) -> None:
    head = head_of(PIECES[piece])
    places = np.abs(seen(CAMERA_PRESETS[name](head), head))
    assert 0.85 < places.max() < 0.98


@pytest.mark.parametrize("name", CAMERA_PRESETS)
@pytest.mark.parametrize("piece", PIECES)
def test_every_camera_preset_shows_part_of_a_skin_patch(piece: str, name: str) -> None:
    head = head_of(PIECES[piece])
    assert (np.abs(seen(CAMERA_PRESETS[name](head), head)).max(axis=1) < 1.0).any()


def test_a_patch_that_faces_up_is_seen_from_above() -> None:
    camera = dermis.portrait(head_of(patch(UPWARDS)))
    assert camera.position[1] > 1000 and camera.up == (0.0, 0.0, -1.0)


def test_portrait_of_a_body_frames_its_head() -> None:
    head = head_of(figure())
    np.testing.assert_allclose(head.centre_mm, CENTRE, atol=1.0)
    assert dermis.portrait(head) == dermis.portrait(head_of(figure()))
    assert dermis.portrait(head).frame_mm == 340.0
    assert np.abs(seen(dermis.portrait(head), head)[: len(head.mesh.positions) // 8]).max() < 0.9


def test_full_body_shows_all_of_a_body_with_a_margin() -> None:
    head = head_of(figure())
    x, y = np.abs(seen(dermis.full_body(head), head)).max(axis=0)
    assert 0.85 < y < 0.98 and x < y


def test_the_guide_lists_all_presets() -> None:
    guide = (Path(__file__).parents[2] / "docs" / "guide.md").read_text("utf-8")
    section = guide.split("## Camera presets")[1].split("## ")[0]
    rows = re.findall(r"(?m)^\| `([\w-]+)` \|", section)
    assert rows == ["--camera", *CAMERA_PRESETS]


def test_names_of_presets_have_hyphens_or_underscores() -> None:
    assert (
        find_camera_preset("full-body") is dermis.full_body
        and find_camera_preset("three_quarter") is dermis.three_quarter
    )
    assert find_camera_preset("selfie") is None


@pytest.mark.parametrize("name", light_presets())
def test_lights_illuminate_a_body_to_its_feet(name: str) -> None:
    head = head_of(figure())
    feet = np.array([0.0, -1580.0, 0.0])
    for light, plain in zip(preset_lights(name, head), preset_lights(name), strict=True):
        if not isinstance(light, PointLight) or plain.target != (0, 0, 0):
            assert light == plain
            continue
        assert light.position == pytest.approx(np.array(plain.position) * head.reach_mm / 400)
        if isinstance(light, SpotLight):
            axis, to_feet = -np.array(light.position), feet - light.position
            cosine = axis @ to_feet / np.linalg.norm(axis) / np.linalg.norm(to_feet)
            assert np.degrees(np.arccos(cosine)) < light.inner_degrees


def test_area_lights_keep_their_apparent_size_for_bodies() -> None:
    for light, plain in zip(preset_lights("window", head_of(figure())), preset_lights("window"), strict=True):
        assert light.width_mm / np.linalg.norm(light.position) == pytest.approx(
            plain.width_mm / np.linalg.norm(plain.position)
        )


def test_lights_are_on_the_side_that_a_patch_faces() -> None:
    for light, plain in zip(preset_lights("studio", head_of(patch(UPWARDS))), dermis.studio(), strict=True):
        assert light.position == pytest.approx(np.array(plain.position) @ UPWARDS)
    scene = dermis.Scene(head_of(patch(UPWARDS)))
    assert scene.lights == dermis.studio(scene.head) == dermis.load_lights("studio", scene.head)


def load(path: Path, **options: object) -> Head:
    return dermis.load_head(path, subdivide=0, **options)


def test_skin_without_any_colour_has_that_of_the_default_skin(tmp_path: Path) -> None:
    with pytest.warns(
        dermis.base.errors.DermisWarning, match=r"no colour and is drawn as skin of 1\.8 % mel"
    ):
        head = load(write_obj(tmp_path / "arm.obj", arm()))
    assert head.maps.mean_colour == pytest.approx(default_skin_colour(), abs=1e-6)
    red, green, blue = default_skin_colour()
    assert 0.6 > red > green > blue > 0.15


@pytest.mark.parametrize(("colour", "expected"), [((0.4, 0.2, 0.1), (0.4, 0.2, 0.1)), (DEFAULT_COLOUR, None)])
def test_a_stated_colour_is_kept_but_not_the_grey_of_new_materials(
    tmp_path: Path, colour: tuple[float, float, float], expected: tuple[float, float, float] | None
) -> None:
    (tmp_path / "arm.mtl").write_text(f"newmtl skin\nKd {colour[0]} {colour[1]} {colour[2]}\n")
    head = load(write_obj(tmp_path / "arm.obj", arm(), extra="mtllib arm.mtl\nusemtl skin"))
    assert head.maps.mean_colour == pytest.approx(expected or default_skin_colour(), abs=1e-3)


def test_given_picture_is_used_as_colour(tmp_path: Path) -> None:
    dermis.write_image(tmp_path / "white.png", np.ones((1, 1, 3), np.float32))
    path = write_obj(tmp_path / "arm.obj", arm())
    assert load(path, colour=tmp_path / "white.png").maps.mean_colour == pytest.approx(np.ones(3))


def lab_of(path: Path, site: str) -> np.ndarray:
    colour = load(path, skin_site=site).maps.mean_colour
    assert colour is not None
    return lab(colour)


def test_skin_of_a_named_site_has_its_measured_colour(tmp_path: Path) -> None:
    """Palms are lighter than backs of hands; the difference is the largest in dark skin."""
    path = write_obj(tmp_path / "arm.obj", arm())
    cell = next(one for one in measured_medians() if (one.group, one.site) == ("african", "palm"))
    with pytest.warns(
        dermis.base.errors.DermisWarning, match="african palm, the median of 47 measured people"
    ):
        palm = lab_of(path, "african palm")
    assert palm == pytest.approx(cell.cielab, abs=0.01)
    with pytest.warns(dermis.base.errors.DermisWarning, match="an estimate from other groups"):
        lab_of(path, "south asian palm")
    with pytest.warns(dermis.base.errors.DermisWarning, match="mean of 8 groups"):
        back = lab_of(path, "back_of_hand")
    with pytest.warns(dermis.base.errors.DermisWarning, match="mean of 6 groups"):
        assert lab_of(path, "palm")[0] > back[0] + 5.0


def test_a_site_is_refused_where_it_would_have_no_effect(tmp_path: Path) -> None:
    dermis.write_image(tmp_path / "white.png", np.ones((1, 1, 3), np.float32))
    path = write_obj(tmp_path / "arm.obj", arm())
    with pytest.raises(dermis.DermisError, match="expected one of back of hand"):
        load(path, skin_site="elbow")
    with pytest.raises(dermis.DermisError, match="the skin has a colour map"):
        load(path, skin_site="palm", colour=tmp_path / "white.png")
    with pytest.raises(dermis.DermisError, match="expected a mesh file to which it applies"):
        dermis.load_head("human", skin_site="palm")


def test_front_option_rotates_the_head(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "patch.obj", patch(np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, -1]])), 0.2)
    turned = load(path, unit_mm=0.2, front="-z")
    np.testing.assert_allclose(turned.mesh.positions, patch().positions, atol=1e-3)


def test_a_front_along_up_is_refused(tmp_path: Path) -> None:
    with pytest.raises(dermis.DermisError, match="front: expected an axis across up, which is -z"):
        load(write_obj(tmp_path / "arm.obj", arm()), up="-z", front="z")
