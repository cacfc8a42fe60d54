"""Client with the protocol of the page, without a browser."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

SIZE = 400, 300
PATIENCE_S, _QUIET_S = 120.0, 0.7


class Page:
    """Client that confirms only the frames that the test selects."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self.active: bool | None = None
        self.frames: list[tuple[int, str, bytes]] = []

    def tell(self, kind: str, **fields: Any) -> None:
        self._socket.send(json.dumps({"type": kind, "timestamp": 0.0, **fields}))

    def show(self, size: tuple[int, int] = SIZE) -> None:
        width, height = size
        self.frames.clear()
        self.tell("resize", width=width, height=height, pwidth=width, pheight=height, ratio=1.0)

    def confirm(self, index: int) -> None:
        self.tell("_framefeedback", index=index, localtime=0.0)

    def drag(self, start: int, end: int) -> None:
        button = {"button": 1, "buttons": [1], "modifiers": [], "y": 150}
        self.frames.clear()
        self.tell("pointer_down", x=start, **button)
        for x in np.linspace(start, end, 30):
            self.tell("pointer_move", x=float(x), **button)
            time.sleep(0.01)
        self.tell("pointer_up", x=end, **button)

    def hear(self, quiet_s: float = _QUIET_S, *, confirming: bool = False) -> None:
        """Receive messages until none arrives any more."""
        while True:
            try:
                message = self._socket.recv(timeout=quiet_s)
            except TimeoutError:
                return
            told = json.loads(message)
            if told["type"] == "active":
                self.active = told["value"]
            elif told["type"] == "framebufferdata":
                self.frames.append((told["index"], told["mimetype"], self._socket.recv()))
                if confirming:
                    self.confirm(told["index"])

    def wait(
        self, reached: Callable[[], Any], quiet_s: float = _QUIET_S, *, confirming: bool = False
    ) -> None:
        """Receive messages until a condition is true."""
        end = time.monotonic() + PATIENCE_S
        while not reached():
            assert time.monotonic() < end, "what the page waits for never comes"
            self.hear(quiet_s, confirming=confirming)

    def still(self) -> NDArray[np.int64]:
        """Return the lossless picture after which nothing follows."""
        from PIL import Image

        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            self.hear(confirming=True)
            if self.frames and self.frames[-1][1] == "image/png":
                image = Image.open(io.BytesIO(self.frames[-1][2])).convert("RGB")
                return np.array(image).astype(np.int64)
        raise AssertionError("the page never comes to rest")


def visit(viewer: Any) -> Any:
    """Return a socket to a viewer of `served`."""
    from websockets.sync.client import connect

    return connect(viewer.url.replace("http", "ws", 1), max_size=None)


def difference(a: NDArray[np.int64], b: NDArray[np.int64]) -> float:
    """Return the mean difference over the part that neither the panel nor text covers."""
    return float(np.abs(a[:200, 205:] - b[:200, 205:]).mean())
