"""How late what a hand does is seen in a viewer without a window."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Iterator, Sequence

import numpy as np
from viewer_clock import Clock
from viewer_input import FEWEST, MOTIONS, STEP, InputDriver, Plan, counted

from dermis.apps.viewer.navigation import orbit

_PATIENCE = 100  # frames
_PIXELS = 6.0  # of a drag between two frames


def delays(driver: InputDriver, plan: Plan, clock: Clock) -> Iterator[tuple[str, dict[str, float]]]:
    """From a pointer's move to the picture that shows it [ms]: in a drag, then out of rest.

    A camera takes some tenths of a second to come to rest, however quick the frames are.
    """
    driver.go_on(driver.first)
    x, y = (0.5 * side for side in plan.size)
    driver.event("pointer_down", x, y)
    driver.frame()
    frame_s, chance = _frame_s(driver), random.Random(7)
    waits = (chance.random() * frame_s for _ in range(plan.frames))
    drags = zip(counted(plan.frames, clock.share(0.3)), waits, strict=False)
    yield "in a drag", spread([_delay_in_frame(driver, x - _PIXELS * (k % 9), y, wait) for k, wait in drags])
    rests = counted(plan.frames, clock)
    yield "from rest", spread([_delay(driver, x + _PIXELS * (1 - k % 2), y) for k in rests])
    driver.event("pointer_up", x, y)
    driver.frame()


def _frame_s(driver: InputDriver) -> float:
    """The quickest of some frames of a camera that turns [s]."""
    times = []
    for _ in range(FEWEST):
        began = time.perf_counter()
        driver.go_on(MOTIONS["camera"].change(driver.viewer.session.state, 0))
        driver.frame()
        times.append(time.perf_counter() - began)
    return min(times)


def _delay(driver: InputDriver, x: float, y: float) -> float:
    """Of a move after which the camera has come to rest [s]."""
    driver.rest()
    before, began = driver.frame(), time.perf_counter()
    driver.event("pointer_move", x, y)
    for _ in range(_PATIENCE):  # quick frames show the camera when it has hardly begun to glide
        picture, now = driver.frame(), time.perf_counter()
        if not np.array_equal(before, picture):
            return now - began
    raise RuntimeError("the picture does not follow")


def _delay_in_frame(driver: InputDriver, x: float, y: float, wait_s: float) -> float:
    """Of a move that comes while a frame is drawn [s]."""
    came: list[float] = []

    def move() -> None:
        time.sleep(wait_s)
        came.append(time.perf_counter())
        driver.event("pointer_move", x, y)

    mover = threading.Thread(target=move)
    mover.start()
    driver.go_on(
        driver.viewer.session.state.with_camera(orbit(driver.viewer.session.state.scene.camera, STEP, 0.0))
    )
    driver.frame()
    mover.join()
    driver.frame()
    return time.perf_counter() - came[0]


def spread(seconds: Sequence[float]) -> dict[str, float]:
    """Median and 95th percentile [ms], and of how many."""
    middle, late = np.percentile(seconds, (50, 95))
    return {"median_ms": 1e3 * float(middle), "late_ms": 1e3 * float(late), "count": len(seconds)}
