"""The viewer on an offscreen canvas with events of pointer and keys."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_input import InputDriver

from dermis.scene.camera import camera_preset

ON_HEAD, TO_THE_LEFT = (300.0, 240.0), (230.0, 240.0)


def difference(a: NDArray[np.uint8], b: NDArray[np.uint8], rows: int = 440) -> float:
    """Return the mean difference over the part that neither the panel nor the text covers."""
    return float(np.abs(a[:rows, 205:].astype(int) - b[:rows, 205:].astype(int)).mean())


def middle(image: NDArray[np.uint8]) -> float:
    """Return the middle column of the pixels that are not black, in the rows without text."""
    columns = np.flatnonzero(image[60:400].max(axis=(0, 2)) > 20)
    return 0.5 * float(columns[0] + columns[-1])


def test_the_head_is_in_the_window_beside_the_panel(driver: InputDriver) -> None:
    image = driver.settled()
    assert image.shape == (480, 400, 3)
    assert image[200:280, 280:320].mean() > 20.0
    assert image[5:20, 380:395].mean() < 2.0


def test_drag_orbits_the_head_as_one_undo_step(driver: InputDriver) -> None:
    before = driver.settled()
    driver.drag(ON_HEAD, TO_THE_LEFT)
    after = driver.settled()
    assert difference(before, after) > 1.0
    driver.viewer.session.history.undo()
    driver.event("pointer_move", x=5.0, y=5.0, button=0, buttons=())
    assert difference(before, driver.settled()) == 0.0
    assert not driver.viewer.session.history.can_undo


def test_shift_drag_moves_the_light_and_not_the_camera(driver: InputDriver) -> None:
    before, state = driver.settled(), driver.viewer.session.state
    driver.drag(ON_HEAD, TO_THE_LEFT, modifiers=("Shift",))
    after = driver.viewer.session.state
    assert after.scene.camera == state.scene.camera
    assert after.scene.lights[0] != state.scene.lights[0] and after.scene.lights[1] == state.scene.lights[1]
    assert difference(before, driver.settled()) > 0.5


def test_wheel_zooms_and_double_click_sets_the_pivot(driver: InputDriver) -> None:
    camera = driver.viewer.session.state.scene.camera
    driver.event("wheel", x=300.0, y=240.0, dx=0.0, dy=-200.0)
    driver.settled()
    near = driver.viewer.session.state.scene.camera
    assert near.frame_mm < 0.9 * camera.frame_mm
    driver.event("double_click", x=230.0, y=200.0)
    driver.settled()
    assert driver.viewer.session.state.scene.camera.target != near.target


def test_pinch_zooms_in(driver: InputDriver) -> None:
    camera = driver.viewer.session.state.scene.camera
    driver.event("pointer_down", x=300.0, y=240.0, button=1, buttons=(1,))
    driver.frame()
    for gap in (20.0, 40.0, 80.0):
        touches = {"0": {"x": 300.0, "y": 240.0 - gap / 2}, "1": {"x": 300.0, "y": 240.0 + gap / 2}}
        driver.event("pointer_move", x=300.0, y=240.0, button=1, buttons=(1,), ntouches=2, touches=touches)
        driver.frame()
    driver.event("pointer_up", x=300.0, y=240.0, button=1, buttons=())
    driver.frame()
    assert driver.viewer.session.state.scene.camera.frame_mm == pytest.approx(camera.frame_mm / 4.0)


def test_keys_select_presets_undo_and_the_panel(driver: InputDriver) -> None:
    session = driver.viewer.session
    start, plain = session.state, driver.settled()
    driver.event("key_down", key="3")
    driver.frame()
    assert session.state.scene.camera == camera_preset("profile", session.state.scene.head)
    driver.event("key_down", key="z", modifiers=("Control",))
    driver.frame()
    assert session.state is start
    driver.event("key_down", key="y", modifiers=("Control",))
    driver.frame()
    assert session.state is not start
    driver.event("key_down", key="z", modifiers=("Control",))
    driver.event("key_down", key="Tab")
    bare = driver.settled()
    assert np.abs(bare[:440, :190].astype(int) - plain[:440, :190].astype(int)).mean() > 5.0
    assert middle(bare) == pytest.approx(200.0, abs=4.0) and middle(plain[:, 200:]) == pytest.approx(
        100.0, abs=4.0
    )


def test_slider_changes_the_picture_as_one_undo_step(driver: InputDriver) -> None:
    before = driver.settled()
    x, y = driver.position("roughness")
    driver.drag((x, y), (x + 40.0, y))
    assert driver.viewer.session.state.scene.skin.roughness > 0.3
    assert difference(before, driver.settled()) > 0.05
    driver.viewer.session.history.undo()
    assert not driver.viewer.session.history.can_undo


def test_drop_down_changes_the_picture(driver: InputDriver) -> None:
    before = driver.settled()
    driver.choose("show", "normals")
    assert driver.viewer.session.state.view == "normals"
    assert difference(before, driver.settled()) > 10.0


def test_drag_started_on_the_panel_does_not_orbit(driver: InputDriver) -> None:
    camera = driver.viewer.session.state.scene.camera
    x, y = driver.position("mix")
    driver.drag((x, y), (380.0, 150.0))
    assert driver.viewer.session.state.scene.camera == camera


def test_touch_on_the_head_after_the_panel_orbits_it(driver: InputDriver) -> None:
    """No frame is drawn in between in which the panel could notice that the pointer left."""
    camera = driver.viewer.session.state.scene.camera
    driver.click((150.0, 243.0))  # a label
    driver.event("pointer_down", x=300.0, y=240.0, button=1, buttons=(1,))
    driver.event("pointer_move", x=260.0, y=240.0, button=1, buttons=(1,))
    driver.event("pointer_up", x=260.0, y=240.0, button=1, buttons=())
    driver.frame()
    assert driver.viewer.session.state.scene.camera != camera


def test_melanin_darkens_the_skin(driver: InputDriver) -> None:
    session = driver.viewer.session
    session.change(session.state.with_skin(profile="light", albedo="profile"))
    light = driver.settled()
    session.change(session.state.with_pigments(melanin=0.4))
    dark = driver.settled()
    assert dark[200:280, 210:240].mean() < 0.7 * light[200:280, 210:240].mean()


def test_invalid_state_is_reported_and_keeps_the_last_picture(driver: InputDriver) -> None:
    session = driver.viewer.session
    before = driver.settled()
    session.change(session.state.with_skin(profile="nothing.csv"))
    after = driver.frame()
    assert "nothing.csv" in session.message
    assert difference(before, after, rows=140) == 0.0
    assert driver.settled() is not None  # it is not tried again and again
    session.history.undo()
    assert difference(before, driver.settled()) == 0.0


def test_buttons_save_load_and_take_pictures(driver: InputDriver, tmp_path: Path) -> None:
    session = driver.viewer.session
    session.save(tmp_path / "scene.toml")
    saved = session.state
    session.change(session.state.with_skin(mix=0.9))
    session.load(tmp_path / "scene.toml")
    assert session.state.scene.skin == saved.scene.skin and session.state.scene.head is saved.scene.head
    session.screenshot(tmp_path / "a.png", (32, 32))
    assert (tmp_path / "a.png").stat().st_size > 100 and "a.png" in session.message


def test_window_may_be_resized_or_minimised(driver: InputDriver) -> None:
    driver.settled()
    driver.canvas.set_logical_size(200, 300)
    assert driver.settled().shape == (300, 200, 3)
    driver.canvas._size_info.set_physical_size(0, 0, 1.0)  # minimised
    driver.canvas.force_draw()
    driver.canvas.set_logical_size(400, 480)
    assert driver.settled().shape == (480, 400, 3)


@pytest.mark.usefixtures("separate_devices")
def test_lost_device_is_recreated(make_driver: Callable[[], InputDriver]) -> None:
    driver = make_driver()
    before = driver.settled()
    lost = driver.viewer.session.view_renderer
    lost.renderer.device.handle.destroy()
    driver.viewer.session.change(driver.viewer.session.state.with_skin(mix=0.4))
    driver.frame()
    assert driver.viewer.session.view_renderer is not lost and "lost" in driver.viewer.session.message
    driver.viewer.session.history.undo()
    assert difference(before, driver.settled(), rows=380) == 0.0
    assert np.abs(driver.frame()[30:440, :190].astype(int) - before[30:440, :190]).max() == 0  # not "redo"


def test_changes_leak_no_memory(driver: InputDriver) -> None:
    """Memory of the process, in which leaks of every frame would add up."""
    session = driver.viewer.session
    start = session.state
    for k in range(30):
        _change(driver, k)
    gc.collect()
    before = _resident_mb()
    for k in range(60):
        _change(driver, k)
    gc.collect()
    assert _resident_mb() - before < 8.0
    session.change(start)


def _change(driver: InputDriver, k: int) -> None:
    session = driver.viewer.session
    session.change(
        session.state.with_skin(mix=0.2 + 0.004 * (k % 100)).with_light(0, position=(k % 50, 500.0, 900.0))
    )
    driver.frame()


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6
