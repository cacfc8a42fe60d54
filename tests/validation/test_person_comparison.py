"""Comparison of a person with its path-traced image: textures, views and errors of the iris."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dermis.apps.truths.path_traced import PathTraced
from dermis.apps.truths.person import medium
from dermis.apps.truths.person.person import SkinTextures
from dermis.apps.validation.comparisons.person import (
    PersonComparison,
    PersonSubject,
    compare_person,
    iris_errors,
    person_comparison,
    render_frame,
    shared_skin,
    without_feature,
)
from dermis.apps.validation.comparisons.person_textures import person_textures
from dermis.apps.validation.comparisons.person_views import EYE_FRAME_MM, VIEWS, as_softbox, view_scene
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.human.skin.painted import mean_colour
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.optics.profiles import load_profile
from dermis.scene.lights import PointLight, RectangleLight, SphereLight
from dermis.scene.settings import Settings

PUPIL_MM = 2.0
SIDE = 256


@cache
def head() -> Head:
    return Human(eyes=EyeLook(eumelanin=0.6, pupil_mm=PUPIL_MM)).head()


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


@pytest.fixture(scope="module")
def paint(renderer: Renderer) -> SkinTextures:
    return person_textures(renderer, view_scene(head(), VIEWS["portrait"]), SIDE)


def test_the_iris_is_painted_around_its_pupil(paint: SkinTextures) -> None:
    side = len(paint.iris)
    along = ((np.arange(side) + 0.5) / side * 2 - 1) * paint.reach_mm
    off = np.hypot(*np.meshgrid(along, along))
    assert paint.iris[off < PUPIL_MM - 0.2].max() < 0.005
    ring = paint.iris[(off > PUPIL_MM + 0.5) & (off < 5.0)]
    assert ring[:, 0].mean() > 1.5 * ring[:, 2].mean() > 0.01  # brown


def test_sclera_is_white_and_teeth_are_set_in_gums(paint: SkinTextures) -> None:
    middle = paint.white[480:544, 480:544].mean(axis=(0, 1))
    assert 0.3 < middle[2] < middle[0] < 0.65
    upper, lower = paint.teeth
    enamel, gum = upper[100, 450:580].max(axis=0), upper[600].mean(axis=0)
    assert enamel[1] > 0.4 and gum[0] > 2 * gum[1]
    assert not np.array_equal(upper, lower)  # teeth of different widths


def test_skin_is_painted_as_the_frame_paints_it(paint: SkinTextures) -> None:
    assert paint.colour.shape == (SIDE, SIDE, 3) and paint.roughness.shape == (SIDE, SIDE)
    assert 0.2 < paint.colour[..., 0].mean() < 0.7 and 0.1 < paint.roughness.min() < paint.roughness.max()
    assert 0.01 < np.ptp(paint.height_mm) < 5.0


@pytest.mark.parametrize("name", [name for name, view in VIEWS.items() if view.light in ("studio", "window")])
def test_lights_of_all_views_have_a_size(name: str) -> None:
    scene = view_scene(head(), VIEWS[name])
    assert scene.lights
    assert all(isinstance(light, RectangleLight) for light in scene.lights)


def test_only_point_lights_become_softboxes() -> None:
    ball, point = SphereLight(position=(0, 0, 900)), PointLight(position=(0, 500, 900), irradiance=(1, 2, 3))
    assert as_softbox(ball) is ball
    found = as_softbox(point)
    assert isinstance(found, RectangleLight)
    assert (found.position, found.irradiance) == (point.position, point.irradiance)


def test_picture_is_downsampled_from_twice_its_size(renderer: Renderer) -> None:
    scene, small = view_scene(head(), VIEWS["portrait"]), Settings(size=(24, 24), atlas=128, shadow_size=256)
    large = renderer.render(scene, size=(48, 48), atlas=128, shadow_size=256)
    found = render_frame(renderer, scene, small)
    np.testing.assert_allclose(found[5, 7], large[10:12, 14:16].mean(axis=(0, 1)), rtol=1e-5, atol=1e-7)


def test_an_eye_is_close_to_its_path_traced_image(
    renderer: Renderer, paint: SkinTextures, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("mitsuba")
    monkeypatch.setattr(medium, "ALBEDO_GRID_SIDE_VOXELS", 8)
    subject = PersonSubject(view_scene(head(), VIEWS["eye"]), paint)
    skin = shared_skin(renderer, head(), "matched", tmp_path)
    pair = compare_person(
        renderer, subject, skin, "eye", picture_side=32, samples=16, atlas=256, use_cache=False
    )
    assert pair.samples == 16
    assert 0.6 < pair.energy.value < 1.6 and pair.energy.standard_error > 0.0
    assert pair.tone_mapped(pair.ours).shape == (32, 32, 3)
    pupil = pair.reference[15:17, 15:17].mean()
    assert pupil < 0.3 * pair.reference[pair.mask].mean() and pair.ours[15:17, 15:17].mean() < 0.1


def test_a_cause_is_left_out_on_both_sides(renderer: Renderer, paint: SkinTextures) -> None:
    subject = PersonSubject(view_scene(head(), VIEWS["portrait"]), paint)
    plain = without_feature(subject, "pigments")
    assert np.ptp(plain.textures.colour[..., 0]) == 0.0 < np.ptp(paint.colour[..., 0])
    assert np.array_equal(plain.scene.head.maps.colour, plain.textures.colour)
    flat = without_feature(subject, "relief")
    assert flat.textures.height_mm.max() == 0.0 == flat.scene.head.maps.height.max()
    bald = without_feature(subject, "hair").scene.head
    assert bald.hair is None and bald.strands is None
    matte = without_feature(subject, "reflection")
    assert matte.textures.strength.max() == 0.0


def test_layered_skin_has_the_thickness_of_the_person(renderer: Renderer, tmp_path: Path) -> None:
    skin = shared_skin(renderer, head(), "layered", tmp_path)
    assert skin.medium.layers[0].thickness_mm == head().maps.look.epidermis_mm
    assert load_profile(skin.profile).albedo == pytest.approx(mean_colour(head().maps.look), rel=0.03)


def iris_pair(shift: int, gain: float) -> PersonComparison:
    """Return a dark pupil in an uneven iris, and a reference that is shifted to the right and brighter."""
    side = 128
    along = (np.arange(side) + 0.5 - 0.5 * side) * EYE_FRAME_MM / side
    x, y = np.meshgrid(along, along)
    off = np.hypot(x, y)
    ours = np.repeat((0.1 + 0.02 * np.sin(5 * np.arctan2(y, x)))[..., None], 3, axis=2)
    ours[off < 2.0] = 0.001
    rng = np.random.default_rng(0)
    reference_image = gain * np.roll(ours, shift, axis=1) + rng.normal(0.0, 0.002, ours.shape)
    variance = np.full(ours.shape, 0.002**2, np.float32)
    path = PathTraced(
        reference_image.astype(np.float32), variance, np.ones((side, side), np.float32), 8, 1.0, ()
    )
    return person_comparison("eye", ours, path, np.ones((side, side), bool))


def test_iris_shift_and_brightness_are_measured() -> None:
    found = iris_errors(iris_pair(1, 0.5), EYE_FRAME_MM)
    assert found.right.value == pytest.approx(1.0, abs=0.15) and abs(found.down.value) < 0.1
    assert found.brightness.value == pytest.approx(2.0, abs=0.05)
    assert found.left_half.value == pytest.approx(2.0, abs=0.1)
    assert found.right_half.value == pytest.approx(2.0, abs=0.1)
    assert 0.0 < found.brightness.standard_error < 0.05
