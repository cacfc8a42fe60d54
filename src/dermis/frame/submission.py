"""Submission of frames: a few are in flight, so that Python and the device overlap."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, TypeVar

from dermis.frame.features.outputs.readback import Readback, start_readback
from dermis.frame.features.post.picture import Picture
from dermis.frame.frame import draw_frame
from dermis.frame.inputs import Inputs
from dermis.frame.preparation import Preparation
from dermis.frame.rendered import Shown
from dermis.gpu import CommandList, Device, Graph
from dermis.gpu.command_list import Timed
from dermis.gpu.failures import ReopeningDevice
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

T = TypeVar("T")
IN_FLIGHT = 3
"""Frames submitted and not done: Python and the device overlap, with little latency."""

Send = Callable[[], Readback]
Take = Callable[[Readback], T]


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
        self, inputs: Inputs, timed: Timed, anew: bool, leave: Callable[[Graph, Picture], T] | None = None
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
