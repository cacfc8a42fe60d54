"""The viewer in a notebook: the widget of rendercanvas, with the messages of a page."""

from __future__ import annotations

import asyncio
import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_input import ADAPTER

import dermis
from dermis.apps.viewer.state import ViewerState, make_state
from dermis.apps.viewer.windows import view
from dermis.mesh.head import Head
from dermis.scene.camera import camera_preset
from dermis.scene.model import Scene
from dermis.scene.people import skin_of

pytest.importorskip("anywidget", reason="the extra `notebook` is not installed")
pytest.importorskip("imgui_bundle", reason="the extra `viewer` is not installed")

SIZE = (480, 200)


class Page:
    """Client with the protocol of the notebook page: it sends size and events, and confirms frames."""

    def __init__(self, widget: Any) -> None:
        self.canvas, self.frames, self.sent = widget, [], 0
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
        """Return the last frame, when no more arrive."""
        for _ in range(100):
            count = len(self.frames)
            await asyncio.sleep(0.5)
            if self.frames and len(self.frames) == count:
                return np.asarray(self.frames[-1], np.int64)
        raise AssertionError("the widget does not come to rest")


def test_widget_shows_the_head_and_drag_orbits_it(state: ViewerState) -> None:
    async def visit() -> None:
        widget = view(state, ADAPTER, SIZE)
        assert "application/vnd.jupyter.widget-view+json" in str(widget._repr_mimebundle_())
        page = Page(widget)
        page.open()
        before = await page.still()
        assert before.shape == (*SIZE[::-1], 3) and before[80:120, 345:375].mean() > 20.0
        button = {"button": 1, "buttons": [1], "modifiers": []}
        page.tell("pointer_down", x=360.0, y=100.0, **button)
        page.tell("pointer_move", x=320.0, y=100.0, **button)
        page.tell("pointer_up", x=320.0, y=100.0, **button)
        after = await page.still()
        assert np.abs(after[:150, 245:] - before[:150, 245:]).mean() > 0.5

    asyncio.run(visit())


def test_widget_is_closed_once(head_file: Path) -> None:
    widget = view(str(head_file), ADAPTER, SIZE)
    widget.close()
    assert widget.get_closed()


def test_heads_people_and_scenes_are_shown(head: Head) -> None:
    scene = Scene(head, lights=(), camera=camera_preset("profile", head))
    assert dermis.view(scene, ADAPTER, SIZE).viewer.session.state.scene is scene
    assert dermis.view(head, ADAPTER, SIZE).viewer.session.state.scene.head is head
    person = dermis.Human(age=60)
    assert make_state(person).scene.skin == skin_of(person)


def test_other_subjects_are_refused_by_name() -> None:
    with pytest.raises(dermis.DermisError, match=r"a head, a person, a scene or a name, but got a list"):
        dermis.view([1, 2])  # type: ignore[arg-type]


def test_old_keyword_of_the_subject_warns() -> None:
    with pytest.warns(DeprecationWarning, match="subject"), pytest.raises(dermis.DermisError):
        dermis.view(shown=[1, 2])  # type: ignore[call-arg]


def test_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(dermis.DermisError, match=r'pip install "dermis\[notebook\]"'):
        dermis.view()
