"""Quick drags in a real browser: a slider ends at the position of the release, whatever frames were drawn."""

from __future__ import annotations

import json
from typing import Any

import pytest
from chromium_input import CHROMIUM, visited, wait, wait_for_picture

pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
TIMES = 20
TALL = {"width": 700, "height": 640}
"""Window that shows the whole section of the surface."""


def is_done(shown: Any) -> bool:
    """Return whether a gesture has changed something, has ended, and is drawn."""
    history = shown.session.history
    return bool(history.can_undo and not history._gesture and shown.is_still)


def test_equal_quick_drags_end_at_equal_values(browser: Any, shown: Any) -> None:
    session, ends = shown.session, []
    with visited(browser, shown.url, viewport=TALL) as page:
        assert wait(page, lambda: "mix" in session.positions)
        x, y = session.positions["mix"]
        for _ in range(TIMES):
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(x + 30.0, y)
            page.mouse.move(x + 57.0, y)
            page.mouse.up()
            assert wait(page, lambda: is_done(shown))
            ends.append(session.state.scene.skin.mix)
            session.history.undo()
            assert not session.history.can_undo
    assert len(set(ends)) == 1 and ends[0] > 0.4


def test_lifted_finger_leaves_the_slider_value(browser: Any, shown: Any) -> None:
    session = shown.session
    with visited(browser, shown.url, viewport=TALL, has_touch=True) as page:
        assert wait(page, lambda: "mix" in session.positions and shown.is_still)
        x, y = session.positions["mix"]
        fingers = page.context.new_cdp_session(page)
        for kind, place in (("Start", x), ("Move", x + 30.0), ("Move", x + 57.0), ("Cancel", None)):
            points = [] if place is None else [{"x": place, "y": y, "id": 0}]
            fingers.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": points})
            page.wait_for_timeout(60)
        assert wait(page, lambda: is_done(shown))
        page.wait_for_timeout(300)
        assert session.state.scene.skin.mix > 0.4
        session.history.undo()
        assert not session.history.can_undo


_QUICKER_THAN_HANDS = """() => {
  const moments = [['pointerdown', 300, 1], ['pointermove', 310, 1], ['lostpointercapture', 310, 0]]
  for (const [type, x, buttons] of moments) {
    const place = { pointerId: 1, clientX: x, clientY: 300, button: 0, buttons, bubbles: true }
    document.querySelector('#canvas img').dispatchEvent(new PointerEvent(type, place))
  }
}"""


def test_no_drag_move_follows_its_release(browser: Any, shown: Any) -> None:
    told: list[dict[str, Any]] = []

    def listen(socket: Any) -> None:
        socket.on("framesent", lambda text: told.append(json.loads(text)))

    with visited(browser, shown.url) as page:
        page.on("websocket", listen)
        page.reload()
        wait_for_picture(page)
        page.mouse.move(300.0, 300.0)
        page.evaluate(_QUICKER_THAN_HANDS)
        page.wait_for_timeout(300)
    shown.session.history.undo()
    told = [event for event in told if event["type"][:7] == "pointer" and event.get("x", 0) > 0]
    held = [event["type"] for event in told if event["buttons"] or event["type"] == "pointer_up"]
    assert held == ["pointer_down", "pointer_move", "pointer_up"]
