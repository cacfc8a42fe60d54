"""Stages that the device runs for each kind of change; unaffected results are reused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from offscreen_input import ADAPTER

from dermis.apps.viewer.navigation import orbit
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.view_renderer import QUALITY_LEVELS, ViewRenderer
from dermis.gpu.replay import Recording
from dermis.mesh.pose import Pose
from dermis.scene.environment import Environment

SIZE = (96, 96)
SPREAD = {"diffuse", "translucency", "combine"}
PICTURE = {"shade", "post"}
WEIGHED = {"pairs"}


@pytest.fixture(scope="module")
def view_renderer() -> ViewRenderer:
    """Return a renderer without adaptive quality, so that pictures in motion are equal on all machines."""
    view_renderer = ViewRenderer(ADAPTER)
    view_renderer.quality_controller.record_frame_time = lambda _: None  # type: ignore[method-assign]
    return view_renderer


def stages(view_renderer: ViewRenderer, state: ViewerState, moving: bool = False) -> set[str]:
    """Return the stages that ran to show a state."""
    view_renderer.render_image(state, state.scene.camera, SIZE, moving)
    assert view_renderer.rendered is not None and view_renderer.rendered.gpu_ms is not None
    return set(view_renderer.rendered.gpu_ms) - {"total"}


def turned(state: ViewerState, angle: float = 0.3) -> ViewerState:
    return state.with_camera(orbit(state.scene.camera, angle, 0.1))


def skin_of(melanin: float) -> Callable[[ViewerState], ViewerState]:
    return lambda state: state.with_skin(profile="light").with_pigments(melanin=melanin)


CHANGES: dict[str, tuple[Callable[[ViewerState], ViewerState], set[str]]] = {
    "camera": (turned, {"visibility"} | PICTURE),
    "light": (
        lambda state: state.with_light(0, position=(10.0, 900.0, 500.0)),
        {"shadows", "irradiance"} | SPREAD | PICTURE,
    ),
    "light's colour": (
        lambda state: state.with_light(0, irradiance=(1.0, 2.0, 3.0)),
        {"irradiance"} | SPREAD | PICTURE,
    ),
    "roughness": (
        lambda state: state.with_skin(roughness=0.6),
        {"surface", "irradiance"} | SPREAD | PICTURE,
    ),
    "mix": (lambda state: state.with_skin(mix=1.0), {"irradiance"} | SPREAD | PICTURE),
    "profile": (lambda state: state.with_skin(profile="dark"), {"irradiance"} | WEIGHED | SPREAD | PICTURE),
    "fewer Gaussians": (  # which have another space for their levels
        lambda state: state.with_skin(profile="skin1"),
        {"irradiance"} | WEIGHED | SPREAD | PICTURE,
    ),
    "pigments": (skin_of(0.05), {"irradiance"} | WEIGHED | SPREAD | PICTURE),
    "stretch": (
        lambda state: state.with_settings(stretch="none"),
        {"stretch", "surface", "irradiance"} | WEIGHED | SPREAD | PICTURE,
    ),
    "part": (lambda state: state.with_view("specular"), PICTURE),
    "background": (lambda state: state.with_settings(background=(0.1, 0.2, 0.3)), {"background", "post"}),
    "meter": (lambda state: state.with_settings(exposure="auto"), {"meter", "post"}),
    "exposure": (lambda state: state.with_settings(exposure=2.0), {"post"}),
    "tone": (lambda state: state.with_settings(tone="filmic"), {"post"}),
    "bloom": (lambda state: state.with_settings(bloom=0.2), {"bloom", "post"}),
    "nothing": (lambda state: replace(state), set()),
}


@pytest.mark.parametrize("name", CHANGES)
def test_change_runs_only_dependent_stages(
    name: str, view_renderer: ViewRenderer, state: ViewerState
) -> None:
    change, expected = CHANGES[name]
    stages(view_renderer, state)
    assert stages(view_renderer, change(state)) == expected


SHAPE = {"shape", "stretch", "surface", "shadows", "irradiance", "pairs", "visibility"} | SPREAD | PICTURE


def jaw_open(state: ViewerState, weight: float) -> ViewerState:
    return state.with_pose(Pose({"jawOpen": weight}, {"neck": (0.0, 10.0, 0.0)}))


def test_pose_runs_shape_dependent_stages(view_renderer: ViewRenderer, rigged: ViewerState) -> None:
    stages(view_renderer, jaw_open(rigged, 0.1))
    assert stages(view_renderer, jaw_open(rigged, 0.2)) == SHAPE
    assert stages(view_renderer, jaw_open(rigged, 0.2)) == set()
    assert stages(view_renderer, turned(jaw_open(rigged, 0.2))) == {"visibility"} | PICTURE
    assert stages(view_renderer, turned(rigged)) == SHAPE


def test_pose_loads_no_files(view_renderer: ViewRenderer, rigged: ViewerState, made: list[str]) -> None:
    for weight in (0.1, 0.2):
        stages(view_renderer, jaw_open(rigged, weight), moving=True)
    made.clear()
    stages(view_renderer, jaw_open(rigged, 0.3), moving=True)
    assert [one for one in made if one != "create_buffer_with_data"] == []
    assert len(made) <= 1


def test_the_atlas_view_follows_the_pose(view_renderer: ViewRenderer, rigged: ViewerState) -> None:
    flat = jaw_open(rigged, 0.2).with_view("atlas")
    stages(view_renderer, flat)
    assert stages(view_renderer, flat.with_pose(Pose({"jawOpen": 0.9}))) >= {"shape", "irradiance"}


def test_environment_light_is_recomputed_for_a_new_profile(
    view_renderer: ViewRenderer, state: ViewerState
) -> None:
    """Surrounding skin reflects light, and more so with a pale profile."""
    around = state.with_environment(Environment(name="uniform"))
    stages(view_renderer, around)
    assert "irradiance" in stages(view_renderer, around.with_skin(profile="skin1"))
    assert stages(view_renderer, turned(around)) >= {"visibility", "shade"}


@pytest.fixture
def made(view_renderer: ViewRenderer, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Yield a log of textures and buffers created on the device, and of the data written to them."""
    handle, log = view_renderer.renderer.device.handle, list[str]()
    for owner, name in (
        (handle, "create_texture"),
        (handle, "create_buffer_with_data"),
        (handle, "create_buffer"),
        (handle.queue, "write_texture"),
    ):
        monkeypatch.setattr(owner, name, _counted(getattr(owner, name), name, log))
    yield log


def _counted(call: Callable[..., Any], name: str, log: list[str]) -> Callable[..., Any]:
    def counted(*args: Any, **kwargs: Any) -> Any:
        log.append(name)
        return call(*args, **kwargs)

    return counted


@pytest.mark.parametrize("name", ["camera", "light", "roughness", "mix", "exposure", "nothing"])
def test_camera_move_loads_no_files(
    name: str, view_renderer: ViewRenderer, state: ViewerState, made: list[str]
) -> None:
    change, _ = CHANGES[name]
    stages(view_renderer, state)
    stages(view_renderer, change(state))  # what this kind of frame needs once
    stages(view_renderer, state)
    made.clear()
    stages(view_renderer, change(turned(state, -0.2)))
    assert [one for one in made if one != "create_buffer_with_data"] == []
    assert len(made) <= 1 + (name == "light")  # the lights' records


def test_pigments_load_no_texture(view_renderer: ViewRenderer, state: ViewerState, made: list[str]) -> None:
    stages(view_renderer, skin_of(0.05)(state))
    stages(view_renderer, skin_of(0.051)(state))
    made.clear()
    stages(view_renderer, skin_of(0.052)(state))
    assert "write_texture" not in made


def both(
    view_renderer: ViewRenderer, state: ViewerState, before: ViewerState, moving: bool = True
) -> list[set[str]]:
    """Return the stages that ran for the frozen state and for the live one."""
    ran: list[set[str]] = []
    draw = view_renderer.renderer.draw

    def noted(*args: Any, **kwargs: Any) -> Any:
        rendered = draw(*args, **kwargs)
        assert rendered.gpu_ms is not None
        ran.append(set(rendered.gpu_ms) - {"total"})
        return rendered

    view_renderer.renderer.draw = noted  # type: ignore[method-assign]
    try:
        view_renderer.render_images(state, before, state.scene.camera, SIZE, moving)
    finally:
        view_renderer.renderer.draw = draw  # type: ignore[method-assign]
    return ran


@pytest.mark.parametrize("name", ["light", "mix", "pigments", "stretch"])
def test_a_camera_lights_neither_side_of_the_divider(
    name: str, view_renderer: ViewRenderer, state: ViewerState, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the same camera the second side needs no visibility either."""
    recorded: list[int] = []
    begin = Recording.__init__

    def counted(self: Recording, device: Any) -> None:
        recorded.append(1)
        begin(self, device)

    live = CHANGES[name][0](state)
    both(view_renderer, live, state)
    monkeypatch.setattr(Recording, "__init__", counted)
    for angle in (0.1, 0.2, 0.3):
        assert both(view_renderer, turned(live, angle), state) == [{"visibility"} | PICTURE, PICTURE]
    assert recorded == []


def test_other_shadow_size_has_separate_light(
    view_renderer: ViewRenderer, state: ViewerState, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames in motion differ from still ones only in this size."""
    coarse = replace(QUALITY_LEVELS[2], shadow_size=64)
    monkeypatch.setattr(
        "dermis.apps.viewer.view_renderer.QUALITY_LEVELS", (QUALITY_LEVELS[0], coarse, coarse, coarse)
    )
    for moving in (True, False):
        stages(view_renderer, turned(state, 0.1), moving)
    for angle, moving in ((0.2, True), (0.2, False), (0.3, True)):
        assert stages(view_renderer, turned(state, angle), moving) == {"visibility"} | PICTURE


def test_only_shading_frames_adjust_quality(
    view_renderer: ViewRenderer, state: ViewerState, monkeypatch: pytest.MonkeyPatch
) -> None:
    noted: list[float] = []
    monkeypatch.setattr(view_renderer.quality_controller, "record_frame_time", noted.append)
    stages(view_renderer, state, moving=True)
    noted.clear()
    stages(view_renderer, CHANGES["exposure"][0](state), moving=True)
    assert noted == []
    stages(view_renderer, turned(state, 0.7), moving=True)
    assert len(noted) == 1


def test_a_slider_leaves_the_frozen_side(view_renderer: ViewRenderer, state: ViewerState) -> None:
    both(view_renderer, state.with_skin(mix=0.4), state)
    assert both(view_renderer, state.with_skin(mix=0.3), state) == [{"irradiance"} | SPREAD | PICTURE]


def test_states_in_motion_and_still_are_recorded_once(
    view_renderer: ViewRenderer, state: ViewerState, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = replace(QUALITY_LEVELS[2], atlas=64)
    monkeypatch.setattr(
        "dermis.apps.viewer.view_renderer.QUALITY_LEVELS", (QUALITY_LEVELS[0], small, small, small)
    )
    live = state.with_skin(mix=0.9)
    for moving in (True, False):
        both(view_renderer, live, state, moving)
    for angle, moving in ((0.1, True), (0.1, False), (0.2, True), (0.2, False)):
        ran = both(view_renderer, turned(live, angle), state, moving)
        assert not any({"irradiance", "diffuse"} & one for one in ran)


@pytest.mark.parametrize("view", ["irradiance", "blur 1", "atlas"])
def test_level_views_show_light_of_the_live_state(
    view: str, view_renderer: ViewRenderer, state: ViewerState
) -> None:
    """Also after the light of another state was blurred in between, and after its profile is restored."""
    plain = view_renderer.download_image(
        view_renderer.render_image(state.with_view(view), state.scene.camera, SIZE, False)
    ).astype(int)
    other = state.with_skin(profile="skin1", mix=1.0).with_light(0, irradiance=(0.1, 0.1, 0.1))
    both(view_renderer, state, other, moving=False)
    again = view_renderer.download_image(
        view_renderer.render_image(state.with_view(view), state.scene.camera, SIZE, False)
    ).astype(int)
    assert np.array_equal(plain, again)
    view_renderer.render_image(state.with_skin(profile="dj3"), state.scene.camera, SIZE, False)
    view_renderer.render_image(state, state.scene.camera, SIZE, False)
    back = view_renderer.download_image(
        view_renderer.render_image(state.with_view(view), state.scene.camera, SIZE, False)
    ).astype(int)
    assert np.array_equal(plain, back)
