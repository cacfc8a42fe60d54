"""Drags faster than frames: a control takes the value at the position of the release."""

from __future__ import annotations

import numpy as np
import pytest
from offscreen_input import InputDriver

from dermis.apps.viewer.state import ViewerState


def in_one_frame(driver: InputDriver, *path: tuple[float, float]) -> None:
    """Send a complete drag between two frames; only the release has the last position."""
    (x, y), *rest, (end_x, end_y) = path
    driver.event("pointer_move", x=x, y=y, button=0, buttons=())
    driver.event("pointer_down", x=x, y=y, button=1, buttons=(1,))
    for along in rest:
        driver.event("pointer_move", x=along[0], y=along[1], button=1, buttons=(1,))
    driver.event("pointer_up", x=end_x, y=end_y, button=1, buttons=())
    for _ in range(3):
        driver.frame()


@pytest.mark.parametrize("moves", [0, 1, 5])
def test_slider_ends_at_the_last_pointer_position(moves: int, driver: InputDriver) -> None:
    session = driver.viewer.session
    x, y = driver.position("mix")
    for end, expected in ((x + 300.0, 1.0), (x - 90.0, 0.0), (x + 300.0, 1.0)):
        between = [(x + (end - x) * k / (moves + 1), y) for k in range(1, moves + 1)]
        in_one_frame(driver, (x, y), *between, (end, y))
        assert session.state.scene.skin.mix == pytest.approx(expected)


def test_the_head_turns_as_far_as_the_pointer_went(driver: InputDriver) -> None:
    session = driver.viewer.session
    first = session.state.scene.camera
    driver.drag((300.0, 200.0), (240.0, 230.0))
    slowly = session.state.scene.camera
    session.history.undo()
    assert session.state.scene.camera == first
    in_one_frame(driver, (300.0, 200.0), (240.0, 230.0))
    assert np.abs(np.subtract(session.state.scene.camera.position, slowly.position)).max() < 1e-6
    session.history.undo()
    assert session.state.scene.camera == first


def test_divider_stays_where_it_is_released(driver: InputDriver) -> None:
    session = driver.viewer.session
    session.split.freeze(session.state)
    session.split.divider_position = 0.5
    in_one_frame(driver, (300.0, 200.0), (350.0, 200.0))
    assert session.split.divider_position == 0.75 and not session.split.is_dragged


def test_all_keys_between_two_frames_are_handled(rigged: ViewerState, driver: InputDriver) -> None:
    session = driver.viewer.session
    session.change(rigged)
    driver.press("search")
    for letter in "jaws":
        driver.event("key_down", key=letter)
        driver.event("char", data=letter)
        driver.event("key_up", key=letter)
    for kind in ("key_down", "key_up"):
        driver.event(kind, key="Backspace")
    driver.frame()
    assert session.search == "jaw"
    session.search = ""
