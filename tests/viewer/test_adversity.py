"""Windows that change size all the time or have none, devices that go, and hands quicker than frames."""

from __future__ import annotations

import gc
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from offscreen_hands import Hands

from dermis.gpu.memory import held_bytes
from dermis.viewer.chart import ATLAS

SIZE, ON_HEAD = (400, 480), (300.0, 240.0)
PICTURE = slice(0, 380), slice(205, 400)  # neither the panel nor the text at the lower edge
FEW_BYTES = 1.02  # of what was held: a picture of another size may have taken the place of a small one


@pytest.fixture(autouse=True)
def steady(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures in motion that are alike, and take the same memory, on quick and on busy machines."""
    monkeypatch.setattr("dermis.viewer.pace.Pace.note", lambda *_: None)


def resized(hands: Hands, width: int, height: int) -> None:
    """As windows tell it, before anything is drawn."""
    hands.canvas._size_info.set_physical_size(width, height, 1.0)


def move(hands: Hands, x: float, y: float = ON_HEAD[1], kind: str = "pointer_move") -> None:
    hands.event(kind, x=x, y=y, button=1, buttons=(1,))


def lose_device(hands: Hands) -> Any:
    studio = hands.viewer.desk.studio
    studio.renderer.device.handle.destroy()
    return studio


def test_a_storm_of_sizes_ends_in_the_same_picture_and_memory(hands: Hands) -> None:
    before = hands.settled()
    for width, height in ((300, 200), SIZE):  # both sizes of everything have been there
        resized(hands, width, height)
        hands.settled()
    held, chance = held_bytes(), random.Random(5)
    move(hands, ON_HEAD[0], kind="pointer_down")
    for _ in range(20):
        for _ in range(chance.randrange(3)):  # some sizes are never drawn
            resized(hands, chance.randrange(500), chance.randrange(500))
        move(hands, chance.uniform(200.0, 400.0))
        hands.frame(chance.uniform(0.0, 0.4))
    resized(hands, *SIZE)
    move(hands, ON_HEAD[0], kind="pointer_up")
    while hands.viewer.desk.history.can_undo:
        hands.viewer.desk.history.undo()
    hands.settled()
    resized(hands, 300, 200)
    hands.settled()
    resized(hands, *SIZE)
    assert np.array_equal(hands.settled()[PICTURE], before[PICTURE])
    gc.collect()
    assert held_bytes() <= FEW_BYTES * held


@pytest.mark.parametrize("how", ["picture", "split", ATLAS, "normals"])
def test_a_minimised_window_goes_on_where_it_was(hands: Hands, how: str) -> None:
    desk = hands.viewer.desk
    if how == "split":
        desk.split.freeze(desk.state)
        desk.change(desk.state.with_skin(mix=0.0))
    else:
        desk.change(desk.state.in_view(how))
    before = hands.settled()
    move(hands, ON_HEAD[0], kind="pointer_down")
    for size in ((0, 0), (0, 300), (1, 1), (290, 2)):
        resized(hands, *size)
        hands.frame()
        hands.settled()
    resized(hands, *SIZE)
    move(hands, ON_HEAD[0], kind="pointer_up")
    assert np.array_equal(hands.settled(), before)


@pytest.mark.parametrize("how", ["split", ATLAS, "minimised"])
def test_a_device_lost_in_a_drag_comes_back(make_hands: Callable[[], Hands], how: str) -> None:
    hands = make_hands()
    desk = hands.viewer.desk
    if how == "split":
        desk.split.freeze(desk.state)
        desk.split.share = 0.2  # away from the hand
        desk.change(desk.state.with_skin(mix=0.0))
    elif how == ATLAS:
        desk.change(desk.state.in_view(ATLAS))
    hands.settled()
    move(hands, ON_HEAD[0], kind="pointer_down")
    move(hands, ON_HEAD[0] - 20.0)
    hands.frame()
    lost = lose_device(hands)
    if how == "minimised":
        resized(hands, 0, 0)
    move(hands, ON_HEAD[0] - 40.0)
    hands.frame()
    hands.frame()
    resized(hands, *SIZE)
    move(hands, ON_HEAD[0] - 60.0)
    move(hands, ON_HEAD[0] - 60.0, kind="pointer_up")
    after = hands.settled()
    assert desk.studio is not lost and hands.viewer.failure is None
    same = make_hands()
    same.viewer.desk.split.before, same.viewer.desk.split.share = desk.split.before, desk.split.share
    same.viewer.desk.change(desk.state)
    same.event("pointer_move", x=ON_HEAD[0] - 60.0, y=ON_HEAD[1], button=0, buttons=())
    found = same.settled()
    np.testing.assert_array_equal(found[PICTURE], after[PICTURE])


def test_devices_that_go_one_after_the_other_leave_nothing_behind(make_hands: Callable[[], Hands]) -> None:
    hands = make_hands()
    before = hands.settled()
    gc.collect()
    held = held_bytes()
    for k in range(3):
        lose_device(hands)
        hands.viewer.desk.change(hands.viewer.desk.state.with_skin(mix=0.1 * k))
        hands.frame()
        hands.settled()
    while hands.viewer.desk.history.can_undo:
        hands.viewer.desk.history.undo()
    assert np.array_equal(hands.settled()[PICTURE], before[PICTURE])
    gc.collect()
    assert held_bytes() <= FEW_BYTES * held


def test_a_device_that_never_works_again_closes_the_window(
    make_hands: Callable[[], Hands], monkeypatch: pytest.MonkeyPatch
) -> None:
    import wgpu

    hands = make_hands()
    hands.settled()

    def fail(*_: Any) -> Any:
        raise wgpu.GPUError("lost")

    monkeypatch.setattr("dermis.viewer.studio.Studio.pictures", fail)
    for _ in range(6):
        if not hands.canvas.get_closed():
            hands.viewer.draw()
    assert hands.canvas.get_closed() and isinstance(hands.viewer.failure, wgpu.GPUError)


def test_what_hands_do_during_a_frame_is_in_the_next_one(
    hands: Hands, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of it at once: nothing queues, and it is one step of the history."""
    hands.settled()
    desk = hands.viewer.desk
    start, image, frames = desk.state, desk.studio.image, []

    def long_frame(*given: Any) -> Any:
        if not frames:
            for k in range(300):
                move(hands, ON_HEAD[0] - 0.3 * k)
        frames.append(desk.state)
        return image(*given)

    monkeypatch.setattr(desk.studio, "image", long_frame)
    move(hands, ON_HEAD[0], kind="pointer_down")
    hands.frame()
    assert desk.state is start
    hands.frame()
    last = desk.state
    move(hands, ON_HEAD[0] - 0.3 * 299, kind="pointer_up")
    hands.settled()
    assert desk.state is last and len(frames) < 30
    desk.history.undo()
    assert desk.state is start and not desk.history.can_undo
    slowly(hands)
    assert desk.state.scene.camera.position == pytest.approx(last.scene.camera.position, abs=1e-6)


def slowly(hands: Hands) -> None:
    """The same drag in a few frames."""
    move(hands, ON_HEAD[0], kind="pointer_down")
    for k in (100, 200, 299):
        move(hands, ON_HEAD[0] - 0.3 * k)
        hands.frame()
    move(hands, ON_HEAD[0] - 0.3 * 299, kind="pointer_up")
    hands.frame()
