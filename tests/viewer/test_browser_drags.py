"""Quick drags in a real browser: a slider ends where the pointer did, whatever frames were drawn."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from chromium_input import CHROMIUM, PATIENCE_S, visited
from offscreen_input import SETTINGS
from served_viewer import served

from dermis.mesh.head import Head
from dermis.scene.model import Scene
from dermis.viewer.state import ViewerState

pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
TIMES = 20


@pytest.fixture(scope="module")
def viewer(head: Head, head_file: Path) -> Iterator[Any]:
    with served(ViewerState(Scene(head), SETTINGS, {"name": str(head_file)}), (400, 480)) as one:
        yield one


def wait(page: Any, reached: Any) -> bool:
    """Whether something comes to be; the page goes on meanwhile."""
    end = time.monotonic() + PATIENCE_S
    while not reached() and time.monotonic() < end:
        page.wait_for_timeout(50)
    return bool(reached())


def test_the_same_quick_drag_ends_at_the_same_value(browser: Any, viewer: Any) -> None:
    session, ends = viewer.session, []
    with visited(browser, viewer.url) as page:
        assert wait(page, lambda: "mix" in session.positions)
        x, y = session.positions["mix"]
        for _ in range(TIMES):
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(x + 30.0, y)
            page.mouse.move(x + 57.0, y)
            page.mouse.up()
            assert wait(page, lambda: session.history.can_undo and viewer.is_still)
            ends.append(session.state.scene.skin.mix)
            session.history.undo()
            assert not session.history.can_undo
    assert len(set(ends)) == 1 and ends[0] > 0.5
