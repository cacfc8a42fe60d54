"""Timed renderings of a scene by dermis, Cycles and Mitsuba.

The programs take turns, so that other load on the machine slows all of them alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.cycles import CyclesPass, SubsurfaceMethod, cycles_passes
from dermis.apps.truths.path_traced import SAMPLES_PER_PASS, PathTraced, path_trace
from dermis.apps.validation.benchmarks.cases import FRAGMENT_TECHNIQUE, GPU_GEMS_3
from dermis.apps.validation.benchmarks.gpu_gems_3_fragments import FRAGMENT_PASSES
from dermis.apps.validation.comparisons.scenes import default_region, medium_scene
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.optics.media import Medium, published_media
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES

CYCLES_METHODS: tuple[SubsurfaceMethod, ...] = ("random-walk", "burley")


@dataclass(frozen=True)
class RenderVariant:
    """Settings with which dermis renders a picture for the comparison with other renderers.

    technique : scattering technique
    atlas : side of the atlas [texel]
    direction : angular distribution of the light that leaves the skin
    """

    technique: str
    atlas: int = 1024
    direction: str = "half-space"


DERMIS_VARIANTS = {
    "texture space, atlas 1024": RenderVariant("texture-space"),
    "texture space, atlas 512": RenderVariant("texture-space", 512),
    "Lambertian skin, atlas 1024": RenderVariant("texture-space", 1024, "lambertian"),
    "screen space": RenderVariant("screen-space", 64),
}
"""Settings of dermis by their names in the report; screen space needs no atlas."""
GPU_GEMS_3_VARIANTS = {
    "passes of 2007 as compute": RenderVariant(GPU_GEMS_3, direction="lambertian"),
    "passes of 2007 as fragments": RenderVariant(FRAGMENT_TECHNIQUE, direction="lambertian"),
}
"""Passes of GPU Gems 3 (2007) in dermis, to compare with the first of `DERMIS_VARIANTS`."""
FIRST_SEED_BY_TURN = (100, 200)
"""Seeds of the first pass of each turn; further passes have the following seeds."""
_PROGRESS_STEPS_BY_RENDERER = {"ours": 35, "random-walk": 5, "burley": 2, "path-traced": 20}
"""Relative durations, for the progress bar: a turn of dermis, and one path per pixel of other renderers."""


@dataclass(frozen=True)
class ComparisonSettings:
    """Size of the images, and numbers of paths and frames, for a comparison of renderers.

    side : side of the square image [pixel]
    samples : paths per pixel of each pass of Cycles
    paths : paths per pixel of Mitsuba
    frames : number of frames that are timed with each of the settings of dermis, in each of its turns
    """

    side: int = 512
    samples: tuple[int, ...] = (8, 32, 128)
    paths: int = 64
    frames: int = 5

    @property
    def progress_steps(self) -> int:
        """Return the number of steps of the progress bar for one scene."""
        cycles = (
            len(FIRST_SEED_BY_TURN)
            * sum(self.samples)
            * (_PROGRESS_STEPS_BY_RENDERER["random-walk"] + _PROGRESS_STEPS_BY_RENDERER["burley"])
        )
        ours = (len(FIRST_SEED_BY_TURN) * len(CYCLES_METHODS) + 2) * _PROGRESS_STEPS_BY_RENDERER["ours"]
        return ours + cycles + self.paths * _PROGRESS_STEPS_BY_RENDERER["path-traced"]


@dataclass
class FrameTimes:
    """Image that dermis renders with one of the compared settings, and times of its frames.

    seconds : elapsed times of the frames [s]
    core_seconds : CPU times of the frames [s]
    """

    image: NDArray[np.float32]
    seconds: list[float] = field(default_factory=list)
    core_seconds: list[float] = field(default_factory=list)


@dataclass
class SceneRenders:
    """Pictures and times of all renderers for one scene.

    light : name of the scene's light
    region : name of the visible region
    ours : dictionary from a name in `DERMIS_VARIANTS` or `GPU_GEMS_3_VARIANTS` to frames of dermis
    cycles : dictionary from a method of Cycles to two lists of images, rendered with different random seeds;
        each list has one image for each number of paths in `ComparisonSettings.samples`
    left_out : dictionary from a missing method of Cycles to the reason why it is missing
    reference : path-traced image by Mitsuba
    reference_core_seconds : CPU time of Mitsuba, including loading of the scene [s]
    """

    light: str
    region: str
    ours: dict[str, FrameTimes]
    cycles: dict[str, list[list[CyclesPass]]]
    left_out: dict[str, str]
    reference: PathTraced
    reference_core_seconds: float


def render_with_all_renderers(
    head: Head,
    light: str,
    comparison_settings: ComparisonSettings,
    renderer: Renderer,
    on_progress: Callable[[int], None] = lambda step_count: None,
) -> SceneRenders:
    """Render a head under one light with all renderers.

    Frames of dermis are timed before, between and after the other renderers.

    on_progress : function called with the number of steps since its last call
    """
    medium = published_media()["skin1"].with_eta(1.0)
    settings = Settings(size=(comparison_settings.side, comparison_settings.side))
    cycles: dict[str, list[list[CyclesPass]]] = {method: [] for method in CYCLES_METHODS}
    ours: dict[str, FrameTimes] = {}
    left_out: dict[str, str] = {}

    def report_pass(passes_done: int, pass_count: int) -> None:
        on_progress(SAMPLES_PER_PASS * _PROGRESS_STEPS_BY_RENDERER["path-traced"])

    scene_context = medium_scene(head, light, default_region(light), medium)
    with TECHNIQUES.temporary_entry(FRAGMENT_TECHNIQUE, FRAGMENT_PASSES), scene_context as (scene, _):
        for seed in FIRST_SEED_BY_TURN:
            for method in CYCLES_METHODS:
                _time_frames(ours, renderer, scene, comparison_settings)
                on_progress(_PROGRESS_STEPS_BY_RENDERER["ours"])
                try:
                    cycles[method].append(
                        _cycles_passes(scene, medium, comparison_settings, settings, method, seed)
                    )
                except DermisError as fault:
                    left_out[method] = str(fault)
                on_progress(_PROGRESS_STEPS_BY_RENDERER[method] * sum(comparison_settings.samples))
        _time_frames(ours, renderer, scene, comparison_settings)
        on_progress(_PROGRESS_STEPS_BY_RENDERER["ours"])
        cpu_started = time.process_time()
        reference = path_trace(
            scene, medium, comparison_settings.paths, settings, use_cache=False, progress=report_pass
        )
        core_seconds = time.process_time() - cpu_started
        _time_frames(ours, renderer, scene, comparison_settings)
        on_progress(_PROGRESS_STEPS_BY_RENDERER["ours"])
    complete = {method: turns for method, turns in cycles.items() if method not in left_out}
    return SceneRenders(light, default_region(light), ours, complete, left_out, reference, core_seconds)


def _cycles_passes(
    scene: Scene,
    medium: Medium,
    comparison_settings: ComparisonSettings,
    settings: Settings,
    subsurface_method: SubsurfaceMethod,
    first_seed: int,
) -> list[CyclesPass]:
    """Render the scene with Cycles, once for each number of paths in `comparison_settings.samples`.

    An earlier pass, in which Cycles builds the scene, is not returned.

    first_seed : random seed of the first pass
    """
    return cycles_passes(
        scene, medium, (1, *comparison_settings.samples), settings, method=subsurface_method, seed=first_seed
    )[1:]


def _time_frames(
    dermis_frames: dict[str, FrameTimes],
    renderer: Renderer,
    scene: Scene,
    comparison_settings: ComparisonSettings,
) -> None:
    """Draw and time frames with each of the compared settings of dermis; each frame recomputes all stages.

    dermis_frames : dictionary from the name of the settings to an image and times; new times are appended
    """
    for name, variant in (DERMIS_VARIANTS | GPU_GEMS_3_VARIANTS).items():
        values = {"technique": variant.technique, "atlas": variant.atlas}
        settings = Settings.model_validate(
            values | {"size": (comparison_settings.side, comparison_settings.side)}
        )
        skin = Skin(**(scene.skin.model_dump() | {"direction": variant.direction}))
        variant_scene = replace(scene, skin=skin)
        drawn = renderer.draw(variant_scene, settings, run_all_passes=True)
        frames = dermis_frames.setdefault(name, FrameTimes(drawn.linear()))
        for _ in range(comparison_settings.frames):
            started, cpu_started = time.perf_counter(), time.process_time()
            renderer.draw(variant_scene, settings, run_all_passes=True)
            frames.seconds.append(time.perf_counter() - started)
            frames.core_seconds.append(time.process_time() - cpu_started)
