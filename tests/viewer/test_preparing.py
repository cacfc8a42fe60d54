"""Preparation of another head in a thread: the last picture stays while everything else continues."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from offscreen_input import InputDriver
from rigged_head import write_rigged_head

from dermis.apps.viewer.session import Session
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.view_renderer import ViewRenderer
from dermis.base.errors import DermisError
from dermis.scene.heads import load_head

pytestmark = pytest.mark.usefixtures("separate_devices")  # some tests destroy them

PICTURE = np.s_[:380, 205:]  # neither the panel nor the messages


@pytest.fixture
def other(tmp_path: Path) -> Any:
    """Return a new head, so that nothing of it is cached."""
    return load_head(write_rigged_head(tmp_path / "rigged.glb"))


@pytest.fixture
def gate(driver: InputDriver, monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """Return an event that lets the preparation of heads continue."""
    one, usual = threading.Event(), ViewRenderer.prepare

    def slowly(view_renderer: ViewRenderer, *given: Any) -> None:
        assert one.wait(20.0)
        usual(view_renderer, *given)

    monkeypatch.setattr(ViewRenderer, "prepare", slowly)
    driver.patient = False
    yield one
    one.set()
    driver.patient = True
    driver.frame()


def show(session: Session, head: Any) -> ViewerState:
    session.change(session.state.with_head(head, {"name": "other"}, 0.18))
    return session.state


def test_the_last_picture_stays_until_a_head_is_prepared(
    driver: InputDriver, gate: threading.Event, other: Any, tmp_path: Path
) -> None:
    before, session = driver.settled(), driver.viewer.session
    state = show(session, other)
    for _ in range(3):
        waiting = driver.frame()
        assert np.array_equal(waiting[PICTURE], before[PICTURE]) and not driver.viewer.is_still
    assert session.status == "preparing the head ..."
    with pytest.raises(DermisError, match="being prepared"):
        session.screenshot(tmp_path / "picture.png", (32, 32))
    driver.event("key_down", key="?")  # the panel goes on
    driver.frame()
    assert (driver.frame()[PICTURE] != before[PICTURE]).any(axis=-1).mean() > 0.2
    driver.event("key_up", key="?")
    driver.event("key_down", key="Escape")
    driver.patient = True
    gate.set()
    after = driver.settled()
    assert session.status != "preparing the head ..." and session.state is state
    assert (after[PICTURE] != before[PICTURE]).any(axis=-1).mean() > 0.2
    session.history.undo()
    assert np.array_equal(driver.settled()[PICTURE], before[PICTURE])


def test_undo_during_preparation_shows_the_previous_head(
    driver: InputDriver, gate: threading.Event, other: Any
) -> None:
    before, session = driver.settled(), driver.viewer.session
    show(session, other)
    driver.frame()
    session.history.undo()
    driver.frame()
    driver.patient = True
    gate.set()
    assert np.array_equal(driver.settled()[PICTURE], before[PICTURE])


def test_failed_preparation_is_reported_and_undoable(
    driver: InputDriver, other: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, session = driver.settled(), driver.viewer.session

    def fail(*_: Any) -> None:
        raise DermisError("head.obj: expected a head, but it is a hat.")

    monkeypatch.setattr(session.view_renderer.renderer, "prepare", fail)
    show(session, other)
    assert np.array_equal(driver.settled()[PICTURE], before[PICTURE])
    assert "it is a hat" in session.message and not session.view_renderer.is_preparing
    monkeypatch.undo()
    session.history.undo()
    assert np.array_equal(driver.settled()[PICTURE], before[PICTURE])


def test_device_lost_during_preparation_is_recreated(
    driver: InputDriver, gate: threading.Event, other: Any
) -> None:
    driver.settled()
    session = driver.viewer.session
    lost = session.view_renderer
    state = show(session, other)
    driver.frame()
    lost.renderer.device.handle.destroy()
    driver.event("pointer_move", x=300.0, y=240.0, button=0, buttons=())
    driver.frame()
    driver.patient = True
    gate.set()
    assert driver.settled()[PICTURE].max() > 50
    assert session.view_renderer is not lost and session.state is state and driver.viewer.failure is None
