"""Plots of the panel: stage times and the profile."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from offscreen_input import InputDriver

from dermis.apps.viewer.panel.sections import stage_times_by_name
from dermis.apps.viewer.panel.skin import _CHANNEL_COLOURS

PANEL = np.s_[:, :190]


def count_of(image: NDArray[np.uint8], colour: tuple[float, float, float]) -> int:
    """Return the number of pixels of the panel with nearly the given colour."""
    off = np.abs(image[PANEL].astype(float) - 255.0 * np.array(colour)).max(axis=-1)
    return int((off < 12.0).sum())


def test_stages_without_time_in_a_frame_are_empty() -> None:
    found = stage_times_by_name([{"shade": 2.0, "total": 2.0}, {"blur": 1.0, "shade": 3.0, "total": 4.0}])
    assert {name: values.tolist() for name, values in found.items()} == {"shade": [2, 3], "blur": [0, 1]}


def test_recent_frame_times_are_kept(driver: InputDriver) -> None:
    times, session = driver.viewer.session.view_renderer.stage_times, driver.viewer.session
    for k in range(130):
        times.append({"shade": float(k)})
    assert len(times) == 120
    session.change(session.state.with_settings(exposure=1.5))
    driver.frame()
    assert len(times) == 120 and session.view_renderer.rendered is not None
    assert times[-1] == (session.view_renderer.rendered.gpu_ms or {})


def test_profile_graph_has_three_colours_and_updates(driver: InputDriver) -> None:
    wide = driver.settled()
    for colour in _CHANNEL_COLOURS:
        assert count_of(wide, colour) > 15
    driver.viewer.session.change(driver.viewer.session.state.with_skin(profile="dark"))
    assert np.abs(driver.settled()[PANEL].astype(int) - wide[PANEL]).max() > 50


def test_time_graph_shows_numbers(driver: InputDriver) -> None:
    for title in ("View", "Profile", "Surface"):
        driver.press(title)
    closed = driver.settled()
    driver.press("Timing")
    driver.event("pointer_move", x=390.0, y=5.0, button=0, buttons=())
    shown = driver.settled()
    coloured = np.ptp(shown[PANEL].astype(int), axis=-1) > 40
    assert coloured.sum() > 300 > (np.ptp(closed[PANEL].astype(int), axis=-1) > 40).sum()
    for title in ("Timing", "Surface", "Profile", "View"):
        driver.press(title)
