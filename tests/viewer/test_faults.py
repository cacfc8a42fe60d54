"""Unexpected errors end one frame, are reported once, and do not affect the next frame."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_input import InputDriver

from dermis.apps.viewer.session import Session

SIZE = 400, 480
PANEL, PICTURE = np.s_[:470, :195], np.s_[:380, 205:]  # without the messages at the lower edge


@pytest.fixture
def calm(shared_driver: InputDriver, caplog: pytest.LogCaptureFixture) -> Iterator[InputDriver]:
    """Yield the shared viewer without reported errors, and restore its list of errors afterwards."""
    session = shared_driver.viewer.session
    session._reported_errors.clear()
    session.message = ""
    shared_driver.event("pointer_move", x=300.0, y=240.0, button=0, buttons=())
    yield shared_driver
    shared_driver.canvas._size_info.set_physical_size(*SIZE, 1.0)
    while session.history.can_undo:
        session.history.undo()
    shared_driver.settled()


def unlike(a: NDArray[np.uint8], b: NDArray[np.uint8], part: Any) -> float:
    return float((a[part] != b[part]).mean())


@pytest.mark.parametrize("ratio", [1e-300, -1.0, float("nan"), float("inf"), 1e300])
def test_invalid_pixel_ratio_fails_only_its_frames(
    calm: InputDriver, ratio: float, caplog: pytest.LogCaptureFixture
) -> None:
    before = calm.settled()
    calm.canvas._size_info.set_physical_size(*SIZE, ratio)
    for kind in ("pointer_move", "pointer_down", "pointer_up"):
        calm.event(kind, x=300.0, y=240.0, button=1, buttons=(1,))
        calm.frame()
    calm.canvas._size_info.set_physical_size(*SIZE, 1.0)
    calm.event("pointer_leave")
    after = calm.settled()
    assert unlike(after, before, PANEL) < 0.002 and unlike(after, before, PICTURE) == 0.0
    told = [record.message for record in caplog.records]
    assert len(told) == len(set(told)) <= 2


def test_failing_section_does_not_affect_others(
    calm: InputDriver, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    from imgui_bundle import imgui

    from dermis.apps.viewer.panel.sections import SECTIONS

    def fail(session: Session) -> None:
        imgui.push_style_var(int(imgui.StyleVar_.alpha), 0.2)
        imgui.push_id("half")
        imgui.begin_child("open")
        imgui.begin_disabled(True)
        raise ZeroDivisionError("no\nnumber")

    before, session = calm.settled(), calm.viewer.session
    first, *others = SECTIONS
    monkeypatch.setattr("dermis.apps.viewer.panel.panel.SECTIONS", (first._replace(draw=fail), *others))
    session.positions.clear()
    for _ in range(3):
        calm.frame()
    assert "show" in session.positions and "upload a file" not in session.positions
    said = "Head cannot be drawn (ZeroDivisionError: no number)"
    assert session.message == said and [record.message for record in caplog.records] == [said]
    monkeypatch.undo()
    session.message = ""
    calm.event("pointer_leave")
    assert unlike(calm.settled(), before, PANEL) < 0.002


def test_undrawable_state_keeps_the_last_picture(
    calm: InputDriver, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    before, session = calm.settled(), calm.viewer.session
    good, image = session.state, session.view_renderer.render_image

    def fail_for_others(state: Any, *given: Any) -> Any:
        return image(state, *given) if state is good else np.zeros(2).reshape(3)

    monkeypatch.setattr(session.view_renderer, "render_image", fail_for_others)
    session.change(session.state.with_skin(mix=0.1))
    assert unlike(calm.settled(), before, PICTURE) == 0.0
    assert "cannot reshape" in session.message and len(caplog.records) == 1
    session.history.undo()
    assert np.array_equal(calm.settled()[PICTURE], before[PICTURE])


def test_failed_frame_is_reported_and_the_next_one_drawn(
    calm: InputDriver, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = calm.settled()

    def fail(*_: Any) -> None:
        raise IndexError("patch")

    monkeypatch.setattr(calm.viewer._blit, "draw", fail)
    calm.frame()
    assert calm.viewer.session.message == "This frame cannot be drawn (IndexError: patch)"
    monkeypatch.undo()
    assert unlike(calm.settled(), before, PICTURE) == 0.0 and calm.viewer.failure is None


def test_failing_head_or_button_is_reported(calm: InputDriver, monkeypatch: pytest.MonkeyPatch) -> None:
    session = calm.viewer.session

    def fail(*_: Any) -> None:
        raise MemoryError("too large")

    monkeypatch.setattr(session.heads, "take_loaded_state", fail)
    calm.frame()
    assert session.message == "The head cannot be opened (MemoryError: too large)"
    monkeypatch.undo()
    monkeypatch.setattr(session, "save", fail)
    calm.event("key_down", key="s", modifiers=("Control",))
    calm.frame()
    assert session.message == "This cannot be done (MemoryError: too large)"
