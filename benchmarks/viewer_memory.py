"""Measure the latency of the viewer, and its memory during random changes of everything in it."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from viewer_input import MIN_REPEATS, MOTIONS, STEP, Clock, InputDriver, Plan, spread, timed_indices
from viewer_page import resident_mb

from dermis.apps.validation.pages import JsonObject
from dermis.apps.viewer.controls import PRESET_NAMES
from dermis.apps.viewer.navigation import dolly, drag_light, orbit, pan
from dermis.apps.viewer.state import ViewerState
from dermis.gpu.memory import allocated_bytes
from dermis.scene.environment import Environment
from dermis.scene.lights import light_presets

_MAX_WAIT_FRAMES = 100
_PIXELS = 6.0  # distance of a drag between two frames


def delays(driver: InputDriver, plan: Plan, clock: Clock) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield the latency from a pointer move to the picture that shows it [ms]: during a drag, then at rest.

    The camera takes some tenths of a second to come to rest, independent of the frame rate.
    """
    driver.set_state(driver.first)
    x, y = (0.5 * side for side in plan.size)
    driver.event("pointer_down", x, y)
    driver.frame()
    frame_s, chance = _frame_s(driver), random.Random(7)
    waits = (chance.random() * frame_s for _ in range(plan.frames))
    drags = zip(timed_indices(plan.frames, clock.share(0.3)), waits, strict=False)
    yield "in a drag", spread([_delay_in_frame(driver, x - _PIXELS * (k % 9), y, wait) for k, wait in drags])
    rests = timed_indices(plan.frames, clock)
    yield "from rest", spread([_delay(driver, x + _PIXELS * (1 - k % 2), y) for k in rests])
    driver.event("pointer_up", x, y)
    driver.frame()


def _frame_s(driver: InputDriver) -> float:
    """Return the least time of a frame with a turning camera [s]."""
    times = []
    for _ in range(MIN_REPEATS):
        began = time.perf_counter()
        driver.set_state(MOTIONS["camera"].change(driver.viewer.session.state, 0))
        driver.frame()
        times.append(time.perf_counter() - began)
    return min(times)


def _delay(driver: InputDriver, x: float, y: float) -> float:
    """Return the latency of a pointer move when the camera is at rest [s]."""
    driver.rest()
    before, began = driver.frame(), time.perf_counter()
    driver.event("pointer_move", x, y)
    for _ in range(_MAX_WAIT_FRAMES):  # fast frames show the camera when it has hardly moved
        picture, now = driver.frame(), time.perf_counter()
        if not np.array_equal(before, picture):
            return now - began
    raise RuntimeError("the picture does not follow")


def _delay_in_frame(driver: InputDriver, x: float, y: float, wait_s: float) -> float:
    """Return the latency of a pointer move that occurs while a frame is drawn [s]."""
    actual: list[float] = []

    def move() -> None:
        time.sleep(wait_s)
        actual.append(time.perf_counter())
        driver.event("pointer_move", x, y)

    mover = threading.Thread(target=move)
    mover.start()
    driver.set_state(
        driver.viewer.session.state.with_camera(orbit(driver.viewer.session.state.scene.camera, STEP, 0.0))
    )
    driver.frame()
    mover.join()
    driver.frame()
    return time.perf_counter() - actual[0]


Kind = Callable[[ViewerState, random.Random], ViewerState]
_SAMPLE_COUNT = 60  # memory samples over the whole measurement
_ACTIONS = ("split", "undo", "redo", "size", "panel", "preset", "start again")


def _choice(chance: random.Random, *names: Any) -> Any:
    return chance.choice(names)


KINDS: dict[str, Kind] = {
    "orbit": lambda s, r: s.with_camera(orbit(s.scene.camera, r.uniform(-1, 1), r.uniform(-0.3, 0.3))),
    "pan": lambda s, r: s.with_camera(pan(s.scene.camera, r.uniform(-0.1, 0.1), r.uniform(-0.1, 0.1))),
    "dolly": lambda s, r: s.with_camera(dolly(s.scene.camera, r.uniform(0.8, 1.25))),
    "light": lambda s, r: drag_light(s, 0, r.uniform(-0.5, 0.5), r.uniform(-0.2, 0.2)),
    "rig": lambda s, r: s.with_light_preset(_choice(r, *light_presets())),
    "environment": lambda s, r: s.with_environment(
        _choice(r, None, Environment(name="uniform", exposure=0.5))
    ),
    "reflection": lambda s, r: s.with_skin(rho_s=r.uniform(0.05, 0.5), roughness=r.uniform(0.2, 0.6)),
    "oil": lambda s, r: s.with_skin(oiliness=r.uniform(0.0, 1.0)),
    "mix": lambda s, r: s.with_skin(mix=r.uniform(0.0, 1.0)),
    "lobe": lambda s, r: s.with_skin(specular=_choice(r, "kelemen", "two-lobe", "phong", "none")),
    "fresnel": lambda s, r: s.with_skin(fresnel=_choice(r, "schlick", "exact")),
    "energy": lambda s, r: s.with_skin(energy=_choice(r, "full", "published", "none")),
    "profile": lambda s, r: s.with_skin(profile=_choice(r, "gpu-gems-3", "dj3", "skin1"), pigments=None),
    "pigments": lambda s, r: s.with_skin(profile="light").with_pigments(
        melanin=r.uniform(0.01, 0.2), blood=r.uniform(0.01, 0.1)
    ),
    "colour": lambda s, r: s.with_skin(albedo=_choice(r, "map", "profile")),
    "technique": lambda s, r: s.with_settings(
        technique=_choice(
            r, "texture-space", "one-blur", "gpu-gems-3", "screen-space", "pre-integrated", "none"
        )
    ),
    "stretch": lambda s, r: s.with_settings(stretch=_choice(r, "full", "axes", "none")),
    "seams": lambda s, r: s.with_settings(seams=_choice(r, "stitch", "none", "alpha", "multi-uv")),
    "transmission": lambda s, r: s.with_settings(transmission=_choice(r, "thin", "none")),
    "gamma": lambda s, r: s.with_settings(gamma=_choice(r, "right", "wrong")),
    "picture": lambda s, r: s.with_settings(exposure=r.uniform(0.5, 2.0), tone=_choice(r, "none", "filmic")),
    "bloom": lambda s, r: s.with_settings(bloom=_choice(r, 0.0, 0.1)),
    "samples": lambda s, r: s.with_settings(samples=_choice(r, 1, 2)),
    "atlas": lambda s, r: s.with_settings(atlas=_choice(r, s.settings.atlas, 256, 512)),
    "view": lambda s, r: s.with_view(
        _choice(r, "picture", "diffuse", "irradiance", "blur 1", "normals", "atlas")
    ),
}
"""Random changes of a state by name; if a state cannot be rendered, the viewer keeps its last picture."""


def memory_samples(driver: InputDriver, plan: Plan, minutes: float, changes: int) -> JsonObject:
    """Return memory samples during random changes, each of which is drawn.

    minutes, changes : least duration and least number of changes"""
    chance, session = random.Random(11), driver.viewer.session
    done, samples = 0, list[dict[str, float]]()
    counts = dict.fromkeys((*KINDS, *_ACTIONS), 0)
    for kind in counts:  # compile and load everything before the first sample
        _change(driver, kind, chance, plan)
        driver.frame()
    session.change(driver.first)
    begun = time.perf_counter()
    while (now := time.perf_counter() - begun) < 60.0 * minutes or done < changes:
        part = min(now / max(1e-9, 60.0 * minutes), done / max(1, changes))
        if part * _SAMPLE_COUNT >= len(samples):
            samples.append(_sample(now, done))
        kind = chance.choice(list(counts))
        _change(driver, kind, chance, plan)
        driver.frame()
        counts[kind] += 1
        done += 1
    samples.append(_sample(time.perf_counter() - begun, done))
    result = {"plan": plan.__dict__, "minutes": samples[-1]["s"] / 60.0, "changes": done, "kinds": counts}
    return result | {"samples": samples} | growth(samples)


def _sample(seconds: float, changes: int) -> dict[str, float]:
    return {
        "s": seconds,
        "changes": changes,
        "resident_mb": resident_mb(),
        "device_mb": allocated_bytes() / 1e6,
    }


def _change(driver: InputDriver, kind: str, chance: random.Random, plan: Plan) -> None:
    session = driver.viewer.session
    if kind in KINDS:
        session.change(KINDS[kind](session.state, chance))
    elif kind == "split":
        session.split.release() if session.split.frozen_state else session.split.freeze(session.state)
    elif kind == "undo":
        session.history.undo()
    elif kind == "redo":
        session.history.redo()
    elif kind == "panel":
        driver.viewer.panel.is_visible = not driver.viewer.panel.is_visible
    elif kind == "size":
        driver.canvas.set_logical_size(*(round(side * chance.choice((0.5, 0.75, 1.0))) for side in plan.size))
    elif kind == "preset":
        session.controls.set_camera_preset(chance.choice(PRESET_NAMES))
    else:
        session.change(driver.first)


def growth(samples: Sequence[dict[str, float]]) -> JsonObject:
    """Return the growth of the memory in the second half of the samples [MB per 1000 changes]."""
    late = samples[len(samples) // 2 :]
    x = [one["changes"] / 1e3 for one in late]
    names = ("resident_mb", "device_mb")
    return {f"{name}_per_1000": float(np.polyfit(x, [one[name] for one in late], 1)[0]) for name in names}
