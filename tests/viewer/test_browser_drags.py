"""Quick drags in a real browser: a slider ends where the pointer did, whatever frames were drawn."""

from __future__ import annotations

from typing import Any

import pytest
from chromium_input import CHROMIUM, visited, wait

pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
TIMES = 20


def test_the_same_quick_drag_ends_at_the_same_value(browser: Any, shown: Any) -> None:
    session, ends = shown.session, []
    with visited(browser, shown.url) as page:
        assert wait(page, lambda: "mix" in session.positions)
        x, y = session.positions["mix"]
        for _ in range(TIMES):
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(x + 30.0, y)
            page.mouse.move(x + 57.0, y)
            page.mouse.up()
            assert wait(page, lambda: session.history.can_undo and shown.is_still)
            ends.append(session.state.scene.skin.mix)
            session.history.undo()
            assert not session.history.can_undo
    assert len(set(ends)) == 1 and ends[0] > 0.5
