"""The socket of the page with a slow, a hostile and a second client, and with a lost device."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_input import SETTINGS
from page_client import PATIENCE_S, SIZE, Page, difference, visit
from served_viewer import served

from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.state import ViewerState
from dermis.mesh.head import Head
from dermis.scene.model import Scene

pytest.importorskip("imgui_bundle", reason="the extra `viewer` is not installed")
pytest.importorskip("websockets", reason="the extra `viewer` is not installed")

pytestmark = pytest.mark.usefixtures("separate_devices")  # some tests destroy them

_AT_ONCE = 2  # frames on the way to a page


@pytest.fixture(scope="module")
def viewer(head: Head) -> Iterator[Any]:
    with served(ViewerState(Scene(head), SETTINGS), SIZE) as one:
        yield one


def test_stalled_page_gets_two_frames_and_then_the_newest(viewer: Any) -> None:
    with visit(viewer) as socket:
        page = Page(socket)
        page.show()
        before = page.still()
        sent = page.frames[-1][0]
        page.drag(300, 220)
        page.hear(1.5)
        assert len(page.frames) <= _AT_ONCE  # of 30 moves
        page.confirm(sent + len(page.frames))
        after = page.still()
        assert difference(before, after) > 0.5
    with visit(viewer) as socket:
        other = Page(socket)
        other.show()
        assert difference(after, other.still()) < 0.01


def test_false_confirmations_do_not_release_more_frames(viewer: Any) -> None:
    with visit(viewer) as socket:
        page = Page(socket)
        page.show()
        page.still()
        page.confirm(10**9)
        page.drag(300, 240)
        page.hear(1.5)
        assert len(page.frames) <= _AT_ONCE


def test_lossless_frame_does_not_delay_others(viewer: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from dermis.apps.viewer.browser import canvas

    begun, gate, encode_image = threading.Event(), threading.Event(), canvas.encode_image

    def slowly(array: NDArray[np.uint8], *, is_lossless: bool) -> bytes:
        if is_lossless:
            begun.set()
            gate.wait(PATIENCE_S)
        return encode_image(array, is_lossless=is_lossless)

    with visit(viewer) as socket:
        page = Page(socket)
        page.show()
        page.still()
        monkeypatch.setattr(canvas, "encode_image", slowly)
        page.drag(300, 260)
        page.wait(begun.is_set, confirming=True)
        page.drag(260, 300)
        page.wait(lambda: page.frames, confirming=True)
        assert {kind for _, kind, _ in page.frames} == {"image/jpeg"}
        gate.set()
        page.still()
        assert [kind for _, kind, _ in page.frames].count("image/png") == 1


def test_frames_are_not_compressed_a_second_time(viewer: Any) -> None:
    with visit(viewer) as socket:
        assert socket.protocol.extensions == []


def test_busy_page_gets_the_still_picture_when_ready(viewer: Any) -> None:
    with visit(viewer) as socket:
        page = Page(socket)
        page.show()
        page.still()
        page.drag(300, 270)
        page.hear()
        page.wait(lambda: page.frames)
        confirmed, kind = page.frames[0][0], "image/jpeg"
        while kind == "image/jpeg":  # always one too few, so that the last frame fills what a page may get
            page.frames.clear()
            page.confirm(confirmed)
            confirmed += 1
            page.wait(lambda: page.frames, 0.2)
            kind = page.frames[-1][1]


def test_watcher_takes_over_with_its_size(viewer: Any) -> None:
    first = visit(viewer).__enter__()
    page = Page(first)
    page.show()
    page.still()
    with visit(viewer) as second:
        watcher = Page(second)
        watcher.show((320, 200))
        assert watcher.still().shape == (*SIZE[::-1], 3) and watcher.active is False
        first.close()
        watcher.wait(lambda: watcher.active, confirming=True)
        watcher.show((320, 200))
        assert watcher.still().shape == (200, 320, 3)


def test_a_motion_plays_in_the_page_until_a_key_pauses_it(
    viewer: Any, rigged: ViewerState, rigged_file: Path
) -> None:
    session = viewer.session
    with visit(viewer) as socket:
        page = Page(socket)
        page.show()
        page.still()
        session.change(rigged)
        session.player.open(MotionFile(rigged_file))
        session.player.stop()
        page.drag(300, 299)
        before = page.still()
        page.frames.clear()
        page.tell("key_down", key=" ", modifiers=[])
        page.wait(lambda: session.player.seconds > 0.2, 0.005, confirming=True)
        assert {kind for _, kind, _ in page.frames} == {"image/jpeg"}
        page.tell("key_down", key=" ", modifiers=[])
        after = page.still()
        assert not session.player.is_playing and difference(before, after) > 0.2
        while session.history.can_undo:
            session.history.undo()


def test_lost_device_is_reported_in_the_page_and_recovered(viewer: Any) -> None:
    with visit(viewer) as socket:
        page = Page(socket)
        page.show()
        before = page.still()
        viewer.session.view_renderer.renderer.device.handle.destroy()
        page.drag(300, 330)
        after = page.still()
        assert "lost and has been reopened" in viewer.session.message and viewer.failure is None
        assert difference(before, after) > 0.5
        lines = np.s_[255:, 205:]  # where messages are
        assert np.abs(after[lines] - before[lines]).max() > 100
