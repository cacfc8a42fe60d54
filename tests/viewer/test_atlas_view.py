"""The view of the flat atlas: its texels, zooming at the cursor, panning."""

from __future__ import annotations

import numpy as np
import pytest
from offscreen_input import ADAPTER, InputDriver

from dermis.apps.viewer.state import ATLAS_VIEW_NAME, AtlasView, ViewerState
from dermis.apps.viewer.view_renderer import ViewRenderer
from dermis.gpu import download

SIDE = 128  # of the tests' atlas


def place_at(atlas_view: AtlasView, x: float, y: float) -> tuple[float, float]:
    return atlas_view.centre[0] + atlas_view.span * x, atlas_view.centre[1] + atlas_view.span * y


def test_zooming_keeps_the_point_under_the_cursor() -> None:
    atlas_view = AtlasView(centre=(0.4, 0.6), span=0.3)
    near = atlas_view.zoomed(0.25, 0.2, -0.3)
    assert near.span == pytest.approx(0.075)
    assert place_at(near, 0.2, -0.3) == pytest.approx(place_at(atlas_view, 0.2, -0.3))


def test_panning_moves_the_point_with_the_cursor() -> None:
    atlas_view = AtlasView(span=0.2)
    assert place_at(atlas_view.panned(0.1, -0.2), 0.1, -0.2) == pytest.approx(atlas_view.centre)


def test_each_texel_is_drawn_as_a_square_with_its_light(state: ViewerState) -> None:
    view_renderer = ViewRenderer(ADAPTER)
    shown = state.with_view(ATLAS_VIEW_NAME).with_atlas_view(AtlasView("irradiance", (0.5, 0.5), 1.0))
    image = view_renderer.render_image(shown, state.scene.camera, (2 * SIDE, 2 * SIDE), is_moving=True)
    found = view_renderer.download_image(image).astype(float)
    assert np.array_equal(found[::2, ::2], found[1::2, 1::2])
    levels = view_renderer.renderer.prepare(
        state.scene, state.settings.model_copy(update={"size": (2 * SIDE, 2 * SIDE)})
    ).resources.diffusion.levels
    light = download(view_renderer.renderer.device, levels.stacks[0])
    light = (light if light.ndim == 3 else light[0])[..., :3] / np.pi
    assert light.max() > 0.1
    c = np.clip(light, 0.0, 1.0)
    expected = 255.0 * np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)
    assert np.abs(found[::2, ::2] - expected).max() <= 0.51


def test_pixels_over_many_texels_show_their_mean(state: ViewerState) -> None:
    view_renderer = ViewRenderer(ADAPTER)
    shown = state.with_view(ATLAS_VIEW_NAME).with_atlas_view(AtlasView("irradiance", (0.5, 0.5), 1.0))
    fine, coarse = (
        view_renderer.download_image(
            view_renderer.render_image(shown, state.scene.camera, (side, side), is_moving=False)
        ).astype(float)
        for side in (SIDE, SIDE // 4)
    )
    mean = fine.reshape(SIDE // 4, 4, SIDE // 4, 4, 3).mean(axis=(1, 3))
    assert np.abs(coarse - mean).max() <= 1.01


def test_changing_the_visible_atlas_part_draws_no_new_frame(state: ViewerState) -> None:
    view_renderer = ViewRenderer(ADAPTER)
    shown = state.with_view(ATLAS_VIEW_NAME)
    first = view_renderer.download_image(
        view_renderer.render_image(shown, state.scene.camera, (64, 64), is_moving=False)
    )
    rendered = view_renderer.rendered
    near = shown.with_atlas_view(AtlasView(span=0.2))
    assert (
        view_renderer.download_image(
            view_renderer.render_image(near, state.scene.camera, (64, 64), is_moving=False)
        )
        != first
    ).any()
    assert view_renderer.rendered is rendered
    dark = near.with_light(0, irradiance=(0.0, 0.0, 0.0))
    view_renderer.render_image(dark, state.scene.camera, (64, 64), is_moving=False)
    assert view_renderer.rendered is not rendered


def test_wheel_and_drag_move_the_atlas_and_not_the_camera(driver: InputDriver) -> None:
    session = driver.viewer.session
    driver.choose("show", ATLAS_VIEW_NAME)
    whole, camera = driver.settled(), session.state.scene.camera
    assert whole[60, 202:230].max() == whole[60, 202:230].min() == 33  # beside the atlas
    driver.event("wheel", x=350.0, y=240.0, dx=0.0, dy=-1000.0)
    near = driver.settled()
    assert session.state.atlas_view.span == pytest.approx(1.05 / np.e)
    assert near[60, 202:230].max() > 33 or near[60, 202:230].min() < 33
    driver.drag((350.0, 240.0), (330.0, 250.0))
    moved = driver.settled()
    assert np.array_equal(moved[110:400, 210:370], near[100:390, 230:390])
    driver.choose("layer", "stretch")
    assert np.abs(driver.settled()[110:400, 210:370].astype(int) - moved[110:400, 210:370]).mean() > 5.0
    driver.event("double_click", x=300.0, y=240.0)
    driver.settled()
    assert session.state.atlas_view == AtlasView("stretch") and session.state.scene.camera == camera
