"""Input driver of a viewer without a window: pointer and key events, and a controlled clock."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.scene.settings import Settings

ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
_EDGE, _MOST_TURNS = 10.0, 20  # logical pixels; of the wheel
_LONGEST_S = 120.0
SETTINGS = Settings(atlas=128, samples=2, shadow_size=256)


@dataclass
class InputDriver:
    """Viewer on an offscreen canvas, with a clock that only the test advances."""

    viewer: Any
    canvas: Any
    now: float = 0.0
    patient: bool = True  # whether frames wait for a head that is prepared

    def frame(self, seconds: float = 0.05) -> NDArray[np.uint8]:
        """Return the (h, w, 3) pixels of the next frame, after some time [s]."""
        self.now += seconds
        self.canvas._process_events()
        drawn = np.array(self.canvas.draw())[..., :3]
        coming = self.viewer._preparation._future
        if coming is None or not self.patient:
            return drawn
        coming.exception(_LONGEST_S)
        return self.frame(0.0)

    def settled(self) -> NDArray[np.uint8]:
        """Return the picture when nothing moves any more."""
        for _ in range(60):
            self.frame()
            if self.viewer.is_still:
                return self.frame()
        raise AssertionError("the viewer does not come to rest")

    def event(self, kind: str, **fields: Any) -> None:
        self.canvas.submit_event({"event_type": kind, "modifiers": (), **fields})

    def drag(self, start: tuple[float, float], end: tuple[float, float], **fields: Any) -> None:
        """Press, move in a few steps, and release."""
        self.event("pointer_move", x=start[0], y=start[1], button=0, buttons=())
        self.frame()
        self.event("pointer_down", x=start[0], y=start[1], button=1, buttons=(1,), **fields)
        self.frame()
        for k in range(1, 5):
            x, y = (a + (b - a) * k / 4 for a, b in zip(start, end, strict=True))
            self.event("pointer_move", x=x, y=y, button=1, buttons=(1,), **fields)
            self.frame()
        self.event("pointer_up", x=end[0], y=end[1], button=1, buttons=(), **fields)
        self.frame()

    def click(self, place: tuple[float, float]) -> None:
        self.drag(place, place)

    def position(self, label: str) -> tuple[float, float]:
        """Return the position of a control of the panel, after scrolling to it; the panel must be drawn."""
        self.frame()
        height = self.canvas.get_logical_size()[1]
        for _ in range(_MOST_TURNS):
            x, y = self.viewer.session.positions[label]
            if _EDGE < y < height - _EDGE:
                break
            self.event("wheel", x=3.0, y=0.5 * height, dx=0.0, dy=100.0 if y > 0.5 * height else -100.0)
            self.frame()
            self.frame()
        return float(x), float(y)

    def press(self, label: str) -> None:
        """Click on a control of the panel."""
        self.click(self.position(label))
        self.frame()

    def choose(self, label: str, name: str) -> None:
        """Choose an entry of a list of the panel."""
        self.press(label)
        self.click(self.position(f"{label}/{name}"))
