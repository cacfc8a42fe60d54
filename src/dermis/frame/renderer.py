"""The renderer: a device with all that it keeps from frame to frame, and the submission of frames."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import repeat
from typing import Any, Literal, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse, shown_value
from dermis.base.quantities import whole_number
from dermis.frame.features.outputs.landmarks import checked_landmarks
from dermis.frame.features.outputs.readback import Readback, start_readback
from dermis.frame.features.post.picture import Picture
from dermis.frame.frame import draw_frame
from dermis.frame.inputs import Inputs
from dermis.frame.observation import Observation, observed_frames
from dermis.frame.preparation import Preparation
from dermis.frame.programs import warm_up
from dermis.frame.rendered import Rendered, Shown
from dermis.gpu import CommandList, Device, Graph, open_device
from dermis.gpu.command_list import Timing
from dermis.gpu.failures import ReopeningDevice
from dermis.mesh.head import Head
from dermis.scene.given import given_plain
from dermis.scene.model import Scene
from dermis.scene.outputs import checked_outputs
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

T = TypeVar("T")
IN_FLIGHT = 3
"""Frames submitted and not done: Python and the device overlap, with little latency."""

Send = Callable[[], Readback]
Take = Callable[[Readback], T]
_DEEPEST = 1000
_WARMING_FRAMES = 100


def arriving(
    kept_open: ReopeningDevice, device: Callable[[], Device], frames: Iterable[tuple[Send, Take[T]]]
) -> Iterator[T]:
    """What is taken of each frame in turn; it is sent again where its device was lost meanwhile.

    device : the one of now
    frames : what submits each of them, and what takes what has arrived of it
    """
    sent: deque[tuple[Readback, Send, Take[T]]] = deque()

    def arrived() -> T:
        readback, send, take = sent.popleft()
        return kept_open.run(lambda: take(readback if readback.fetched.device is device() else send()))

    for send, take in frames:
        sent.append((kept_open.run(send), send, take))
        if len(sent) >= IN_FLIGHT:
            yield arrived()
    while sent:
        yield arrived()


class Submitter:
    """Declares frames on a device, and submits what of them is stale."""

    device: Device
    graph: Graph

    def __init__(self) -> None:
        self._last: Shown | None = None
        self._in_flight: deque[int] = deque()

    def on(self, device: Device, depth: int, rounds: int) -> None:
        """Make what is kept from frame to frame on a device."""
        self.device, self.graph = device, Graph(device)
        preparation = Preparation(device, depth, rounds)
        self.memo, self.prepare = preparation.memo, preparation.inputs
        self.profile_of = preparation.profiles.of
        self._in_flight.clear()

    def _submit(
        self, inputs: Inputs, timed: Timing, anew: bool, leave: Callable[[Graph, Picture], T] | None = None
    ) -> tuple[CommandList, T | None]:
        """Declare a frame and run its stale passes.

        leave : starts reading the picture back in the same submission
        """
        if anew:
            self.graph.forget()
        self.graph.begin()
        draw_frame(self.graph, inputs, TECHNIQUES[inputs.settings.technique])
        readback = leave(self.graph, inputs.resources.post.picture) if leave else None
        frame, self._last = self.graph.submit(timed), None
        return frame, readback

    def _keep_pace(self, frame: CommandList) -> None:
        """Wait until no more frames than allowed are in flight."""
        self._in_flight.append(frame.submitted)
        while len(self._in_flight) > IN_FLIGHT:
            self.device.wait(self._in_flight.popleft())

    def _leave(self, picture: Picture, **how: Any) -> Readback:
        self.graph.begin()
        readback = start_readback(self.graph, picture, **how)
        self.graph.submit()
        return readback

    def _send(
        self,
        scene: Scene,
        previous: Scene | None = None,
        *,
        settings: Settings,
        linear: bool,
        alpha: bool,
        outputs: tuple[str, ...] = (),
        landmarks: tuple[str, ...] = (),
    ) -> Readback:
        """Submit a frame and start reading it back."""
        inputs = self.prepare(scene, settings, "", outputs, previous, landmarks)
        coverage, more = settings if alpha else None, inputs.resources.outputs
        leave = partial(start_readback, linear=linear, alpha=coverage, outputs=more)
        _, readback = self._submit(inputs, False, False, leave)
        assert readback is not None
        return readback


class Renderer(Submitter):
    """Renders scenes on one device; what does not change between two frames is not computed again.

    A device that its driver loses is opened again, and the frame drawn anew.

    adapter : "auto", "cpu" or part of an adapter's name
    depth : how many variants of each resource are kept, for callers that alternate between a few
    rounds : frames for which resources are kept that none of them needs
    reopens : False raises DeviceLostError instead, for callers that keep resources of their own on the device
    """

    def __init__(
        self, adapter: str = "auto", depth: int = 1, *, rounds: int = 1, reopens: bool = True
    ) -> None:
        if not isinstance(adapter, str):
            refuse("adapter", "its name", f"{shown_value(adapter)} came", "Write auto, cpu or a part of it")
        super().__init__()
        self._depth = whole_number("depth", depth, 1, _DEEPEST)
        self._rounds = whole_number("rounds", rounds, 1, _DEEPEST)
        self._adapter, self._opening_ms = adapter, 0.0
        self.kept_open = ReopeningDevice(self._open, self._adopt, reopens=reopens)

    def _open(self) -> Device:
        self._opening_began = time.perf_counter()
        return open_device(self._adapter)

    def _adopt(self, device: Device) -> None:
        """Make what is kept from frame to frame on a device that was just opened."""
        warm_up(device)
        self.on(device, self._depth, self._rounds)
        self._opening_ms = 1e3 * (time.perf_counter() - self._opening_began)

    def forget(self) -> None:
        """Forget all that is kept; the next frame makes it again."""
        self.memo.forget()
        self.graph.forget()

    def draw(
        self,
        scene: Scene,
        settings: Settings | None = None,
        *,
        anew: bool = False,
        timed: Timing = True,
        view: str = "",
        outputs: Iterable[str] = (),
        previous: Scene | None = None,
    ) -> Rendered:
        """Render one frame and leave the image on the device.

        anew : True runs all passes, not only stale ones
        timed : True times each stage in a pass of its own, which takes longer than the frame otherwise does;
            "whole" times only the frame, with its stages in one pass; False returns as soon as the frame is
            submitted, and waits only for a device that is three frames behind
        view : name of a scene among several drawn in turn: each keeps light and shadows of its own
        outputs : names of what else is wanted of the frame, for `Rendered.output`
        previous : scene of the same head that motion is counted from; without it there is none

        Raises DermisError for sizes over the device's limits and when the device fails.
        """
        settings = given_plain(Settings, settings or {}, "settings", "size=(512, 512)")
        what = Scene.of(scene), settings, view, checked_outputs(outputs), previous and Scene.of(previous)
        return self.kept_open.run(partial(self._draw, anew, timed, *what))

    def _draw(self, anew: bool, timed: Timing, *what: Any) -> Rendered:
        """what : that is prepared"""
        started = time.perf_counter()
        inputs = self.prepare(*what)
        ready = time.perf_counter()
        frame, _ = self._submit(inputs, timed, anew)
        if timed:
            frame.wait()
        else:
            self._keep_pace(frame)
        done = time.perf_counter()
        times = frame.stage_ms() if timed else None
        setup_ms, made = 1e3 * (ready - started) + self._opening_ms, inputs.resources
        self._opening_ms = 0.0
        shown = self._last = Shown(self.device, made.post.picture, made.post.meter, made.outputs)

        def again() -> None:
            vars(shown).update(vars(self._draw(anew, timed, *what).shown))
            self._last = shown

        return Rendered(
            shown,
            times,
            1e3 * (done - ready),
            setup_ms,
            made.gaussians,
            made.unscattered,
            made.suns,
            inputs.settings,
            self._leave,
            partial(self._on_device, shown, again),
            is_current=lambda: self._last is shown,
        )

    def _on_device(self, shown: Shown, again: Callable[[], None], job: Callable[[], T]) -> T:
        """Do a job for which a frame has to be on the device, where it is drawn again after a loss."""

        def do() -> T:
            if shown.device is not self.device:
                again()
            return job()

        return self.kept_open.run(do)

    def draw_warm(self, scene: Scene, settings: Settings | None = None) -> Rendered:
        """A frame timed on a device at work: a GPU that was idle runs at a fraction of its clock rate."""
        rendered = self.draw(scene, settings, anew=True)
        if self.device.adapter.kind == "CPU":
            return rendered
        for _ in range(_WARMING_FRAMES):
            self.draw(scene, settings, anew=True, timed=False)
        self.device.wait()
        return self.draw(scene, settings, anew=True)

    def render(self, scene: Scene | Head, **settings: Any) -> NDArray[np.float32]:
        """(h, w, 3) float32 linear Rec. 709 image; `settings` are those of `Settings`."""
        return self.draw(Scene.of(scene), Settings(**settings)).linear()

    @overload
    def render_many(
        self, scenes: Iterable[Scene], *, linear: Literal[False] = False, alpha: bool = False, **settings: Any
    ) -> Iterator[NDArray[np.uint8]]: ...

    @overload
    def render_many(
        self, scenes: Iterable[Scene], *, linear: Literal[True], alpha: bool = False, **settings: Any
    ) -> Iterator[NDArray[np.float32]]: ...

    def render_many(
        self, scenes: Iterable[Scene], *, linear: bool = False, alpha: bool = False, **settings: Any
    ) -> Iterator[NDArray[Any]]:
        """(h, w, 3) sRGB bytes of each scene in turn, each yielded while the next ones are drawn.

        linear : float32 linear Rec. 709 instead, as of `render`
        alpha : (h, w, 4) as of `Rendered.rgba8` and `linear_rgba`
        settings : those of `Settings`, for all of them; heads and textures that scenes share are loaded once

        Raises DermisError as `draw` does.
        """
        send = partial(self._send, settings=Settings(**settings), linear=linear, alpha=alpha)
        frames = ((partial(send, Scene.of(scene)), Readback.image) for scene in scenes)
        yield from arriving(self.kept_open, lambda: self.device, frames)

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
        """What is seen of each scene in turn, each yielded while the next ones are drawn.

        settings : for all of them, or those of each
        outputs : names of what is wanted besides the picture
        alpha, linear : as of `render_many`
        previous : the scene before the first, as motion is counted from one to the next of the same head; or
            those before each
        landmarks : names of sets (`dermis.human.landmarks.sets.SETS`), or files of rows name,vertex

        Raises DermisError as `draw` does.
        """
        if settings is None or isinstance(settings, Settings | Mapping):
            settings = repeat(given_plain(Settings, settings or {}, "settings", "size=(512, 512)"))
        asked = partial(self._send, outputs=checked_outputs(outputs), landmarks=checked_landmarks(landmarks))
        send = partial(asked, linear=linear, alpha=alpha)
        frames = observed_frames(send, scenes, previous, settings)
        return arriving(self.kept_open, lambda: self.device, frames)


def render(scene: Scene | Head, adapter: str = "auto", **settings: Any) -> NDArray[np.float32]:
    """(h, w, 3) float32 linear Rec. 709 image of a scene; for many images keep a `Renderer`.

    scene : or a head alone, which gets studio light and the camera of a portrait
    settings : those of `Settings`: size, atlas, samples, technique, exposure, ...
    """
    if not isinstance(adapter, str):
        remedy = "Write dermis.Renderer().draw(scene, settings).linear() for a Settings object"
        refuse("adapter", "its name, and settings by name", f"{shown_value(adapter)} came", remedy)
    return Renderer(adapter).render(Scene.of(scene), **settings)
