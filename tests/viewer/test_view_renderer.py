"""Rendering of states: nothing is computed twice, and cached results equal those of a new renderer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from offscreen_input import ADAPTER, SETTINGS

from dermis.apps.viewer.navigation import orbit
from dermis.apps.viewer.state import ATLAS_VIEW_NAME, ViewerState
from dermis.apps.viewer.view_renderer import QUALITY_LEVELS, ViewRenderer
from dermis.apps.viewer.views import VIEW_NAMES
from dermis.frame.renderer import Renderer
from dermis.images.io import read_image
from dermis.scene import Settings

SIZE = (96, 96)
LIT = {"irradiance", "diffuse", "combine"}


@pytest.fixture(scope="module")
def view_renderer() -> ViewRenderer:
    """Return a renderer without adaptive quality, so that pictures in motion are equal on all machines."""
    view_renderer = ViewRenderer(ADAPTER)
    view_renderer.quality_controller.record_frame_time = lambda _: None  # type: ignore[method-assign]
    return view_renderer


@pytest.fixture(scope="module")
def fresh() -> Renderer:
    """Return a renderer that computes everything for each image."""
    return Renderer(ADAPTER)


def image(view_renderer: ViewRenderer, state: ViewerState, moving: bool = False) -> Any:
    return view_renderer.download_image(
        view_renderer.render_image(state, state.scene.camera, SIZE, moving)
    ).astype(int)


def stages(view_renderer: ViewRenderer) -> set[str]:
    assert view_renderer.rendered is not None and view_renderer.rendered.gpu_ms is not None
    return set(view_renderer.rendered.gpu_ms)


def turned(state: ViewerState, angle: float = 0.5) -> ViewerState:
    return state.with_camera(orbit(state.scene.camera, angle, 0.1))


def brighter(state: ViewerState) -> ViewerState:
    return state.with_light(0, position=(0.0, 900.0, 500.0))


CHANGES: dict[str, Callable[[ViewerState], ViewerState]] = {
    "camera": turned,
    "light": brighter,
    "roughness": lambda state: state.with_skin(roughness=0.6),
    "mix": lambda state: state.with_skin(mix=1.0),
    "energy": lambda state: state.with_skin(energy="none"),
    "lobe": lambda state: state.with_skin(specular="blinn-phong"),
    "profile": lambda state: state.with_skin(profile="skin1"),
    "pigments": lambda state: state.with_skin(profile="light", albedo="profile").with_pigments(melanin=0.05),
    "one blur": lambda state: state.with_settings(technique="one-blur"),
    "no stretch": lambda state: state.with_settings(stretch="none"),
    "cleared seams": lambda state: state.with_settings(seams="clear-colour"),
    "no transmission": lambda state: state.with_settings(transmission="none"),
    "exposure": lambda state: state.with_settings(exposure=2.0),
    "head": lambda state: state,
}


@pytest.mark.parametrize("name", CHANGES)
def test_reused_results_do_not_change_pictures(
    name: str, view_renderer: ViewRenderer, fresh: Renderer, state: ViewerState
) -> None:
    image(view_renderer, state)
    validated_copy = CHANGES[name](state)
    expected = fresh.draw(
        validated_copy.scene, validated_copy.settings.model_copy(update={"size": SIZE}), run_all_passes=True
    )
    off = np.abs(image(view_renderer, validated_copy) - expected.srgb8().astype(int))
    assert off.max() <= (1 if name == "pigments" else 0)  # whose fit begins elsewhere


def test_camera_change_does_not_relight_the_atlas(view_renderer: ViewRenderer, state: ViewerState) -> None:
    first = image(view_renderer, state)
    second = image(view_renderer, turned(state))
    assert not LIT & stages(view_renderer) and "shade" in stages(view_renderer)
    assert np.abs(first - second).mean() > 1.0


def test_light_change_relights_without_loading_maps(view_renderer: ViewRenderer, state: ViewerState) -> None:
    image(view_renderer, state)
    before = prepared(view_renderer, state)
    image(view_renderer, brighter(state))
    assert stages(view_renderer) >= LIT | {"shadows"}
    assert_same_textures(before, prepared(view_renderer, brighter(state)))


def test_pigment_change_refits_without_loading_files(view_renderer: ViewRenderer, state: ViewerState) -> None:
    skin = state.with_skin(profile="light")
    before = prepared(view_renderer, skin.with_pigments(melanin=0.02))
    after = prepared(view_renderer, skin.with_pigments(melanin=0.021))
    assert not np.array_equal(before.blurs[0].weight, after.blurs[0].weight)
    assert_same_textures(before, after)
    assert before.layouts[0].translucency.pairs is after.layouts[0].translucency.pairs


def test_wider_pigments_get_new_pairs(
    view_renderer: ViewRenderer, fresh: Renderer, state: ViewerState
) -> None:
    pale, dark = (
        state.with_skin(profile="light", albedo="profile").with_pigments(melanin=melanin)
        for melanin in (0.01, 0.2)
    )
    pairs = [prepared(view_renderer, one).layouts[0].translucency.pairs for one in (pale, dark)]
    assert pairs[0].cells.radius_mm != pairs[1].cells.radius_mm
    image(view_renderer, pale)
    fresh.clear_cache()
    expected = fresh.draw(dark.scene, dark.settings.model_copy(update={"size": SIZE})).srgb8().astype(int)
    assert np.abs(image(view_renderer, dark) - expected).max() <= 1  # whose fit begins elsewhere


def prepared(view_renderer: ViewRenderer, state: ViewerState) -> Any:
    return view_renderer.renderer.prepare(state.scene, state.settings.model_copy(update={"size": SIZE}))


def assert_same_textures(a: Any, b: Any) -> None:
    """Assert that maps, mesh and atlas are the same objects on the device."""
    for name in ("colour_map", "slope_map", "relief_map", "vertex_table", "albedo_table"):
        assert a.bindings[name] is b.bindings[name], name
    for name in ("atlas", "stretch_map", "reach_map"):
        assert a.layouts[0].atlas.resources[name] is b.layouts[0].atlas.resources[name], name


def test_alternating_sizes_are_lit_once_each(
    view_renderer: ViewRenderer, state: ViewerState, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = replace(QUALITY_LEVELS[2], atlas=64)
    monkeypatch.setattr(
        "dermis.apps.viewer.view_renderer.QUALITY_LEVELS", (QUALITY_LEVELS[0], small, small, small)
    )
    moving, still = [(turned(state, 0.1 * k), bool(k % 2)) for k in (1, 2)]
    for one, moves in (moving, still):
        image(view_renderer, one, moves)
    for one, moves in (moving, still):
        image(view_renderer, turned(one, 0.3), moves)
        assert not LIT & stages(view_renderer)


def test_an_unchanged_state_is_not_drawn_again(view_renderer: ViewRenderer, state: ViewerState) -> None:
    image(view_renderer, state)
    before = view_renderer.rendered
    image(view_renderer, state)
    assert view_renderer.rendered is before


def test_diffuse_and_specular_add_up_to_the_picture(fresh: Renderer, state: ViewerState) -> None:
    whole, below, over = (
        fresh.render(state.scene, **SETTINGS.model_dump() | {"size": SIZE, "parts": parts})
        for parts in ("all", "diffuse", "specular")
    )
    assert over.max() > 0.01 and below.max() > 0.1
    assert np.allclose(below + over, whole, atol=1e-5)


@pytest.mark.parametrize(
    "view", [view for view in VIEW_NAMES if view not in ("picture", "blur 6", ATLAS_VIEW_NAME)]
)
def test_each_view_shows_a_distinct_picture_of_the_head(
    view: str, view_renderer: ViewRenderer, state: ViewerState
) -> None:
    picture, found = image(view_renderer, state), image(view_renderer, state.with_view(view))
    head = picture.sum(axis=-1) > 0
    assert head.mean() > 0.1
    assert (found[~head] == 0).mean() > 0.99
    assert np.abs(found - picture)[head].mean() > 0.5


def test_level_view_shows_the_atlas_light(view_renderer: ViewRenderer, state: ViewerState) -> None:
    """A wider blur gives a smoother picture."""
    rough = [
        np.abs(np.diff(image(view_renderer, state.with_view(f"blur {k}")), axis=1)).sum() for k in (1, 5)
    ]
    assert rough[1] < rough[0]


def test_normals_are_those_of_the_ellipsoid(view_renderer: ViewRenderer, state: ViewerState) -> None:
    middle = image(view_renderer, state.with_view("normals"))[48, 48]
    assert np.abs(middle - (127.5, 127.5, 255.0)).max() < 40.0


def test_screenshots_have_any_size_and_the_current_view(
    view_renderer: ViewRenderer, state: ViewerState, tmp_path: Path
) -> None:
    view_renderer.screenshot(tmp_path / "a.png", state, (50, 40))
    view_renderer.screenshot(tmp_path / "a.exr", state, (50, 40))
    view_renderer.screenshot(tmp_path / "n.png", state.with_view("normals"), (50, 40))
    found = [read_image(tmp_path / name) for name in ("a.png", "a.exr", "n.png")]
    assert [one.shape[:2] for one in found] == [(40, 50)] * 3
    assert found[1].dtype == np.float32 and float(np.abs(found[0][..., :3] - found[2]).max()) > 0.0


def test_window_settings_follow_the_quality(view_renderer: ViewRenderer, state: ViewerState) -> None:
    image(view_renderer, state.with_settings(size=(4000, 4000)))
    assert isinstance(view_renderer.settings, Settings) and view_renderer.settings.size == SIZE
