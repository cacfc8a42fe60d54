"""The pulse of the viewer follows the clock, and stays out of the undo history."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from offscreen_input import InputDriver

from dermis import Human, Pulse
from dermis.apps.viewer.heartbeat import Heartbeat
from dermis.apps.viewer.state import ViewerState, make_state


class Clock:
    now = 50.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture(scope="module")
def person() -> ViewerState:
    return make_state(Human().head(subdivide=0))


def test_the_pulse_follows_the_clock(person: ViewerState) -> None:
    clock = Clock()
    heartbeat, pulse = Heartbeat(clock), Pulse(rate_per_min=90)
    assert heartbeat.displayed(person) is person and not heartbeat.is_running(person)
    heartbeat.pulse = pulse
    clock.now += 0.4
    heartbeat.advance()
    shown = heartbeat.displayed(person)
    assert heartbeat.displayed(person) is shown  # so that no frame is rendered twice
    np.testing.assert_allclose(shown.scene.state.blood, pulse.at(0.4).blood, atol=1e-12)
    clock.now += 0.1
    heartbeat.advance()
    assert not np.allclose(heartbeat.displayed(person).scene.state.blood, shown.scene.state.blood)


def test_heads_without_painted_skin_have_no_pulse(rigged: ViewerState) -> None:
    heartbeat = Heartbeat(Clock())
    heartbeat.pulse = Pulse()
    assert heartbeat.displayed(rigged) is rigged and not heartbeat.is_running(rigged)


def test_the_panel_starts_the_pulse_and_sets_states(driver: InputDriver, person: ViewerState) -> None:
    session = driver.viewer.session
    bald = replace(person.scene.head, hair=None)
    session.change(replace(person, scene=replace(person.scene, head=bald), settings=session.state.settings))
    driver.frame()
    driver.press("Skin state")
    driver.frame()
    driver.press("pulse")
    driver.frame()
    assert session.heartbeat.pulse == Pulse() and session.is_playing and not driver.viewer.is_still
    shown, kept = session.displayed_state, session.state
    assert shown.scene.state is not None and kept.scene.state is None
    driver.press("blush##state")
    assert session.state.scene.state is not None and session.state.scene.state.blood is None
    driver.press("pulse")
    assert session.heartbeat.pulse is None and session.displayed_state is session.state
