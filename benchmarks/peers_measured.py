"""Ours, Cycles and Mitsuba render one scene in turns, so that whatever slows the machine slows them all."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.benchmark.gpu_gems_3_fragments import published_as_fragments
from dermis.comparison.scenes import comparison_scene, usual_region
from dermis.comparison.truths import matched
from dermis.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.media import Medium, media
from dermis.optics.profiles import TERMS, write_profile
from dermis.reference.cycles import Method, cycles_passes
from dermis.reference.cycles_process import CyclesPass
from dermis.reference.path_traced import SAMPLES_PER_PASS, PathTraced, path_trace
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

METHODS: tuple[Method, ...] = ("random-walk", "burley")


@dataclass(frozen=True)
class Way:
    """One of our ways to draw skin: technique, atlas, and how skin returns light."""

    technique: str
    atlas: int = 1024
    direction: str = "lambertian"


OURS = {
    "texture space, atlas 1024": Way("texture-space"),
    "texture space, atlas 512": Way("texture-space", 512),
    "half-space skin, atlas 512": Way("texture-space", 512, "half-space"),
    "screen space": Way("screen-space", 64),
}
"""By what they are called in the table; screen space has no use for an atlas."""
COMPUTE, FRAGMENTS = "passes of 2007 as compute", "passes of 2007 as fragments"
PUBLISHED = {name: Way("gpu-gems-3") for name in (COMPUTE, FRAGMENTS)}
"""The published structure in our renderer, to set beside the first of ours."""
SEEDS = (100, 200)
"""Of the first pass of each turn; the passes of a turn have the following ones."""
_WORK = {"ours": 35, "random-walk": 5, "burley": 2, "path-traced": 20}
"""Expected time of a turn of frames and of a path through each pixel, for the progress bar."""


@dataclass(frozen=True)
class Plan:
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
        each = _WORK["random-walk"] + _WORK["burley"]
        turns = len(SEEDS) * len(METHODS) + 2
        return (
            turns * _WORK["ours"] + len(SEEDS) * sum(self.samples) * each + self.paths * _WORK["path-traced"]
        )


@dataclass
class Frames:
    """Our frames at one setting: the image, and what each frame took [s]."""

    image: NDArray[np.float32]
    seconds: list[float] = field(default_factory=list)
    core_seconds: list[float] = field(default_factory=list)


@dataclass
class Measured:
    """What all renderers made of one scene.

    ours : by the names of OURS and PUBLISHED
    cycles : by method, then for each seed the passes of `Plan.samples`
    left_out : why a method is missing
    truth_core_seconds : of Mitsuba, scene and all
    """

    light: str
    region: str
    ours: dict[str, Frames]
    cycles: dict[str, list[list[CyclesPass]]]
    left_out: dict[str, str]
    truth: PathTraced
    truth_core_seconds: float


def measure(
    head: Head, light: str, plan: Plan, renderer: Renderer, report: Callable[[int], None] = lambda work: None
) -> Measured:
    """Everything that is to be rendered under one light, ours before, between and after the others.

    report : told how much work is done since it was last told
    """
    body = matched(media()["skin1"])
    settings = Settings(size=(plan.side, plan.side))
    cycles: dict[str, list[list[CyclesPass]]] = {method: [] for method in METHODS}
    ours: dict[str, Frames] = {}
    left_out: dict[str, str] = {}

    def per_pass(done: int, of: int) -> None:
        report(SAMPLES_PER_PASS * _WORK["path-traced"])

    with _scene(head, light, body) as scene:
        for seed in SEEDS:
            for method in METHODS:
                _add_frames(ours, renderer, scene, plan)
                report(_WORK["ours"])
                try:
                    cycles[method].append(_passes(scene, body, plan, settings, method, seed))
                except DermisError as fault:
                    left_out[method] = str(fault)
                report(_WORK[method] * sum(plan.samples))
        _add_frames(ours, renderer, scene, plan)
        report(_WORK["ours"])
        worked = time.process_time()
        truth = path_trace(scene, body, plan.paths, settings, keep=False, report=per_pass)
        core_seconds = time.process_time() - worked
        _add_frames(ours, renderer, scene, plan)
        report(_WORK["ours"])
    whole = {method: turns for method, turns in cycles.items() if method not in left_out}
    return Measured(light, usual_region(light), ours, whole, left_out, truth, core_seconds)


@contextmanager
def _scene(head: Head, light: str, body: Medium) -> Iterator[Scene]:
    """White skin with the medium's profile; its file lives as long as the context."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "profile.toml"
        write_profile(file, fit_gaussians(diffusion_profile(body).rings(), TERMS, name=body.name).profile, {})
        yield comparison_scene(head, light, usual_region(light), str(file))


def _passes(
    scene: Scene, body: Medium, plan: Plan, settings: Settings, method: Method, seed: int
) -> list[CyclesPass]:
    """Passes of Cycles after one that is not counted: it builds what the others find built."""
    return cycles_passes(scene, body, (1, *plan.samples), settings, method=method, seed=seed)[1:]


def _add_frames(ours: dict[str, Frames], renderer: Renderer, scene: Scene, plan: Plan) -> None:
    """Warm frames with everything computed anew, shadows too."""
    for name, way in (OURS | PUBLISHED).items():
        settings = Settings.model_validate(
            {"size": (plan.side, plan.side), "technique": way.technique, "atlas": way.atlas}
        )
        skin = Skin(**(scene.skin.model_dump() | {"direction": way.direction}))
        turned = replace(scene, skin=skin)
        with _drawn_as(name, renderer):
            drawn = renderer.draw(turned, settings, keep_shadows=False)
            frames = ours.setdefault(name, Frames(drawn.linear()))
            for _ in range(plan.frames):
                began, worked = time.perf_counter(), time.process_time()
                renderer.draw(turned, settings, keep_shadows=False)
                frames.seconds.append(time.perf_counter() - began)
                frames.core_seconds.append(time.process_time() - worked)


def _drawn_as(name: str, renderer: Renderer) -> AbstractContextManager[None]:
    return published_as_fragments(renderer.device, renderer.stages) if name == FRAGMENTS else nullcontext()
