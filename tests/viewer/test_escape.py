"""The key Escape: it closes the topmost open element and clears the search."""

from __future__ import annotations

import numpy as np
from offscreen_input import InputDriver

from dermis.apps.viewer.state import ViewerState


def escape(driver: InputDriver) -> None:
    for kind in ("key_down", "key_up"):
        driver.event(kind, key="Escape")


def test_escape_closes_a_list_without_a_choice(driver: InputDriver) -> None:
    session = driver.viewer.session
    closed, before = driver.settled(), session.state
    driver.press("profile")
    assert (driver.settled() != closed).mean() > 0.05
    escape(driver)
    assert np.array_equal(driver.settled()[:, 205:], closed[:, 205:]) and session.state is before
    driver.drag((300.0, 200.0), (260.0, 200.0))  # the picture has the pointer again
    assert session.state.scene.camera != before.scene.camera


def test_escape_hides_the_help_before_it_clears_the_search(driver: InputDriver) -> None:
    session, panel = driver.viewer.session, driver.viewer.panel
    session.search = "jaw"
    driver.event("key_down", key="?")
    driver.frame()
    assert panel.shows_help
    for help_is_shown, search in ((False, "jaw"), (False, "")):
        escape(driver)
        driver.frame()
        assert (panel.shows_help, session.search) == (help_is_shown, search)


def test_escape_clears_the_focused_search(rigged: ViewerState, driver: InputDriver) -> None:
    session = driver.viewer.session
    session.change(rigged)
    driver.press("search")
    driver.event("char", data="jaw")
    driver.frame()
    assert session.search == "jaw"
    escape(driver)
    driver.frame()
    assert session.search == ""
