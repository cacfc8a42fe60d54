"""Motion in a viewer without a window: how many frames a second, and how late what a hand does is seen."""

from __future__ import annotations

import math
import random
import resource
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dermis.assets.head import load_head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.viewer.lamp import drag_light
from dermis.viewer.orbit import orbit
from dermis.viewer.pace import Pace
from dermis.viewer.state import ViewerState, changed
from dermis.viewer.viewer import Viewer

Change = Callable[[ViewerState, int], ViewerState]
_SETTLING = 2  # frames before any is counted
_STEP = 0.02  # of turns [rad]
_PATIENCE = 100  # frames
_PIXELS = 6.0  # of a drag between two frames


@dataclass(frozen=True)
class Plan:
    """What is drawn on what.

    size : of the picture [pixel]
    frames : of each kind of motion
    """

    head: str
    adapter: str
    size: tuple[int, int]
    atlas: int
    samples: int
    frames: int


@dataclass(frozen=True)
class Motion:
    """One thing that moves from frame to frame.

    start : the state in which it begins
    """

    start: Callable[[ViewerState], ViewerState]
    change: Change


class Steady(Pace):
    """The same effort for every frame: what is asked for."""

    def settings(self, wanted: Settings, size: tuple[int, int], moving: bool) -> Settings:
        """The wanted ones at the window's size."""
        return changed(wanted, size=size)


class Hands:
    """A viewer on an offscreen canvas, without its panel."""

    def __init__(self, viewer: Viewer, canvas: Any) -> None:
        self.viewer, self.canvas, self.first = viewer, canvas, viewer.desk.state

    def frame(self) -> np.ndarray[Any, Any]:
        """The next picture, after what has happened since the last one."""
        self.canvas._process_events()
        return np.asarray(self.canvas.draw())

    def go_on(self, state: ViewerState) -> None:
        """Another state, in a gesture, so that the history does not grow."""
        self.viewer.desk.change(state, "benchmark")

    def event(self, kind: str, x: float, y: float, **fields: Any) -> None:
        """Of a pointer with its left button down."""
        given = {"button": 1, "buttons": (1,), "modifiers": ()} | fields
        self.canvas.submit_event({"event_type": kind, "x": x, "y": y, **given})


def offscreen(plan: Plan) -> Hands:
    """A viewer that draws every frame at the plan's effort."""
    from rendercanvas.offscreen import OffscreenRenderCanvas

    settings = Settings(atlas=plan.atlas, samples=plan.samples, shadow_size=plan.atlas)
    canvas = OffscreenRenderCanvas(size=plan.size)
    state = ViewerState(Scene(load_head(plan.head)), settings, {"name": plan.head})
    viewer = Viewer(state, canvas, plan.adapter)
    viewer.panel.visible = False
    viewer.desk.studio.pace = Steady(viewer.desk.studio.pace.software)
    return Hands(viewer, canvas)


def _unmapped(state: ViewerState) -> ViewerState:
    """With a roughness that is one number, for its slider to move."""
    head = state.scene.head
    head = replace(head, maps=replace(head.maps, roughness=None))
    return replace(state, scene=replace(state.scene, head=head))


def _to_and_fro(k: int) -> float:
    return 0.5 + 0.5 * math.sin(0.2 * k)


def _same(state: ViewerState) -> ViewerState:
    return state


MOTIONS: dict[str, Motion] = {
    "camera": Motion(_same, lambda state, k: state.with_camera(orbit(state.scene.camera, _STEP, 0.0))),
    "light": Motion(_same, lambda state, k: drag_light(state, 0, _STEP, 0.0)),
    "roughness": Motion(_unmapped, lambda state, k: state.with_skin(roughness=0.2 + 0.3 * _to_and_fro(k))),
    "melanin": Motion(
        lambda state: state.with_skin(profile="light").with_pigments(melanin=0.05),
        lambda state, k: state.with_pigments(melanin=0.05 + 0.01 * _to_and_fro(k)),
    ),
    "exposure": Motion(_same, lambda state, k: state.with_settings(exposure=1.0 + 0.2 * _to_and_fro(k))),
}


def speeds(hands: Hands, plan: Plan) -> dict[str, dict[str, Any]]:
    """Of each kind of motion."""
    return {name: _speed(hands, motion, plan.frames) for name, motion in MOTIONS.items()}


def _speed(hands: Hands, motion: Motion, frames: int) -> dict[str, Any]:
    desk = hands.viewer.desk
    hands.go_on(motion.start(hands.first))
    for k in range(_SETTLING):
        hands.go_on(motion.change(desk.state, k))
        hands.frame()
    times, prepared, processor = [], [], processor_s()
    for k in range(_SETTLING, _SETTLING + frames):
        began = time.perf_counter()
        hands.go_on(motion.change(desk.state, k))
        hands.frame()
        times.append(time.perf_counter() - began)
        prepared.append(desk.studio.rendered.setup_ms if desk.studio.rendered else 0.0)
    rendered = desk.studio.rendered
    return {
        "frames_per_s": frames / sum(times),
        "frame_ms": 1e3 * float(np.median(times)),
        "processor_ms": 1e3 * (processor_s() - processor) / frames,
        "prepared_ms": float(np.median(prepared)),
        "stages": [name for name in (rendered.gpu_ms or {} if rendered else {}) if name != "total"],
    }


def delays(hands: Hands, plan: Plan) -> dict[str, dict[str, float]]:
    """From a pointer's move to the picture that shows it [ms]."""
    hands.go_on(hands.first)
    x, y = (0.5 * side for side in plan.size)
    hands.event("pointer_down", x, y)
    hands.frame()
    rest, drag = [], []
    chance = random.Random(7)
    for k in range(plan.frames):
        rest.append(_delay(hands, x + _PIXELS * (1 - k % 2), y))
    for k in range(plan.frames):
        drag.append(_delay_in_frame(hands, x + _PIXELS * (k % 9), y, chance.random() * min(rest)))
    hands.event("pointer_up", x, y)
    hands.frame()
    return {"from rest": spread(rest), "in a drag": spread(drag)}


def _delay(hands: Hands, x: float, y: float) -> float:
    """Of a move after which the camera has come to rest [s]."""
    while not hands.viewer.is_still:
        hands.frame()
    before, began = hands.frame(), time.perf_counter()
    hands.event("pointer_move", x, y)
    for _ in range(_PATIENCE):  # quick frames show the camera when it has hardly begun to glide
        if not np.array_equal(before, hands.frame()):
            return time.perf_counter() - began
    raise RuntimeError("the picture does not follow")


def _delay_in_frame(hands: Hands, x: float, y: float, wait_s: float) -> float:
    """Of a move that comes while a frame is drawn [s]."""
    came: list[float] = []

    def move() -> None:
        time.sleep(wait_s)
        came.append(time.perf_counter())
        hands.event("pointer_move", x, y)

    mover = threading.Thread(target=move)
    mover.start()
    hands.go_on(hands.viewer.desk.state.with_camera(orbit(hands.viewer.desk.state.scene.camera, _STEP, 0.0)))
    hands.frame()
    mover.join()
    hands.frame()
    return time.perf_counter() - came[0]


def spread(seconds: Sequence[float]) -> dict[str, float]:
    """Median and 95th percentile [ms], and of how many."""
    middle, late = np.percentile(seconds, (50, 95))
    return {"median_ms": 1e3 * float(middle), "late_ms": 1e3 * float(late), "count": len(seconds)}


def processor_s() -> float:
    """Of this process so far, user and system [s]."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
