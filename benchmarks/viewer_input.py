"""Frame rates of motion in a viewer without a window."""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.validation.benchmarks.cases import test_pose, with_test_rig
from dermis.apps.validation.pages import JsonObject
from dermis.apps.viewer.navigation import drag_light, orbit
from dermis.apps.viewer.state import ViewerState, validated_copy
from dermis.apps.viewer.view_renderer import QualityController
from dermis.apps.viewer.viewer import Viewer
from dermis.scene.heads import load_head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings


class Clock:
    """Time that is left, from now on.

    seconds : in all; None for as long as it takes
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._began = time.perf_counter()
        self._end = self._began + (math.inf if seconds is None else seconds)

    @property
    def gone_s(self) -> float:
        """Since the beginning."""
        return time.perf_counter() - self._began

    @property
    def left_s(self) -> float:
        """Until the end, at least 0."""
        return max(0.0, self._end - time.perf_counter())

    @property
    def over(self) -> bool:
        """Whether nothing is left."""
        return self.left_s <= 0.0

    def share(self, part: float) -> Clock:
        """A part of what is left."""
        return Clock(part * self.left_s)


Change = Callable[[ViewerState, int], ViewerState]
_SETTLING = 2  # frames before any is counted
PIGMENTED = "light"  # a profile that sliders of pigments move
_TARGETS = 52
STEP = 0.02  # of turns [rad]
_REST_S = 30.0  # at most, which some tenths of a second are enough for
FEWEST = 3  # that a median is made of, however little time is left


@dataclass(frozen=True)
class Plan:
    """What is drawn, and on which adapter.

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


class Steady(QualityController):
    """The same quality for every frame: what the settings ask for."""

    def settings(self, wanted: Settings, size: tuple[int, int], moving: bool) -> Settings:
        """The wanted ones at the window's size."""
        return validated_copy(wanted, size=size)


class InputDriver:
    """A viewer on an offscreen canvas, without its panel."""

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
        """The next picture, after what has happened since the last one.

        Raises what went wrong, for the canvas would show its last picture for ever.
        """
        self.canvas._process_events()
        picture = np.asarray(self.canvas.draw())
        if fault := self._fault or self.viewer.failure:
            raise fault
        return picture

    def rest(self) -> None:
        """Draw until nothing moves.

        Raises RuntimeError when that takes too long.
        """
        clock = Clock(_REST_S)
        while not self.viewer.is_still:
            if clock.over:
                raise RuntimeError(f"the picture does not come to rest within {_REST_S:.0f} s")
            self.frame()

    def go_on(self, state: ViewerState) -> None:
        """Go to another state within one gesture, so that the undo history does not grow."""
        self.viewer.session.change(state, "benchmark")

    def event(self, kind: str, x: float, y: float, **fields: Any) -> None:
        """Of a pointer with its left button down."""
        given = {"button": 1, "buttons": (1,), "modifiers": ()} | fields
        self.canvas.submit_event({"event_type": kind, "x": x, "y": y, **given})


def offscreen(plan: Plan) -> InputDriver:
    """A viewer that draws every frame at the plan's quality."""
    from rendercanvas.offscreen import OffscreenRenderCanvas

    settings = Settings(atlas=plan.atlas, samples=plan.samples, shadow_size=plan.atlas)
    canvas = OffscreenRenderCanvas(size=plan.size)
    state = ViewerState(Scene(load_head(plan.head, subdivide=0)), settings, {"name": plan.head})
    viewer = Viewer(state, canvas, plan.adapter)
    viewer.panel.is_visible = False
    viewer.session.view_renderer.quality_controller = Steady(
        viewer.session.view_renderer.quality_controller.software
    )
    return InputDriver(viewer, canvas)


def slider_position(driver: InputDriver, name: str) -> tuple[float, float] | None:
    """Position of a pigment's slider in the window, None when it would have to be scrolled to."""
    driver.viewer.panel.is_visible = True
    driver.go_on(driver.first.with_skin(profile=PIGMENTED))
    for _ in range(FEWEST):
        driver.frame()
    driver.viewer.panel.is_visible = False
    place = driver.viewer.session.positions[name]
    return place if place[1] < driver.canvas.get_logical_size()[1] else None


def _unmapped(state: ViewerState) -> ViewerState:
    """With a roughness that is one number, for its slider to move."""
    head = state.scene.head
    head = replace(head, maps=replace(head.maps, roughness=None))
    return replace(state, scene=replace(state.scene, head=head))


def _with_targets(state: ViewerState) -> ViewerState:
    """With as many morph targets as faces have, and bones."""
    return replace(state, scene=replace(state.scene, head=with_test_rig(state.scene.head, _TARGETS)))


def _to_and_fro(k: int) -> float:
    return 0.5 + 0.5 * math.sin(0.2 * k)


def _same(state: ViewerState) -> ViewerState:
    return state


MOTIONS: dict[str, Motion] = {
    "camera": Motion(_same, lambda state, k: state.with_camera(orbit(state.scene.camera, STEP, 0.0))),
    "light": Motion(_same, lambda state, k: drag_light(state, 0, STEP, 0.0)),
    "roughness": Motion(_unmapped, lambda state, k: state.with_skin(roughness=0.2 + 0.3 * _to_and_fro(k))),
    "melanin": Motion(
        lambda state: state.with_skin(profile=PIGMENTED).with_pigments(melanin=0.05),
        lambda state, k: state.with_pigments(melanin=0.05 + 0.01 * _to_and_fro(k)),
    ),
    "expression": Motion(_with_targets, lambda state, k: state.with_pose(test_pose(state.scene.head, k))),
    "exposure": Motion(_same, lambda state, k: state.with_settings(exposure=1.0 + 0.2 * _to_and_fro(k))),
}


def speeds(driver: InputDriver, plan: Plan, clock: Clock) -> Iterator[tuple[str, JsonObject]]:
    """Of each kind of motion, one after the other."""
    for done, (name, motion) in enumerate(MOTIONS.items()):
        yield name, _speed(driver, motion, plan.frames, clock.share(1.0 / (len(MOTIONS) - done)))


def _speed(driver: InputDriver, motion: Motion, frames: int, clock: Clock) -> JsonObject:
    session = driver.viewer.session
    driver.go_on(motion.start(driver.first))
    for k in range(_SETTLING):
        driver.go_on(motion.change(session.state, k))
        driver.frame()
    times, prepared, processor = [], [], processor_s()
    for k in counted(frames, clock):
        began = time.perf_counter()
        driver.go_on(motion.change(session.state, _SETTLING + k))
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


def counted(most: int, clock: Clock) -> Iterator[int]:
    """0, 1, 2 and so on as long as there is time."""
    for k in range(most):
        if k >= FEWEST and clock.over:
            return
        yield k


def processor_s() -> float:
    """Of this process so far, user and system [s]."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def spread(seconds: Sequence[float]) -> dict[str, float]:
    """Median and 95th percentile [ms], and of how many."""
    middle, late = np.percentile(seconds, (50, 95))
    return {"median_ms": 1e3 * float(middle), "late_ms": 1e3 * float(late), "count": len(seconds)}
