"""Before and after: a frozen state left of a divider that is dragged."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from offscreen_hands import Hands

LEFT, RIGHT = 200, 400  # of the picture, beside the panel
ROWS = slice(40, 230)  # neither labels, nor the divider's handle, nor text


def sides(image: NDArray[np.uint8], edge: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """What is left and right of the divider, without its line."""
    return image[ROWS, LEFT : edge - 2], image[ROWS, edge + 2 : RIGHT]


def assert_halves(
    image: NDArray[np.uint8], before: NDArray[np.uint8], after: NDArray[np.uint8], edge: int
) -> None:
    found = sides(image, edge)
    assert np.array_equal(found[0], sides(before, edge)[0])
    assert np.array_equal(found[1], sides(after, edge)[1])


def frozen(hands: Hands) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """The pictures of two states, of which the first is frozen and the second is live."""
    before = hands.settled()
    hands.press("Before and after")
    hands.press("freeze")
    hands.press("Before and after")
    assert hands.viewer.desk.split.before is hands.viewer.desk.state
    hands.viewer.desk.split.release()
    hands.viewer.desk.change(hands.viewer.desk.state.with_skin(mix=0.0, roughness=0.7))
    after = hands.settled()
    hands.viewer.desk.split.freeze(hands.viewer.desk.history.states[-2])
    hands.viewer.desk.split.share = 0.5
    return before, after


def test_left_is_what_was_frozen_right_is_live_and_the_divider_is_dragged(hands: Hands) -> None:
    before, after = frozen(hands)
    assert np.abs(before[ROWS, LEFT:].astype(int) - after[ROWS, LEFT:]).mean() > 0.5
    assert_halves(hands.settled(), before, after, 300)
    camera = hands.viewer.desk.state.scene.camera
    hands.drag((302.0, 150.0), (252.0, 300.0))
    assert_halves(hands.settled(), before, after, 252)
    assert hands.viewer.desk.state.scene.camera == camera
    hands.viewer.desk.split.release()
    assert np.array_equal(hands.settled()[ROWS, LEFT:], after[ROWS, LEFT:])


def test_the_camera_turns_both_sides(hands: Hands) -> None:
    frozen(hands)
    split, desk = hands.viewer.desk.split, hands.viewer.desk
    still = hands.settled()
    hands.drag((350.0, 240.0), (310.0, 240.0))
    turned = hands.settled()
    for old, new in zip(sides(still, 300), sides(turned, 300), strict=True):
        assert np.abs(old.astype(int) - new).mean() > 0.5
    live, was = desk.state, split.before
    assert was is not None
    split.release()
    after = hands.settled()
    desk.change(was.with_camera(live.scene.camera))
    assert_halves(turned, hands.settled(), after, 300)


def test_a_divider_at_the_edge_shows_one_side(hands: Hands) -> None:
    before, after = frozen(hands)
    for share, whole in ((0.0, after), (1.0, before)):
        hands.viewer.desk.split.share = share
        hands.event("pointer_move", x=5.0, y=5.0, button=0, buttons=())
        found = hands.settled()[ROWS, LEFT + 2 : RIGHT - 2]
        assert np.array_equal(found, whole[ROWS, LEFT + 2 : RIGHT - 2])
