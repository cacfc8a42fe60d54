"""A narrow window, in which the panel is a drawer over the full-width picture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from chromium_input import CHROMIUM, differs_from, pixels, still, touch, visited, wait
from offscreen_input import InputDriver

PHONE = (360, 640)


@pytest.fixture
def phone(driver: InputDriver) -> Iterator[InputDriver]:
    driver.canvas.set_logical_size(*PHONE)
    driver.frame()
    yield driver
    driver.viewer.panel.is_drawer_open = False
    driver.canvas.set_logical_size(400, 480)


def test_closed_drawer_does_not_cover_the_head(phone: InputDriver) -> None:
    shown = phone.settled().astype(int)
    sides = shown[150:450, :180].mean(), shown[150:450, 180:].mean()
    lit = np.flatnonzero(shown[320].max(axis=-1) > 40)
    assert min(sides) > 10.0 and abs(lit.mean() - 180.0) < 6.0
    assert (shown[120:500, :20] < 6).all()  # no panel


def test_open_drawer_covers_the_picture_and_receives_input(phone: InputDriver) -> None:
    session, panel = phone.viewer.session, phone.viewer.panel
    closed, camera = phone.settled(), session.state.scene.camera
    phone.press("panel")
    opened = phone.settled()
    assert panel.is_drawer_open and panel.is_visible and session.view_size == PHONE
    assert (opened[:, 320:] == closed[:, 320:]).all() and (opened[:, :300] != closed[:, :300]).any()
    x, y = phone.position("mix")
    phone.drag((x, y), (x + 300.0, y))
    assert session.state.scene.skin.mix == 1.0 and session.state.scene.camera == camera
    phone.drag((340.0, 300.0), (330.0, 330.0))
    assert session.state.scene.camera != camera
    phone.press("hide")
    assert not panel.is_drawer_open and panel.is_visible


@pytest.mark.parametrize(
    ("size", "drawer"),
    [((360, 640), True), ((430, 800), True), ((360, 300), True), ((640, 360), False), ((400, 480), False)],
)
def test_narrow_screens_use_a_drawer_and_wide_ones_a_panel(size: tuple[int, int], drawer: bool) -> None:
    from dermis.apps.viewer.panel.panel import is_drawer

    assert is_drawer(size) is drawer


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_touch_input_orbits_the_head_and_opens_the_drawer(browser: Any, shown: Any) -> None:
    session, panel = shown.session, shown.panel
    view = {"width": PHONE[0], "height": PHONE[1]}
    with visited(browser, shown.url, viewport=view, has_touch=True) as page:
        assert wait(page, lambda: session.view_size == PHONE and "panel" in session.positions)
        before = still(page, lambda image: bool(image[280:360, 150:210].mean() > 15.0))
        first = session.state.scene.camera
        touch(page, [(100, 320)], [(130, 320)], [(180, 330)])  # where a panel would be
        still(page, differs_from(before))
        turned = session.state.scene.camera
        assert turned != first and turned.frame_mm == first.frame_mm
        touch(page, [(150, 300)], *([(150, 300 - 10 * k), (210, 340 + 10 * k)] for k in range(4)))
        assert wait(page, lambda: session.state.scene.camera.frame_mm < 0.9 * turned.frame_mm)
        page.touchscreen.tap(*session.positions["panel"])
        assert wait(page, lambda: panel.is_drawer_open)
        assert session.view_size == PHONE and wait(page, lambda: pixels(page)[300, 5].max() > 15)
