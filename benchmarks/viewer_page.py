"""`dermis view --browser` as a page sees it: frames a second, and how late a move is seen."""

from __future__ import annotations

import hashlib
import io
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from viewer_hands import Plan, spread

from dermis.viewer.browser.canvas import encoded

_QUIET_S, _PATIENCE_S = 1.5, 120.0
_MOVES_PER_S = 50.0  # what rendercanvas' page sends at most
_WATCHED_S = 8.0
_REPEATS = 20
_PIXELS = 6.0


@dataclass(frozen=True)
class Picture:
    """A frame as it came.

    at : when its last byte was here [s]
    """

    kind: str
    data: bytes
    at: float

    @property
    def name(self) -> bytes:
        """What tells it from other pictures."""
        return hashlib.sha256(self.data).digest()


class Page:
    """A client that asks, moves and confirms as rendercanvas' page does."""

    def __init__(self, url: str, size: tuple[int, int]) -> None:
        self._socket = _connected(url.replace("http", "ws", 1))
        self.size = size
        self._last: Picture | None = None
        self.send("resize", width=size[0], height=size[1], pwidth=size[0], pheight=size[1], ratio=1.0)
        self.send("key_down", key="Tab", modifiers=[])  # hides the panel

    def send(self, kind: str, **fields: Any) -> None:
        """An event."""
        self._socket.send(json.dumps({"type": kind, "timestamp": time.time()} | fields))

    def pointer(self, kind: str, x: float, y: float, *modifiers: str) -> None:
        """Of a pointer with its left button down."""
        state = {"button": 1, "buttons": [1], "modifiers": list(modifiers), "ntouches": 0, "touches": {}}
        self.send(kind, x=x, y=y, **state)

    def next_picture(self, timeout_s: float) -> Picture | None:
        """The next frame, confirmed; None when none comes in time."""
        until = time.perf_counter() + timeout_s
        while (left := until - time.perf_counter()) > 0.0:
            try:
                message = self._socket.recv(timeout=left)
            except TimeoutError:
                return None
            told = json.loads(message)
            if told["type"] == "framebufferdata":
                data = self._socket.recv(timeout=_PATIENCE_S)
                assert isinstance(data, bytes)
                found = Picture(told["mimetype"], data, time.perf_counter())
                self.send("_framefeedback", index=told["index"], timestamp=told["timestamp"])
                self._last = found
                return found
        return None

    def settle(self) -> Picture:
        """The picture when none follows for a while, which is the lossless one."""
        first = time.perf_counter()
        while time.perf_counter() - first < _PATIENCE_S:
            if self.next_picture(_QUIET_S) is None and self._last and self._last.kind == "image/png":
                return self._last
        raise RuntimeError("the page does not come to rest")

    def close(self) -> None:
        """Leave."""
        self._socket.close()


def _connected(url: str) -> Any:
    """A socket; the server tells its address a moment before it listens."""
    from websockets.sync.client import connect

    until = time.perf_counter() + _PATIENCE_S
    while True:
        try:
            return connect(url, max_size=None)
        except ConnectionRefusedError:
            if time.perf_counter() > until:
                raise
            time.sleep(0.1)


def through_the_page(plan: Plan) -> dict[str, Any]:
    """Motion and delay with all that lies between a page and the picture, at the viewer's own pace."""
    size = "x".join(map(str, plan.size))
    words = ["view", plan.head, "--browser", "--port", "0", "--size", size, "--atlas", str(plan.atlas)]
    words += ["--samples", str(plan.samples), "--adapter", plan.adapter]
    server = subprocess.Popen([sys.executable, "-m", "dermis", *words], stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        page = Page(server.stdout.readline().split()[0], plan.size)
        still = page.settle()
        begun = resident_mb(server.pid)
        found: dict[str, Any] = {
            "camera": _motion(page),
            "light": _motion(page, "Shift"),
            "delay": spread(_delays(page)),
            "resident_mb": [begun, resident_mb(server.pid)],
            "encoding": _encoding(still),
        }
        page.close()
    finally:
        server.terminate()
        server.wait(timeout=30)
    return found


def _motion(page: Page, *modifiers: str) -> dict[str, float]:
    """A drag to and fro for some seconds."""
    x, y = (0.5 * side for side in page.size)
    page.pointer("pointer_down", x, y, *modifiers)
    began = time.perf_counter()
    frames: list[Picture] = []
    moves = 0
    while (now := time.perf_counter() - began) < _WATCHED_S:
        if now >= moves / _MOVES_PER_S:
            moves += 1
            page.pointer("pointer_move", x + 1.5 * abs(moves % 200 - 100), y, *modifiers)
        came = page.next_picture(moves / _MOVES_PER_S - now)
        frames += [came] if came else []
    page.pointer("pointer_up", x, y, *modifiers)
    page.settle()
    sizes = [len(frame.data) for frame in frames]
    return {"frames_per_s": len(frames) / _WATCHED_S, "kilobytes": float(np.median(sizes)) / 1e3}


def _delays(page: Page) -> list[float]:
    """From a move out of rest to the first picture that is another [s]."""
    x, y = (0.5 * side for side in page.size)
    page.pointer("pointer_down", x, y)
    found = []
    for k in range(_REPEATS):
        seen = {page.settle().name}
        began = time.perf_counter()
        page.pointer("pointer_move", x + _PIXELS * (1 - k % 2), y)
        while (came := page.next_picture(_PATIENCE_S)) and came.name in seen:
            pass
        assert came is not None, "no picture comes"
        found.append(came.at - began)
    page.pointer("pointer_up", x, y)
    page.settle()
    return found


def _encoding(still: Picture) -> dict[str, float]:
    """What it takes to make bytes of a picture [ms]."""
    from PIL import Image

    array = np.array(Image.open(io.BytesIO(still.data)).convert("RGBA"))
    times = {}
    for name, lossless in (("jpeg_ms", False), ("png_ms", True)):
        runs = []
        for _ in range(9):
            began = time.perf_counter()
            encoded(array, lossless=lossless)
            runs.append(1e3 * (time.perf_counter() - began))
        times[name] = float(np.median(runs))
    return times


def resident_mb(pid: int | str = "self") -> float:
    """Memory of a process that is in use [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * 4096 / 1e6
