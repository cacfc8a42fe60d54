"""Renderings of a scene by dermis, Cycles and Mitsuba in turns, so that a slow machine slows all of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.cycles import CyclesPass, Method, cycles_passes
from dermis.apps.truths.path_traced import SAMPLES_PER_PASS, PathTraced, path_trace
from dermis.apps.validation.benchmarks.cases import FRAGMENT_TECHNIQUE, GPU_GEMS_3
from dermis.apps.validation.benchmarks.gpu_gems_3_fragments import FRAGMENT_PASSES as AS_FRAGMENTS
from dermis.apps.validation.comparisons.scenes import medium_scene, default_region
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.optics.media import Medium, media
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES

METHODS: tuple[Method, ...] = ("random-walk", "burley")


@dataclass(frozen=True)
class RenderVariant:
    """One of our ways to draw skin: technique, atlas, and how skin returns light."""

    technique: str
    atlas: int = 1024
    direction: str = "half-space"


VARIANTS = {
    "texture space, atlas 1024": RenderVariant("texture-space"),
    "texture space, atlas 512": RenderVariant("texture-space", 512),
    "Lambertian skin, atlas 1024": RenderVariant("texture-space", 1024, "lambertian"),
    "screen space": RenderVariant("screen-space", 64),
}
"""By their names in the table; screen space needs no atlas."""
GPU_GEMS_3_VARIANTS = {
    "passes of 2007 as compute": RenderVariant(GPU_GEMS_3, direction="lambertian"),
    "passes of 2007 as fragments": RenderVariant(FRAGMENT_TECHNIQUE, direction="lambertian"),
}
"""The structure of 2007 in our renderer, to set beside the first of ours."""
FIRST_SEEDS = (100, 200)
"""Of the first pass of each turn; the passes of a turn have the following ones."""
_PROGRESS_STEPS = {"ours": 35, "random-walk": 5, "burley": 2, "path-traced": 20}
"""Expected time of a turn of frames and of a path through each pixel, for the progress bar."""


@dataclass(frozen=True)
class PeerPlan:
    """What is rendered.

    side : of the image [pixel]
    samples : of Cycles, paths through each pixel of each pass
    paths : of Mitsuba through each pixel
    frames : of ours in each turn, after one that is not counted
    """

    side: int = 512
    samples: tuple[int, ...] = (8, 32, 128)
    paths: int = 64
    frames: int = 5

    @property
    def work(self) -> int:
        """Steps of the progress bar for one scene."""
        each = _PROGRESS_STEPS["random-walk"] + _PROGRESS_STEPS["burley"]
        turns = len(FIRST_SEEDS) * len(METHODS) + 2
        return (
            turns * _PROGRESS_STEPS["ours"] + len(FIRST_SEEDS) * sum(self.samples) * each + self.paths * _PROGRESS_STEPS["path-traced"]
        )


@dataclass
class FrameTimes:
    """Our frames at one setting: the image, and what each frame took [s]."""

    image: NDArray[np.float32]
    seconds: list[float] = field(default_factory=list)
    core_seconds: list[float] = field(default_factory=list)


@dataclass
class PeerRenders:
    """The pictures and times of all renderers for one scene.

    ours : by the names of OURS and OF_2007
    cycles : by method, then for each seed the passes of `Plan.samples`
    left_out : why a method is missing
    truth_core_seconds : of Mitsuba, scene and all
    """

    light: str
    region: str
    ours: dict[str, FrameTimes]
    cycles: dict[str, list[list[CyclesPass]]]
    left_out: dict[str, str]
    truth: PathTraced
    truth_core_seconds: float


def render_peers(
    head: Head, light: str, plan: PeerPlan, renderer: Renderer, report: Callable[[int], None] = lambda work: None
) -> PeerRenders:
    """Render everything under one light, ours before, between and after the others.

    report : is called with the amount of work since its last call
    """
    body = media()["skin1"].with_eta(1.0)
    settings = Settings(size=(plan.side, plan.side))
    cycles: dict[str, list[list[CyclesPass]]] = {method: [] for method in METHODS}
    ours: dict[str, FrameTimes] = {}
    left_out: dict[str, str] = {}

    def per_pass(done: int, of: int) -> None:
        report(SAMPLES_PER_PASS * _PROGRESS_STEPS["path-traced"])

    of_scene = medium_scene(head, light, default_region(light), body)
    with TECHNIQUES.including(FRAGMENT_TECHNIQUE, AS_FRAGMENTS), of_scene as (scene, _):
        for seed in FIRST_SEEDS:
            for method in METHODS:
                _add_frames(ours, renderer, scene, plan)
                report(_PROGRESS_STEPS["ours"])
                try:
                    cycles[method].append(_cycles_passes(scene, body, plan, settings, method, seed))
                except DermisError as fault:
                    left_out[method] = str(fault)
                report(_PROGRESS_STEPS[method] * sum(plan.samples))
        _add_frames(ours, renderer, scene, plan)
        report(_PROGRESS_STEPS["ours"])
        worked = time.process_time()
        truth = path_trace(scene, body, plan.paths, settings, use_cache=False, progress=per_pass)
        core_seconds = time.process_time() - worked
        _add_frames(ours, renderer, scene, plan)
        report(_PROGRESS_STEPS["ours"])
    whole = {method: turns for method, turns in cycles.items() if method not in left_out}
    return PeerRenders(light, default_region(light), ours, whole, left_out, truth, core_seconds)


def _cycles_passes(
    scene: Scene, body: Medium, plan: PeerPlan, settings: Settings, method: Method, seed: int
) -> list[CyclesPass]:
    """Return passes of Cycles after one that is not counted, which builds the scene."""
    return cycles_passes(scene, body, (1, *plan.samples), settings, method=method, seed=seed)[1:]


def _add_frames(ours: dict[str, FrameTimes], renderer: Renderer, scene: Scene, plan: PeerPlan) -> None:
    """Add warm frames that compute everything from scratch."""
    for name, way in (VARIANTS | GPU_GEMS_3_VARIANTS).items():
        settings = Settings.model_validate(
            {"size": (plan.side, plan.side), "technique": way.technique, "atlas": way.atlas}
        )
        skin = Skin(**(scene.skin.model_dump() | {"direction": way.direction}))
        turned = replace(scene, skin=skin)
        drawn = renderer.draw(turned, settings, force=True)
        frames = ours.setdefault(name, FrameTimes(drawn.linear()))
        for _ in range(plan.frames):
            began, worked = time.perf_counter(), time.process_time()
            renderer.draw(turned, settings, force=True)
            frames.seconds.append(time.perf_counter() - began)
            frames.core_seconds.append(time.process_time() - worked)
