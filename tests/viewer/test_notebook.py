"""The viewer in a notebook: rendercanvas' own widget, with messages as a page would send them."""

from __future__ import annotations

import asyncio
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_input import ADAPTER

from dermis.viewer.state import ViewerState
from dermis.viewer.windows import notebook_viewer

pytest.importorskip("anywidget", reason="the extra `notebook` is not installed")
pytest.importorskip("imgui_bundle", reason="the extra `viewer` is not installed")

SIZE = (320, 200)


class Page:
    """What the notebook's page does: it tells its size, sends events, shows frames and confirms them."""

    def __init__(self, viewer: Any) -> None:
        self.canvas, self.frames, self.sent = viewer.canvas, [], 0
        self.canvas.send = self._show

    def _show(self, message: dict[str, Any], buffers: list[bytes]) -> None:
        from PIL import Image

        self.frames.append(np.array(Image.open(io.BytesIO(buffers[0])).convert("RGB")))
        self.canvas._frame_feedback = {"index": message["index"], "timestamp": 0.0, "localtime": 0.0}

    def tell(self, kind: str, **fields: Any) -> None:
        self.canvas._rfb_handle_msg(self.canvas, {"type": kind, "timestamp": 0.0, **fields}, [])

    def open(self) -> None:
        width, height = SIZE
        self.tell("resize", width=width, height=height, pwidth=width, pheight=height, ratio=1.0)
        self.canvas._has_visible_views = True

    async def still(self) -> NDArray[np.int64]:
        """The last frame, when no more come."""
        for _ in range(100):
            count = len(self.frames)
            await asyncio.sleep(0.5)
            if self.frames and len(self.frames) == count:
                return np.asarray(self.frames[-1], np.int64)
        raise AssertionError("the widget does not come to rest")


def test_the_widget_shows_the_head_and_a_drag_turns_it(state: ViewerState) -> None:
    async def visit() -> None:
        viewer = notebook_viewer(state, ADAPTER, SIZE)
        assert "application/vnd.jupyter.widget-view+json" in str(viewer._repr_mimebundle_())
        page = Page(viewer)
        page.open()
        before = await page.still()
        assert before.shape == (*SIZE[::-1], 3) and before[80:120, 225:255].mean() > 20.0
        button = {"button": 1, "buttons": [1], "modifiers": []}
        page.tell("pointer_down", x=240.0, y=100.0, **button)
        page.tell("pointer_move", x=200.0, y=100.0, **button)
        page.tell("pointer_up", x=200.0, y=100.0, **button)
        after = await page.still()
        assert np.abs(after[:150, 165:] - before[:150, 165:]).mean() > 0.5

    asyncio.run(visit())


def test_a_closed_widget_is_closed_once(head_file: Path) -> None:
    viewer = notebook_viewer(str(head_file), ADAPTER, SIZE)
    viewer.canvas.close()
    assert viewer.canvas.get_closed()
