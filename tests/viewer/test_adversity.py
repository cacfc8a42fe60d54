"""Windows that change size or have none, lost devices, and input faster than frames."""

from __future__ import annotations

import gc
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import wgpu
from offscreen_input import InputDriver

from dermis.apps.viewer.state import ATLAS_VIEW_NAME
from dermis.apps.viewer.windows import _raise_viewer_failure
from dermis.base.errors import DermisError
from dermis.frame import renderer as renderer_module
from dermis.gpu import Device
from dermis.gpu.memory import allocated_bytes

pytestmark = pytest.mark.usefixtures("separate_devices")  # some tests destroy them

SIZE, ON_HEAD = (400, 480), (300.0, 240.0)
PICTURE = slice(0, 380), slice(205, 400)  # neither the panel nor the text at the lower edge
FEW_BYTES = 1.02  # of what was held: a picture of another size may have taken the place of a small one


@pytest.fixture(autouse=True)
def steady(monkeypatch: pytest.MonkeyPatch) -> None:
    """Disable adaptive quality, so that pictures in motion are equal on fast and on busy machines."""
    monkeypatch.setattr(
        "dermis.apps.viewer.view_renderer.QualityController.record_frame_time", lambda *_: None
    )


def resized(driver: InputDriver, width: int, height: int) -> None:
    """Resize the canvas as a window does, before anything is drawn."""
    driver.canvas._size_info.set_physical_size(width, height, 1.0)


def move(driver: InputDriver, x: float, y: float = ON_HEAD[1], kind: str = "pointer_move") -> None:
    driver.event(kind, x=x, y=y, button=1, buttons=(1,))


def lose_device(driver: InputDriver) -> Any:
    view_renderer = driver.viewer.session.view_renderer
    view_renderer.renderer.device.handle.destroy()
    return view_renderer


def test_many_resizes_restore_picture_and_memory(driver: InputDriver) -> None:
    before = driver.settled()
    for width, height in ((300, 200), SIZE):  # both sizes of everything have been there
        resized(driver, width, height)
        driver.settled()
    held, chance = allocated_bytes(), random.Random(5)
    move(driver, ON_HEAD[0], kind="pointer_down")
    for _ in range(20):
        for _ in range(chance.randrange(3)):  # some sizes are never drawn
            resized(driver, chance.randrange(500), chance.randrange(500))
        move(driver, chance.uniform(200.0, 400.0))
        driver.frame(chance.uniform(0.0, 0.4))
    resized(driver, *SIZE)
    move(driver, ON_HEAD[0], kind="pointer_up")
    driver.frame()  # the release is part of the drag
    while driver.viewer.session.history.can_undo:
        driver.viewer.session.history.undo()
    driver.settled()
    resized(driver, 300, 200)
    driver.settled()
    resized(driver, *SIZE)
    assert np.array_equal(driver.settled()[PICTURE], before[PICTURE])
    gc.collect()
    assert allocated_bytes() <= FEW_BYTES * held


@pytest.mark.parametrize("how", ["picture", "split", ATLAS_VIEW_NAME, "normals"])
def test_restored_window_continues(driver: InputDriver, how: str) -> None:
    session = driver.viewer.session
    if how == "split":
        session.split.freeze(session.state)
        session.change(session.state.with_skin(mix=0.0))
    else:
        session.change(session.state.with_view(how))
    before = driver.settled()
    move(driver, ON_HEAD[0], kind="pointer_down")
    for size in ((0, 0), (0, 300), (1, 1), (290, 2)):
        resized(driver, *size)
        driver.frame()
        driver.settled()
    resized(driver, *SIZE)
    move(driver, ON_HEAD[0], kind="pointer_up")
    assert np.array_equal(driver.settled(), before)


@pytest.mark.parametrize("how", ["split", ATLAS_VIEW_NAME, "minimised"])
def test_device_lost_during_a_drag_is_recreated(make_driver: Callable[[], InputDriver], how: str) -> None:
    driver = make_driver()
    session = driver.viewer.session
    if how == "split":
        session.split.freeze(session.state)
        session.split.divider_position = 0.2  # away from the hand
        session.change(session.state.with_skin(mix=0.0))
    elif how == ATLAS_VIEW_NAME:
        session.change(session.state.with_view(ATLAS_VIEW_NAME))
    driver.settled()
    move(driver, ON_HEAD[0], kind="pointer_down")
    move(driver, ON_HEAD[0] - 20.0)
    driver.frame()
    lost = lose_device(driver)
    if how == "minimised":
        resized(driver, 0, 0)
    move(driver, ON_HEAD[0] - 40.0)
    driver.frame()
    driver.frame()
    resized(driver, *SIZE)
    move(driver, ON_HEAD[0] - 60.0)
    move(driver, ON_HEAD[0] - 60.0, kind="pointer_up")
    after = driver.settled()
    assert session.view_renderer is not lost and driver.viewer.failure is None
    same = make_driver()
    copy = same.viewer.session
    copy.split.frozen_state, copy.split.divider_position = (
        session.split.frozen_state,
        session.split.divider_position,
    )
    copy.change(session.state)
    same.event("pointer_move", x=ON_HEAD[0] - 60.0, y=ON_HEAD[1], button=0, buttons=())
    found = same.settled()
    np.testing.assert_array_equal(found[PICTURE], after[PICTURE])


def test_repeated_device_losses_leak_no_memory(
    make_driver: Callable[[], InputDriver],
) -> None:
    driver = make_driver()
    before = driver.settled()
    gc.collect()
    held = allocated_bytes()
    for k in range(3):
        lose_device(driver)
        driver.viewer.session.change(driver.viewer.session.state.with_skin(mix=0.1 * k))
        driver.frame()
        driver.settled()
    while driver.viewer.session.history.can_undo:
        driver.viewer.session.history.undo()
    assert np.array_equal(driver.settled()[PICTURE], before[PICTURE])
    gc.collect()
    assert allocated_bytes() <= FEW_BYTES * held


def test_permanently_lost_device_closes_the_window(
    make_driver: Callable[[], InputDriver], monkeypatch: pytest.MonkeyPatch
) -> None:
    driver = make_driver()
    driver.settled()

    def fail(*_: Any) -> Any:
        raise wgpu.GPUError("lost")

    monkeypatch.setattr("dermis.apps.viewer.view_renderer.ViewRenderer.render_images", fail)
    for _ in range(6):
        if not driver.canvas.get_closed():
            driver.viewer.draw()
    assert driver.canvas.get_closed() and "lost" in str(driver.viewer.failure)


@pytest.mark.parametrize("how", ["twice", "never again"])
def test_unavailable_device_closes_the_window_with_a_message(
    make_driver: Callable[[], InputDriver], monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    driver = make_driver()
    driver.settled()
    lose_device(driver)
    opened = renderer_module.open_device

    def opening(adapter: str) -> Device:
        if how == "never again":
            raise DermisError(f"adapter {adapter}: expected it to open, but it does not. Wait.")
        device = opened(adapter)
        lost.append(device)
        return device

    lost: list[Device] = []
    monkeypatch.setattr(renderer_module, "open_device", opening)
    driver.viewer.session.change(driver.viewer.session.state.with_skin(mix=0.4))
    driver.viewer.draw()
    for device in lost:
        device.handle.destroy()
        driver.viewer.draw()
    assert driver.canvas.get_closed()
    said = "lost twice" if how == "twice" else "expected it to open"
    with pytest.raises(DermisError, match=said):
        _raise_viewer_failure(driver.viewer)


def test_state_over_the_memory_limit_keeps_the_last_picture(
    driver: InputDriver, monkeypatch: pytest.MonkeyPatch
) -> None:
    """This is not a lost device: another device would have no more memory."""
    before, session = driver.settled(), driver.viewer.session
    view_renderer = session.view_renderer

    def fail(*_: Any, **__: Any) -> Any:
        raise wgpu.GPUOutOfMemoryError("Out of memory")

    with monkeypatch.context() as patch:
        patch.setattr("dermis.frame.renderer.Renderer._submit", fail)
        session.change(session.state.with_skin(mix=0.4))
        after = driver.settled()
    assert session.view_renderer is view_renderer and "memory" in session.message
    assert np.array_equal(after[:100, 205:], before[:100, 205:])


def test_input_during_a_frame_applies_to_the_next_one(
    driver: InputDriver, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All input of the frame is processed at once and is one step of the history."""
    driver.settled()
    session = driver.viewer.session
    start, image, frames = session.state, session.view_renderer.render_image, []

    def long_frame(*given: Any) -> Any:
        if not frames:
            for k in range(300):
                move(driver, ON_HEAD[0] - 0.3 * k)
        frames.append(session.state)
        return image(*given)

    monkeypatch.setattr(session.view_renderer, "render_image", long_frame)
    move(driver, ON_HEAD[0], kind="pointer_down")
    driver.frame()
    assert session.state is start
    driver.frame()
    last = session.state
    move(driver, ON_HEAD[0] - 0.3 * 299, kind="pointer_up")
    driver.settled()
    assert session.state is last and len(frames) < 30
    session.history.undo()
    assert session.state is start and not session.history.can_undo
    slowly(driver)
    assert session.state.scene.camera.position == pytest.approx(last.scene.camera.position, abs=1e-6)


def slowly(driver: InputDriver) -> None:
    """Repeat the drag in a few frames."""
    move(driver, ON_HEAD[0], kind="pointer_down")
    for k in (100, 200, 299):
        move(driver, ON_HEAD[0] - 0.3 * k)
        driver.frame()
    move(driver, ON_HEAD[0] - 0.3 * 299, kind="pointer_up")
    driver.frame()
