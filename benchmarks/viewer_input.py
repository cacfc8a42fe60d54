"""Measure frame rates of motion in a viewer without a window."""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.validation.benchmarks.cases import pose_at_moment, with_test_rig
from dermis.apps.validation.pages import JsonObject
from dermis.apps.viewer.navigation import drag_light, orbit
from dermis.apps.viewer.state import ViewerState, validated_copy
from dermis.apps.viewer.view_renderer import QualityController
from dermis.apps.viewer.viewer import Viewer
from dermis.scene.heads import load_head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings


class Clock:
    """Remaining time of a measurement.

    seconds : time limit; None for no limit
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._began = time.perf_counter()
        self._end = self._began + (math.inf if seconds is None else seconds)

    @property
    def elapsed_s(self) -> float:
        """Return the time since the start [s]."""
        return time.perf_counter() - self._began

    @property
    def remaining_s(self) -> float:
        """Return the remaining time, at least 0 [s]."""
        return max(0.0, self._end - time.perf_counter())

    @property
    def over(self) -> bool:
        """Return whether no time is left."""
        return self.remaining_s <= 0.0

    def share(self, part: float) -> Clock:
        """Return a clock with a fraction of the remaining time."""
        return Clock(part * self.remaining_s)


Change = Callable[[ViewerState, int], ViewerState]
_UNTIMED_FRAMES = 2  # frames before the first that is timed
PIGMENTED = "light"  # profile with pigment sliders
_TARGETS = 52
STEP = 0.02  # rotation per frame [rad]
_REST_S = 30.0  # time limit; usually tenths of a second suffice
MIN_REPEATS = 3  # least number of values of a median, even if no time is left


@dataclass(frozen=True)
class Plan:
    """Settings of the frames and the adapter.

    size : size of the picture [pixel]
    frames : number of frames of each kind of motion
    """

    head: str
    adapter: str
    size: tuple[int, int]
    atlas: int
    samples: int
    frames: int


@dataclass(frozen=True)
class Motion:
    """One kind of change from frame to frame.

    start : function that returns the initial state
    change : function that returns the next state, given a state and the index of the frame
    """

    start: Callable[[ViewerState], ViewerState]
    change: Change


class ConstantQuality(QualityController):
    """Quality controller that always keeps the quality of the settings."""

    def limited_settings(self, wanted: Settings, size: tuple[int, int], is_moving: bool) -> Settings:
        """Return the settings at the size of the window."""
        return validated_copy(wanted, size=size)


class InputDriver:
    """Viewer on an offscreen canvas, without its panel."""

    def __init__(self, viewer: Viewer, canvas: Any) -> None:
        self.viewer, self.canvas, self.first = viewer, canvas, viewer.session.state
        self._fault: Exception | None = None
        canvas.request_draw(self._draw)

    def _draw(self) -> None:
        try:
            self.viewer.draw()
        except Exception as fault:  # which the canvas only logs
            self._fault = fault
            raise

    def frame(self) -> NDArray[np.generic]:
        """Return the next picture.

        Raises the error of the frame, because the canvas would return its last picture forever.
        """
        self.canvas._process_events()
        picture = np.asarray(self.canvas.draw())
        if fault := self._fault or self.viewer.failure:
            raise fault
        return picture

    def rest(self) -> None:
        """Draw until nothing moves.

        Raises RuntimeError if that takes too long.
        """
        clock = Clock(_REST_S)
        while not self.viewer.is_still:
            if clock.over:
                raise RuntimeError(f"the picture does not come to rest within {_REST_S:.0f} s")
            self.frame()

    def set_state(self, state: ViewerState) -> None:
        """Change to another state within one gesture, so that the undo history does not grow."""
        self.viewer.session.change(state, "benchmark")

    def event(self, kind: str, x: float, y: float, **fields: Any) -> None:
        """Send an event of a pointer with its left button pressed."""
        given = {"button": 1, "buttons": (1,), "modifiers": ()} | fields
        self.canvas.submit_event({"event_type": kind, "x": x, "y": y, **given})


def offscreen(plan: Plan) -> InputDriver:
    """Return a viewer that draws every frame at the quality of the plan."""
    from rendercanvas.offscreen import OffscreenRenderCanvas

    settings = Settings(atlas=plan.atlas, samples=plan.samples, shadow_size=plan.atlas)
    canvas = OffscreenRenderCanvas(size=plan.size)
    state = ViewerState(Scene(load_head(plan.head, subdivide=0)), settings, {"name": plan.head})
    viewer = Viewer(state, canvas, plan.adapter)
    viewer.panel.is_visible = False
    viewer.session.view_renderer.quality_controller = ConstantQuality(
        viewer.session.view_renderer.quality_controller.software
    )
    return InputDriver(viewer, canvas)


def slider_position(driver: InputDriver, name: str) -> tuple[float, float] | None:
    """Return the position of a pigment slider in the window; None if it must be scrolled into view."""
    driver.viewer.panel.is_visible = True
    driver.set_state(driver.first.with_skin(profile=PIGMENTED))
    for _ in range(MIN_REPEATS):
        driver.frame()
    driver.viewer.panel.is_visible = False
    place = driver.viewer.session.positions[name]
    return place if place[1] < driver.canvas.get_logical_size()[1] else None


def _with_constant_roughness(state: ViewerState) -> ViewerState:
    """Return the state with a constant roughness, so that its slider has an effect."""
    head = state.scene.head
    head = replace(head, maps=replace(head.maps, roughness=None))
    return replace(state, scene=replace(state.scene, head=head))


def _with_targets(state: ViewerState) -> ViewerState:
    """Return the state with as many morph targets as faces have, and with bones."""
    return replace(state, scene=replace(state.scene, head=with_test_rig(state.scene.head, _TARGETS)))


def _to_and_fro(k: int) -> float:
    return 0.5 + 0.5 * math.sin(0.2 * k)


def _unchanged(state: ViewerState) -> ViewerState:
    return state


MOTIONS: dict[str, Motion] = {
    "camera": Motion(_unchanged, lambda state, k: state.with_camera(orbit(state.scene.camera, STEP, 0.0))),
    "light": Motion(_unchanged, lambda state, k: drag_light(state, 0, STEP, 0.0)),
    "roughness": Motion(
        _with_constant_roughness, lambda state, k: state.with_skin(roughness=0.2 + 0.3 * _to_and_fro(k))
    ),
    "melanin": Motion(
        lambda state: state.with_skin(profile=PIGMENTED).with_pigments(melanin=0.05),
        lambda state, k: state.with_pigments(melanin=0.05 + 0.01 * _to_and_fro(k)),
    ),
    "expression": Motion(
        _with_targets, lambda state, k: state.with_pose(pose_at_moment(state.scene.head, k))
    ),
    "exposure": Motion(_unchanged, lambda state, k: state.with_settings(exposure=1.0 + 0.2 * _to_and_fro(k))),
}


def speeds(driver: InputDriver, plan: Plan, clock: Clock) -> Iterator[tuple[str, JsonObject]]:
    """Yield the frame rate of each kind of motion."""
    for done, (name, motion) in enumerate(MOTIONS.items()):
        yield name, _speed(driver, motion, plan.frames, clock.share(1.0 / (len(MOTIONS) - done)))


def _speed(driver: InputDriver, motion: Motion, frames: int, clock: Clock) -> JsonObject:
    session = driver.viewer.session
    driver.set_state(motion.start(driver.first))
    for k in range(_UNTIMED_FRAMES):
        driver.set_state(motion.change(session.state, k))
        driver.frame()
    times, prepared, processor = [], [], processor_s()
    for k in timed_indices(frames, clock):
        began = time.perf_counter()
        driver.set_state(motion.change(session.state, _UNTIMED_FRAMES + k))
        driver.frame()
        times.append(time.perf_counter() - began)
        prepared.append(session.view_renderer.rendered.setup_ms if session.view_renderer.rendered else 0.0)
    rendered = session.view_renderer.rendered
    return {
        "frames": len(times),
        "frames_per_s": len(times) / sum(times),
        "frame_ms": 1e3 * float(np.median(times)),
        "late_frame_ms": 1e3 * float(np.percentile(times, 95)),
        "longest_frame_ms": 1e3 * max(times),
        "processor_ms": 1e3 * (processor_s() - processor) / len(times),
        "prepared_ms": float(np.median(prepared)),
        "stages": [name for name in (rendered.gpu_ms or {} if rendered else {}) if name != "total"],
    }


def timed_indices(most: int, clock: Clock) -> Iterator[int]:
    """Yield 0, 1, 2 and so on below `most` while time is left, but at least `MIN_REPEATS` values."""
    for k in range(most):
        if k >= MIN_REPEATS and clock.over:
            return
        yield k


def processor_s() -> float:
    """Return the CPU time of this process so far, user and system [s]."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def spread(seconds: Sequence[float]) -> dict[str, float]:
    """Return median and 95th percentile [ms], and the number of values."""
    middle, late = np.percentile(seconds, (50, 95))
    return {"median_ms": 1e3 * float(middle), "late_ms": 1e3 * float(late), "count": len(seconds)}
