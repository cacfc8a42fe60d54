"""Expressions and motions in the panel, changed by pointer and keys on an offscreen canvas."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_input import SETTINGS, InputDriver

from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.posing import target_weight
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.view_renderer import QUALITY_LEVELS
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene import Scene

PICTURE = np.s_[:380, 205:]


@pytest.fixture(autouse=True)
def steady(monkeypatch: pytest.MonkeyPatch) -> None:
    """Disable adaptive quality, so that pictures in motion are equal on fast and on busy machines."""
    monkeypatch.setattr(
        "dermis.apps.viewer.view_renderer.QualityController.record_frame_time", lambda *_: None
    )


@pytest.fixture(scope="module")
def player(make_driver: Callable[..., InputDriver], rigged_head: Head, rigged_file: Path) -> InputDriver:
    """Yield a viewer that plays a motion."""
    first = ViewerState(Scene(rigged_head), SETTINGS, {"name": str(rigged_file)})
    return make_driver(first, MotionFile(rigged_file))


@pytest.fixture
def faces(player: InputDriver, caplog: pytest.LogCaptureFixture) -> Iterator[InputDriver]:
    """Yield the viewer paused in the rest pose, in a window that shows the sections about motion."""
    session = player.viewer.session
    session.player.stop()
    while session.history.can_undo:
        session.history.undo()
    session.search = ""
    yield player
    assert [record.message for record in caplog.records if record.levelname == "ERROR"] == []


def difference(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    return float(np.abs(a[PICTURE].astype(int) - b[PICTURE].astype(int)).mean())


def typed(driver: InputDriver, text: str) -> None:
    for letter in text:
        driver.event("key_down", key=letter)
        driver.event("char", data=letter)
        driver.event("key_up", key=letter)
        driver.frame()


def sliders(driver: InputDriver) -> set[str]:
    positions = driver.viewer.session.positions
    positions.clear()
    driver.frame()
    return {label.removesuffix("##target") for label in positions if label.endswith("##target")}


def test_motion_plays_at_once(player: InputDriver) -> None:
    first, _, later = player.frame(), player.frame(), player.frame(0.5)
    assert player.viewer.session.player.is_playing and difference(first, later) > 1.0


def test_slider_moves_the_head_as_one_undo_step(faces: InputDriver) -> None:
    before, session = faces.settled(), faces.viewer.session
    x, y = faces.position("jawOpen##target")
    faces.drag((x, y), (x + 60.0, y))
    assert 0.3 < target_weight(session.state.scene, "jawOpen") < 1.0
    assert difference(before, faces.settled()) > 0.3
    session.history.undo()
    assert not session.history.can_undo
    faces.event("pointer_move", x=390.0, y=5.0, button=0, buttons=())
    assert difference(before, faces.settled()) == 0.0


def test_dragged_slider_shows_each_weight(faces: InputDriver) -> None:
    x, y = faces.position("jawOpen##target")
    faces.event("pointer_move", x=x, y=y, button=0, buttons=())
    faces.event("pointer_down", x=x, y=y, button=1, buttons=(1,))
    faces.frame()
    view_renderer, ran, last = faces.viewer.session.view_renderer, [], faces.frame()
    for k in range(1, 5):
        faces.event("pointer_move", x=x + 9.0 * k, y=y, button=1, buttons=(1,))
        faces.frame()
        shown = faces.frame()  # the panel is drawn after the picture, so the next one shows it
        ran.append(set(view_renderer.rendered.gpu_ms or {}))
        assert difference(last, shown) > 0.0
        last = shown
    faces.event("pointer_up", x=x + 36.0, y=y, button=1, buttons=())
    faces.frame()
    assert all("shape" in one and "shade" in one for one in ran)


def test_target_names_are_searchable(faces: InputDriver) -> None:
    session = faces.viewer.session
    assert sliders(faces) == set(session.state.scene.head.targets)
    faces.press("search")
    typed(faces, "SMILE")
    assert session.search == "SMILE" and sliders(faces) == {"mouthSmileLeft", "mouthSmileRight"}
    typed(faces, " x")
    assert sliders(faces) == set() and not session.player.is_playing
    faces.click((300.0, 470.0))


def test_bone_controls_are_collapsed_and_rotate_the_head(faces: InputDriver) -> None:
    before, session = faces.settled(), faces.viewer.session
    assert "head##bone" not in session.positions
    faces.press("bones")
    x, y = faces.position("neck##bone")
    faces.drag((x, y), (x + 6.0, y))
    degrees = session.state.scene.pose.bones["neck"]
    assert 0.0 < abs(degrees[0]) <= 60.0 and degrees[1:] == (0.0, 0.0)
    faces.press("bones")
    assert difference(before, faces.settled()) > 0.3
    session.history.undo()
    assert not session.history.can_undo


def test_rest_button_resets_the_pose_in_one_step(faces: InputDriver) -> None:
    before, session = faces.settled(), faces.viewer.session
    session.change(session.state.with_pose(Pose({"jawOpen": 1.0}, {"neck": (0.0, 30.0, 0.0)})))
    assert difference(before, faces.settled()) > 1.0
    faces.press("rest")
    assert session.state.scene.pose is None and len(session.history.states) == 3
    faces.event("pointer_move", x=390.0, y=5.0, button=0, buttons=())
    assert difference(before, faces.settled()) == 0.0


def test_play_key_pauses_and_refines_the_last_pose(faces: InputDriver) -> None:
    session, view_renderer = faces.viewer.session, faces.viewer.session.view_renderer
    rest = faces.settled()
    faces.event("key_down", key=" ")
    faces.frame()
    for _ in range(21):  # the clock begins with the first of them
        faces.frame()
        assert not faces.viewer.is_still
        assert view_renderer.settings.samples == QUALITY_LEVELS[2].samples < SETTINGS.samples
    faces.event("key_down", key=" ")
    paused = faces.settled()
    assert view_renderer.settings.samples == SETTINGS.samples and difference(rest, paused) > 1.0
    assert session.state.seconds == pytest.approx(1.0) and session.history.can_undo
    again = session.state
    session.history.undo()
    assert not session.history.can_undo and difference(rest, faces.settled()) == 0.0
    session.change(session.state.with_pose(again.scene.pose))
    assert difference(paused, faces.settled()) == 0.0


def test_playback_buttons_and_time_slider_work(faces: InputDriver) -> None:
    session = faces.viewer.session
    faces.press("play##motion")
    assert session.player.is_playing and not session.history.can_undo
    x, y = faces.position("time")
    faces.drag((x, y), (x + 30.0, y))
    assert not session.player.is_playing and len(session.history.states) == 2
    assert target_weight(session.state.scene, "jawOpen") == pytest.approx(_talk(session.state.seconds))
    faces.press("loop")
    faces.press("play##motion")
    for _ in range(5):
        faces.frame(0.5)
    assert not session.player.is_playing and session.state.seconds == 2.0
    faces.press("loop")


def _talk(seconds: float) -> float:
    """Return how far the jaw is open in the head's own clip."""
    return 1.0 - abs(seconds - 1.0)


def test_current_pose_is_saved_and_frozen(faces: InputDriver, tmp_path: Path) -> None:
    session = faces.viewer.session
    faces.event("key_down", key=" ")
    faces.frame()
    faces.frame(0.7)
    session.save(tmp_path / "scene.toml")
    assert "jawOpen" in (tmp_path / "scene.toml").read_text()
    session.split.freeze(session.displayed_state)
    moving: Any = session.displayed_state
    faces.frame(0.2)
    assert session.split.frozen_state is moving and session.displayed_state is not moving
    session.split.release()
    session.load(tmp_path / "scene.toml")
    assert not session.player.is_playing
    assert target_weight(session.state.scene, "jawOpen") == target_weight(moving.scene, "jawOpen")


def test_a_motion_is_opened_by_name(faces: InputDriver, tmp_path: Path) -> None:
    session = faces.viewer.session
    own, session.motion_file = session.motion_file, str(tmp_path / "nowhere.csv")
    faces.press("open")
    assert "nowhere.csv" in session.message and not session.player.is_playing
    session.motion_file = own
    faces.press("open")
    assert session.player.is_playing


def test_static_head_has_no_motion_sections(driver: InputDriver) -> None:
    driver.settled()
    assert not {"Expressions", "Motion", "search", "rest"} & set(driver.viewer.session.positions)
    driver.event("key_down", key=" ")
    driver.frame()
    assert not driver.viewer.session.player.is_playing
