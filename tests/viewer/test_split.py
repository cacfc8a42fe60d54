"""The before/after comparison: a frozen state left of a divider that can be dragged."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from offscreen_input import InputDriver

LEFT, RIGHT = 200, 400  # of the picture, beside the panel
ROWS = slice(40, 230)  # neither labels, nor the divider's handle, nor text


def sides(image: NDArray[np.uint8], edge: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the pictures left and right of the divider, without its line."""
    return image[ROWS, LEFT : edge - 2], image[ROWS, edge + 2 : RIGHT]


def assert_halves(
    image: NDArray[np.uint8], before: NDArray[np.uint8], after: NDArray[np.uint8], edge: int
) -> None:
    found = sides(image, edge)
    assert np.array_equal(found[0], sides(before, edge)[0])
    assert np.array_equal(found[1], sides(after, edge)[1])


def frozen(driver: InputDriver) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the pictures of two states, the first frozen and the second live."""
    before = driver.settled()
    driver.press("Before and after")
    driver.press("freeze")
    driver.press("Before and after")
    assert driver.viewer.session.split.frozen_state is driver.viewer.session.state
    driver.viewer.session.split.release()
    driver.viewer.session.change(driver.viewer.session.state.with_skin(mix=0.0, roughness=0.7))
    after = driver.settled()
    driver.viewer.session.split.freeze(driver.viewer.session.history.states[-2])
    driver.viewer.session.split.divider_position = 0.5
    return before, after


def test_left_side_is_frozen_right_is_live_and_the_divider_moves(driver: InputDriver) -> None:
    before, after = frozen(driver)
    assert np.abs(before[ROWS, LEFT:].astype(int) - after[ROWS, LEFT:]).mean() > 0.5
    assert_halves(driver.settled(), before, after, 300)
    camera = driver.viewer.session.state.scene.camera
    driver.drag((302.0, 150.0), (252.0, 300.0))
    assert_halves(driver.settled(), before, after, 252)
    assert driver.viewer.session.state.scene.camera == camera
    driver.viewer.session.split.release()
    assert np.array_equal(driver.settled()[ROWS, LEFT:], after[ROWS, LEFT:])


def test_camera_applies_to_both_sides(driver: InputDriver) -> None:
    frozen(driver)
    split, session = driver.viewer.session.split, driver.viewer.session
    still = driver.settled()
    driver.drag((350.0, 240.0), (310.0, 240.0))
    turned = driver.settled()
    for old, new in zip(sides(still, 300), sides(turned, 300), strict=True):
        assert np.abs(old.astype(int) - new).mean() > 0.5
    live, was = session.state, split.frozen_state
    assert was is not None
    split.release()
    after = driver.settled()
    session.change(was.with_camera(live.scene.camera))
    assert_halves(turned, driver.settled(), after, 300)


def test_a_divider_at_the_edge_shows_one_side(driver: InputDriver) -> None:
    before, after = frozen(driver)
    for share, whole in ((0.0, after), (1.0, before)):
        driver.viewer.session.split.divider_position = share
        driver.event("pointer_move", x=5.0, y=5.0, button=0, buttons=())
        found = driver.settled()[ROWS, LEFT + 2 : RIGHT - 2]
        assert np.array_equal(found, whole[ROWS, LEFT + 2 : RIGHT - 2])
