"""Renderer: a device with cached resources, to which frames are submitted."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import repeat
from typing import Any, Literal, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_integer
from dermis.base.renamed import renamed_attribute, renamed_keywords
from dermis.frame.features.outputs.landmarks import checked_landmark_sets
from dermis.frame.features.outputs.readback import Readback, start_readback
from dermis.frame.features.post.picture import Picture
from dermis.frame.frame import draw_frame, draw_swing_step
from dermis.frame.frames_in_flight import FRAMES_IN_FLIGHT, SubmitFrame, pipeline_frames
from dermis.frame.hair_motion import HairFrame, HairMotion
from dermis.frame.inputs import FrameInputs
from dermis.frame.observation import Observation, observation_jobs
from dermis.frame.preparation import Preparation
from dermis.frame.programs import start_compiling_common_programs
from dermis.frame.rendered_frame import FrameTextures, RenderedFrame
from dermis.gpu import CommandList, Device, Graph, open_device
from dermis.gpu.command_list import Timing
from dermis.gpu.failures import ReopeningDevice
from dermis.mesh.head import Head
from dermis.optics.bands import Bands
from dermis.scene.conversions import as_model
from dermis.scene.model import Scene
from dermis.scene.outputs import check_outputs
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

T = TypeVar("T")
_MAX_CACHE_SIZE = 1000
_WARM_UP_FRAME_COUNT = 100


class Renderer:
    """Renderer of scenes on one device, which recomputes only what has changed since the previous frame.

    When the driver loses the device, it is opened again and the frame is rendered again.

    Parameters
    ----------
    adapter : str
        "auto", "cpu" or part of the name of an adapter.
    cache_size : int
        Number of variants of each resource that are cached, for callers that alternate between a few scenes.
    cache_ttl : int
        Number of frames after which unused resources are released.
    reopens_lost_device : bool
        Whether a lost device is opened again. If False, DeviceLostError is raised, for callers that keep
        other resources on the device.

    Raises
    ------
    DermisError
        For an unknown adapter, or cache sizes out of range.

    Examples
    --------
    >>> import dermis
    >>> renderer = dermis.Renderer("cpu")
    >>> renderer.device.adapter.kind
    'CPU'
    >>> scene = dermis.Scene(dermis.Human().head(subdivide=0))
    >>> renderer.draw(scene, dermis.Settings(size=64)).srgb8().shape  # doctest: +SKIP
    (64, 64, 3)
    """

    device: Device
    graph: Graph
    draw_warm = renamed_attribute("draw_warm", "draw_after_warm_up")

    @renamed_keywords(depth="cache_size", rounds="cache_ttl", reopens="reopens_lost_device")
    def __init__(
        self,
        adapter: str = "auto",
        cache_size: int = 1,
        *,
        cache_ttl: int = 1,
        reopens_lost_device: bool = True,
    ) -> None:
        if not isinstance(adapter, str):
            actual = f"got {format_value(adapter)}"
            refuse("adapter", "the name of an adapter", actual, "Write auto, cpu or a part of its name")
        self._cache_size = checked_integer("cache_size", cache_size, 1, _MAX_CACHE_SIZE)
        self._cache_ttl = checked_integer("cache_ttl", cache_ttl, 1, _MAX_CACHE_SIZE)
        self._adapter, self._opening_ms = adapter, 0.0
        self._latest: FrameTextures | None = None
        self._in_flight: deque[int] = deque()
        self.reopening_device = ReopeningDevice(
            self._open, self._use_device, reopens_lost_device=reopens_lost_device
        )

    def _open(self) -> Device:
        self._opening_began = time.perf_counter()
        return open_device(self._adapter)

    def _use_device(self, device: Device) -> None:
        """Create the graph and caches of a device that was just opened."""
        start_compiling_common_programs(device)
        self.device, self.graph = device, Graph(device)
        preparation = Preparation(device, self._cache_size, self._cache_ttl)
        self.memo, self.prepare = preparation.memo, preparation.prepare_frame
        self.skin_profile = preparation.profiles.profile
        self._in_flight.clear()
        self._opening_ms = 1e3 * (time.perf_counter() - self._opening_began)

    def clear_cache(self) -> None:
        """Release all cached resources; the next frame creates its resources again."""
        self.memo.clear()
        self.graph.invalidate()

    def _submit(
        self,
        inputs: FrameInputs,
        timed: Timing,
        run_all_passes: bool,
        read_back: Callable[[Graph, Picture], T] | None = None,
        hair_frame: HairFrame | None = None,
    ) -> tuple[CommandList, T | None]:
        """Declare the passes of a frame, run those whose inputs have changed, and start a readback.

        All passes of the frame are in one submission; earlier steps of the swing of hair that are missing are
        submitted before it. Returns the submitted commands of the frame, and the result of `read_back`.

        timed : whether stages or the whole frame are timed, see `draw`
        run_all_passes : whether to run all passes, instead of only the passes whose inputs have changed
        read_back : function that starts the readback of the picture, None for no readback
        hair_frame : frame of an animation in which hair swings, as in `inputs`
        """
        if run_all_passes:
            self.graph.invalidate()
        swing = inputs.swing
        if swing and hair_frame:
            for step in swing.steps[:-1]:
                self.graph.begin()
                draw_swing_step(self.graph, inputs, step)
                self.graph.submit()
                hair_frame.motion.mark_done(swing.buffers, step.frame)
        self.graph.begin()
        draw_frame(self.graph, inputs, TECHNIQUES[inputs.settings.technique])
        readback = read_back(self.graph, inputs.resources.post.picture) if read_back else None
        frame, self._latest = self.graph.submit(timed), None
        if swing and hair_frame:
            hair_frame.motion.mark_done(swing.buffers, hair_frame.frame_index)
        return frame, readback

    def _limit_frames_in_flight(self, frame: CommandList) -> None:
        self._in_flight.append(frame.submitted)
        while len(self._in_flight) > FRAMES_IN_FLIGHT:
            self.device.wait(self._in_flight.popleft())

    def _start_readback(self, picture: Picture, alpha_settings: Settings | None) -> Readback:
        self.graph.begin()
        readback = start_readback(self.graph, picture, alpha_settings=alpha_settings)
        self.graph.submit()
        return readback

    def _submit_readback(
        self,
        scene: Scene,
        previous: Scene | None = None,
        *,
        settings: Settings,
        linear: bool,
        alpha: bool,
        outputs: tuple[str, ...] = (),
        landmarks: tuple[str, ...] = (),
        hair_frame: HairFrame | None = None,
    ) -> Readback:
        """Submit a frame together with the readback of its picture and outputs.

        previous : scene of the same head for motion vectors; without it, motion is 0
        linear : whether the picture is linear Rec. 709 instead of sRGB bytes
        alpha : whether the picture gets the coverage by the head as alpha
        outputs : names of outputs besides the picture
        landmarks : names of landmark sets
        hair_frame : frame of an animation in which hair swings
        """
        inputs = self.prepare(scene, settings, "", outputs, previous, landmarks, hair_frame)
        coverage, extra = settings if alpha else None, inputs.resources.outputs
        read_back = partial(start_readback, as_linear=linear, alpha_settings=coverage, outputs=extra)
        _, readback = self._submit(inputs, False, False, read_back, hair_frame)
        assert readback is not None
        return readback

    @renamed_keywords(anew="run_all_passes", force="run_all_passes")
    def draw(
        self,
        scene: Scene,
        settings: Settings | None = None,
        *,
        run_all_passes: bool = False,
        timed: Timing = True,
        view: str = "",
        outputs: Iterable[str] = (),
        previous: Scene | None = None,
        hair_frame: HairFrame | None = None,
        bands: Bands | None = None,
    ) -> RenderedFrame:
        """Render one frame and leave the picture on the device.

        Parameters
        ----------
        scene : Scene or Head
            Scene, or a head alone with default light and camera.
        settings : Settings, optional
            Size, technique and other settings.
        run_all_passes : bool
            Whether to run all passes, instead of only the passes whose inputs have changed.
        timed : bool or "whole"
            True times each stage in a separate pass, which makes the frame slower. "whole" times the frame as
            one pass. False returns as soon as the frame is submitted, and waits only if three frames are in
            flight.
        view : str
            Name under which light and shadows of the scene are cached, for callers that draw several scenes
            in turn.
        outputs : iterable of str
            Names of outputs for `RenderedFrame.output`.
        previous : Scene, optional
            Scene of the same head for motion vectors. Without it, motion is 0.
        hair_frame : HairFrame, optional
            Frame of an animation in which hair swings, from `HairMotion.advance` for the same scene. Without
            it, hair follows the head stiffly.
        bands : Bands, optional
            Three wavelengths in the place of red, green and blue, see `render_spectrum`.

        Returns
        -------
        RenderedFrame
            Picture on the device, valid until the next frame.

        Raises
        ------
        DermisError
            For sizes that exceed the limits of the device, and if the device fails.

        Examples
        --------
        >>> import dermis
        >>> scene = dermis.Scene(dermis.Human().head(subdivide=0))
        >>> frame = dermis.Renderer("cpu").draw(scene, outputs=["depth"])  # doctest: +SKIP
        >>> frame.output("depth").shape  # doctest: +SKIP
        (512, 512)
        """
        settings = as_model(Settings, settings or {}, "settings", "size=(512, 512)")
        previous = previous and Scene.coerce(previous)
        prepared = (
            Scene.coerce(scene),
            settings,
            view,
            check_outputs(outputs),
            previous,
            (),
            hair_frame,
            bands,
        )
        return self.reopening_device.run(partial(self._draw, run_all_passes, timed, *prepared))

    def _draw(self, run_all_passes: bool, timed: Timing, *prepared: Any) -> RenderedFrame:
        """Render one frame and leave the picture on the device.

        run_all_passes, timed : as in `draw`
        prepared : arguments of `Preparation.prepare_frame`
        """
        started = time.perf_counter()
        inputs = self.prepare(*prepared)
        ready = time.perf_counter()
        frame, _ = self._submit(inputs, timed, run_all_passes, hair_frame=prepared[-2])
        if timed:
            frame.wait()
        else:
            self._limit_frames_in_flight(frame)
        done = time.perf_counter()
        times = frame.stage_ms() if timed else None
        setup_ms, resources = 1e3 * (ready - started) + self._opening_ms, inputs.resources
        self._opening_ms = 0.0
        post = resources.post
        textures = FrameTextures(self.device, post.picture, post.meter, resources.outputs)
        self._latest = textures

        def redraw() -> None:
            vars(textures).update(vars(self._draw(run_all_passes, timed, *prepared).textures))
            self._latest = textures

        return RenderedFrame(
            textures,
            times,
            1e3 * (done - ready),
            setup_ms,
            resources.gaussians,
            resources.unscattered_fraction,
            resources.suns,
            inputs.settings,
            self._start_readback,
            partial(self._run_on_device, textures, redraw),
            is_current=lambda: self._latest is textures,
        )

    def _run_on_device(self, textures: FrameTextures, redraw: Callable[[], None], job: Callable[[], T]) -> T:
        """Run a job that reads a frame; return its result. If the device was lost, redraw the frame first.

        textures : textures of the frame, which `redraw` replaces
        redraw : function that draws the frame again
        job : function to run
        """

        def run() -> T:
            if textures.device is not self.device:
                redraw()
            return job()

        return self.reopening_device.run(run)

    def draw_after_warm_up(self, scene: Scene, settings: Settings | None = None) -> RenderedFrame:
        """Render a scene to measure its times, after warm-up frames that bring a GPU to its full clock rate.

        Software adapters render without warm-up frames.

        Parameters
        ----------
        scene : Scene
            Scene to render.
        settings : Settings, optional
            Size, technique and other settings.
        """
        rendered = self.draw(scene, settings, run_all_passes=True)
        if self.device.adapter.kind == "CPU":
            return rendered
        for _ in range(_WARM_UP_FRAME_COUNT):
            self.draw(scene, settings, run_all_passes=True, timed=False)
        self.device.wait()
        return self.draw(scene, settings, run_all_passes=True)

    def render(self, scene: Scene | Head, **settings: Any) -> NDArray[np.float32]:
        """Return the picture of a scene.

        Parameters
        ----------
        scene : Scene or Head
            Scene, or a head alone with default light and camera.
        **settings
            Fields of `Settings`.

        Returns
        -------
        ndarray
            (h, w, 3) float32 linear Rec. 709 [-].
        """
        return self.draw(Scene.coerce(scene), Settings(**settings)).linear()

    @overload
    def render_many(
        self,
        scenes: Iterable[Scene],
        *,
        linear: Literal[False] = False,
        alpha: bool = False,
        hair_motion: HairMotion | None = None,
        **settings: Any,
    ) -> Iterator[NDArray[np.uint8]]: ...

    @overload
    def render_many(
        self,
        scenes: Iterable[Scene],
        *,
        linear: Literal[True],
        alpha: bool = False,
        hair_motion: HairMotion | None = None,
        **settings: Any,
    ) -> Iterator[NDArray[np.float32]]: ...

    def render_many(
        self,
        scenes: Iterable[Scene],
        *,
        linear: bool = False,
        alpha: bool = False,
        hair_motion: HairMotion | None = None,
        **settings: Any,
    ) -> Iterator[NDArray[Any]]:
        """Yield the picture of each scene, while the next scenes are rendered.

        Parameters
        ----------
        scenes : iterable of Scene
            Scenes to render; heads and textures that they share are loaded once.
        linear : bool
            True yields float32 linear Rec. 709 instead of sRGB bytes.
        alpha : bool
            True adds the coverage by the head as alpha; floats are multiplied by it, bytes are not.
        hair_motion : HairMotion, optional
            Motion of hair, which each scene advances by a frame. Without it, hair follows the head stiffly.
        **settings
            Fields of `Settings`, for all scenes.

        Yields
        ------
        ndarray
            (h, w, 3) picture or, with alpha, (h, w, 4) picture.

        Raises
        ------
        DermisError
            For sizes that exceed the limits of the device, and if the device fails.
        """
        submit = partial(self._submit_readback, settings=Settings(**settings), linear=linear, alpha=alpha)

        def submission(scene: Scene) -> SubmitFrame:
            hair_frame = None if hair_motion is None else hair_motion.advance(scene)
            return partial(submit, scene, hair_frame=hair_frame)

        frames = ((submission(Scene.coerce(scene)), Readback.image) for scene in scenes)
        yield from pipeline_frames(self.reopening_device, lambda: self.device, frames)

    def observe(
        self,
        scenes: Iterable[Scene],
        settings: Settings | Iterable[Settings] | None = None,
        *,
        outputs: Iterable[str] = (),
        alpha: bool = False,
        linear: bool = False,
        previous: Scene | Iterable[Scene | None] | None = None,
        landmarks: Iterable[str] = (),
    ) -> Iterator[Observation]:
        """Yield the picture and the ground truth of each scene, while the next scenes are rendered.

        Parameters
        ----------
        scenes : iterable of Scene
            Scenes to render; heads and textures that they share are loaded once.
        settings : Settings or iterable of Settings, optional
            Settings of all scenes, or of each scene.
        outputs : iterable of str
            Names of outputs besides the picture.
        alpha : bool
            True adds the coverage by the head as alpha; floats are multiplied by it, bytes are not.
        linear : bool
            True returns float32 linear Rec. 709 instead of sRGB bytes.
        previous : Scene or iterable of Scene, optional
            Previous scenes, from which motion vectors are computed: an iterable with a previous scene for
            each scene, or a single scene that precedes the first scene. In the latter case, each later scene
            uses the scene before it, if the head is the same.
        landmarks : iterable of str
            Landmark sets (keys of `dermis.human.landmarks.sets.LANDMARK_SETS`), or files of rows name,vertex.

        Yields
        ------
        Observation
            Picture, outputs, camera, landmarks, head pose and gaze.

        Raises
        ------
        DermisError
            For sizes that exceed the limits of the device, and if the device fails.
        """
        if settings is None or isinstance(settings, Settings | Mapping):
            settings = repeat(as_model(Settings, settings or {}, "settings", "size=(512, 512)"))
        names, sets = check_outputs(outputs), checked_landmark_sets(landmarks)
        submit = partial(self._submit_readback, linear=linear, alpha=alpha, outputs=names, landmarks=sets)
        jobs = observation_jobs(submit, scenes, previous, settings)
        return pipeline_frames(self.reopening_device, lambda: self.device, jobs)


def render(scene: Scene | Head, adapter: str = "auto", **settings: Any) -> NDArray[np.float32]:
    """Return the picture of a scene; for many pictures, use one `Renderer`.

    Parameters
    ----------
    scene : Scene or Head
        Scene, or a head alone with studio light and the camera of a portrait.
    adapter : str
        "auto", "cpu" or part of the name of an adapter.
    **settings
        Fields of `Settings`: size, atlas, samples, technique, exposure, ...

    Returns
    -------
    ndarray
        (h, w, 3) float32 linear Rec. 709 [-].

    Raises
    ------
    DermisError
        For invalid settings, an unknown adapter, sizes that exceed the limits of the device, or a device
        failure.

    References
    ----------
    [dEonLuebke2007] for the technique, `docs/pipeline.md` for all stages.

    Examples
    --------
    >>> import dermis
    >>> scene = dermis.Scene(dermis.Human().head(subdivide=0))
    >>> dermis.render(scene, adapter="cpu", size=64).shape  # doctest: +SKIP
    (64, 64, 3)
    """
    if not isinstance(adapter, str):
        advice = "Write dermis.Renderer().draw(scene, settings).linear() for a Settings object"
        expected = "the name of an adapter, and settings by keyword"
        refuse("adapter", expected, f"got {format_value(adapter)}", advice)
    return Renderer(adapter).render(Scene.coerce(scene), **settings)
