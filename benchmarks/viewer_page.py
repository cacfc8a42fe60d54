"""Measure `dermis view --browser` as a page sees it: frame rate and latency."""

from __future__ import annotations

import hashlib
import io
import json
import selectors
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count, islice
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from viewer_input import PIGMENTED, Clock, Plan, spread

from dermis.apps.viewer.browser.canvas import encode_image

_START_S = 120.0


@contextmanager
def served(plan: Plan, clock: Clock) -> Iterator[tuple[str, int]]:
    """Yield the URL of `dermis view --browser` and its process."""
    size = "x".join(map(str, plan.size))
    words = ["view", plan.head, "--browser", "--port", "0", "--size", size, "--atlas", str(plan.atlas)]
    words += ["--profile", PIGMENTED, "--samples", str(plan.samples), "--adapter", plan.adapter]
    words = [sys.executable, "-m", "dermis", *words]
    with (
        tempfile.TemporaryFile("w+", encoding="utf-8") as said,
        subprocess.Popen(words, stdout=subprocess.PIPE, stderr=said, text=True) as server,
    ):
        try:
            assert server.stdout is not None
            yield _address(server.stdout, min(_START_S, clock.remaining_s)), server.pid
        except Exception as fault:
            raise RuntimeError(
                f"{fault or type(fault).__name__}; dermis view: {_last_words(said)}"
            ) from fault
        finally:
            _stop_server(server)


def _address(output: IO[str], patience_s: float) -> str:
    """Return the URL of the page, which the server prints as its only output."""
    with selectors.DefaultSelector() as waiting:
        waiting.register(output, selectors.EVENT_READ)
        words = output.readline().split() if waiting.select(patience_s) else []
    if not words:
        raise RuntimeError("it tells no address")
    return words[0]


def _last_words(said: IO[str]) -> str:
    said.seek(0)
    lines = said.read().strip().splitlines()
    return lines[-1] if lines else "it said nothing"


def _stop_server(server: subprocess.Popen[str], patience_s: float = 10.0) -> None:
    server.terminate()
    try:
        server.wait(patience_s)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()


_QUIET_S, _PATIENCE_S = 0.6, 120.0
_MOVES_PER_S = 50.0  # maximum of rendercanvas' page
_WATCHED_S = 8.0
_FIRST_S = 30.0  # time limit for the first picture of a motion, whose data may have to be computed
_REPEATS = 20
_PIXELS = 6.0
Position = tuple[float, float]


@dataclass(frozen=True)
class Picture:
    """Received frame.

    at : time when its last byte was received [s]
    """

    kind: str
    data: bytes
    at: float

    @property
    def digest(self) -> bytes:
        """Return a hash that distinguishes pictures."""
        return hashlib.sha256(self.data).digest()


class Page:
    """Client with the protocol of the page of rendercanvas."""

    def __init__(self, url: str, size: tuple[int, int], clock: Clock) -> None:
        self._socket = _open_socket(url.replace("http", "ws", 1), clock)
        self.size, self.clock = size, clock
        self._last: Picture | None = None
        self.send("resize", width=size[0], height=size[1], pwidth=size[0], pheight=size[1], ratio=1.0)
        self.next_picture(self.patience_s)  # the panel exists from then on
        self.send("key_down", key="Tab", modifiers=[])  # hides the panel

    def send(self, kind: str, **fields: Any) -> None:
        """Send an event."""
        self._socket.send(json.dumps({"type": kind, "timestamp": time.time()} | fields))

    def pointer(self, kind: str, x: float, y: float, *modifiers: str) -> None:
        """Send an event of a pointer with its left button pressed."""
        state = {"button": 1, "buttons": [1], "modifiers": list(modifiers), "ntouches": 0, "touches": {}}
        self.send(kind, x=x, y=y, **state)

    def next_picture(self, timeout_s: float) -> Picture | None:
        """Return the next frame and confirm to the server that it has arrived; None after the timeout."""
        until = time.perf_counter() + timeout_s
        while (left := until - time.perf_counter()) > 0.0:
            try:
                message = self._socket.recv(timeout=left)
            except TimeoutError:
                return None
            header = json.loads(message)
            if header["type"] == "failure":
                raise RuntimeError(header["text"])
            if header["type"] == "framebufferdata":
                data = self._socket.recv(timeout=_PATIENCE_S)
                assert isinstance(data, bytes)
                found = Picture(header["mimetype"], data, time.perf_counter())
                self.send("_framefeedback", index=header["index"], timestamp=header["timestamp"])
                self._last = found
                return found
        return None

    def settle(self) -> Picture:
        """Return the final, lossless picture, after which none follows for a while."""
        first = time.perf_counter()
        while time.perf_counter() - first < self.patience_s:
            if self.next_picture(_QUIET_S) is None and self._last and self._last.kind == "image/png":
                return self._last
        kind = self._last.kind if self._last else "none"
        raise RuntimeError(f"the page does not come to rest: the last picture is {kind}")

    @property
    def picture_hash(self) -> bytes:
        """Return the hash of the last picture, empty before the first."""
        return self._last.digest if self._last else b""

    @property
    def patience_s(self) -> float:
        """Return the maximum waiting time [s]."""
        return min(_PATIENCE_S, self.clock.remaining_s)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


def _open_socket(url: str, clock: Clock) -> Any:
    """Return an open socket, which the caller closes."""
    from websockets.sync.client import connect

    while True:
        try:
            return connect(url, max_size=None, open_timeout=min(_PATIENCE_S, clock.remaining_s)).__enter__()
        except ConnectionRefusedError:
            if clock.over:
                raise
            time.sleep(0.1)


def page_figures(plan: Plan, slider: Position | None, clock: Clock) -> Iterator[tuple[str, Any]]:
    """Yield frame rates and latencies as seen by the page, including encoding and transfer of pictures.

    slider : position of the melanin slider in the panel, if it is visible
    """
    with served(plan, clock) as (url, pid):
        page = Page(url, plan.size, clock)
        still = page.settle()
        yield "start_s", clock.elapsed_s
        begun = resident_mb(pid)
        middle = 0.5 * plan.size[0], 0.5 * plan.size[1]
        yield "camera", _motion(page, middle)
        yield "light", _motion(page, middle, "Shift")
        if slider:
            yield "melanin", _slider_motion(page, slider)
        yield "encoding", _encoding_times_ms(still)
        yield "delay", spread(_latencies(page, middle))
        yield "resident_mb", [begun, resident_mb(pid)]
        page.close()


def _motion(page: Page, position: Position, *modifiers: str) -> dict[str, float]:
    """Return the frame rate of a drag back and forth; repeated frames do not count.

    The time runs from the second picture, because the first may still be the picture at rest.
    """
    remaining_s = page.clock.remaining_s
    watched_s, patience_s = min(_WATCHED_S, 0.13 * remaining_s), min(_FIRST_S, 0.3 * remaining_s)
    moves, began = count(), time.perf_counter()
    page.pointer("pointer_down", *position, *modifiers)
    first = next(islice(_dragged(page, position, modifiers, moves, patience_s), 1, None), None)
    if first is None:
        raise RuntimeError(f"no picture comes within {patience_s:.1f} s")
    frames = [first, *_dragged(page, position, modifiers, moves, watched_s)]
    page.pointer("pointer_up", *position, *modifiers)
    page.settle()
    gaps = np.diff([frame.at for frame in frames]) if len(frames) > 1 else [watched_s]
    return {
        "frames_per_s": (len(frames) - 1) / watched_s,
        "watched_s": watched_s,
        "first_ms": 1e3 * (first.at - began),
        "late_frame_ms": 1e3 * float(np.percentile(gaps, 95)),
        "longest_frame_ms": 1e3 * float(np.max(gaps)),
        "kilobytes": float(np.median([len(frame.data) for frame in frames])) / 1e3,
    }


def _dragged(
    page: Page, position: Position, modifiers: Sequence[str], moves: Iterator[int], seconds: float
) -> Iterator[Picture]:
    """Yield distinct pictures while a pointer moves back and forth."""
    x, y = position
    began = time.perf_counter()
    due_s, known = 0.0, page.picture_hash
    while (now := time.perf_counter() - began) < seconds:
        if now >= due_s:
            due_s += 1.0 / _MOVES_PER_S
            page.pointer("pointer_move", x + 1.5 * (100 - abs(next(moves) % 200 - 100)), y, *modifiers)
        actual = page.next_picture(due_s - now)
        if actual and actual.digest != known:
            known = actual.digest
            yield actual


def _slider_motion(page: Page, position: Position) -> dict[str, float]:
    """Return the frame rate while a slider of the panel moves back and forth.

    Raises RuntimeError if the skin does not change.
    """
    page.send("key_down", key="Tab", modifiers=[])
    page.send("pointer_move", x=position[0], y=position[1], button=0, buttons=[], modifiers=[])
    before = _pixels(page.settle())
    found = _motion(page, position)
    after, half = _pixels(page.settle()), page.size[0] // 2
    if np.array_equal(before[:, half:], after[:, half:]):
        raise RuntimeError("the slider does not alter the skin")
    page.send("key_down", key="Tab", modifiers=[])
    page.settle()
    return found


def _pixels(picture: Picture) -> NDArray[np.uint8]:
    from PIL import Image

    return np.array(Image.open(io.BytesIO(picture.data)).convert("RGBA"))


def _latencies(page: Page, position: Position) -> list[float]:
    """Return latencies from a pointer move at rest to the first different picture [s].

    There are fewer values if time is short."""
    x, y = position
    page.pointer("pointer_down", x, y)
    found, one_s = list[float](), 0.0
    while len(found) < _REPEATS and (not found or page.clock.remaining_s > 2.0 * one_s):
        first = time.perf_counter()
        seen = {page.settle().digest}
        began = time.perf_counter()
        page.pointer("pointer_move", x + _PIXELS * (1 - len(found) % 2), y)
        while (actual := page.next_picture(page.patience_s)) and actual.digest in seen:
            pass
        if actual is None:
            raise RuntimeError("no picture comes")
        found.append(actual.at - began)
        one_s = time.perf_counter() - first
    page.pointer("pointer_up", x, y)
    return found


def _encoding_times_ms(still: Picture) -> dict[str, float]:
    """Return the time to encode a picture [ms]."""
    array, times = _pixels(still), {}
    for name, lossless in (("jpeg_ms", False), ("png_ms", True)):
        runs = []
        for _ in range(9):
            began = time.perf_counter()
            encode_image(array, is_lossless=lossless)
            runs.append(1e3 * (time.perf_counter() - began))
        times[name] = float(np.median(runs))
    return times


def resident_mb(pid: int | str = "self") -> float:
    """Return the resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * 4096 / 1e6
