"""Frames submitted to a device, and what of them is read back."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from dermis.frame.frame import draw_frame
from dermis.frame.in_flight import IN_FLIGHT
from dermis.frame.inputs import Inputs
from dermis.frame.passes import pack
from dermis.frame.passes.pack import Leaving
from dermis.frame.passes.post import Picture
from dermis.frame.preparation import Preparation
from dermis.frame.rendered import Shown
from dermis.gpu import CommandList, Device, Graph
from dermis.gpu.command_list import Timed
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

T = TypeVar("T")


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
        leaving = leave(self.graph, inputs.resources.picture) if leave else None
        frame, self._last = self.graph.submit(timed), None
        return frame, leaving

    def _keep_pace(self, frame: CommandList) -> None:
        """Wait until no more frames than allowed are in flight."""
        self._in_flight.append(frame.submitted)
        while len(self._in_flight) > IN_FLIGHT:
            self.device.wait(self._in_flight.popleft())

    def _leave(self, picture: Picture, **how: Any) -> Leaving:
        self.graph.begin()
        leaving = pack.draw(self.graph, picture, **how)
        self.graph.submit()
        return leaving

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
    ) -> Leaving:
        """Submit a frame and start reading it back."""
        inputs = self.prepare(scene, settings, "", outputs, previous, landmarks)
        coverage, more = settings if alpha else None, inputs.resources.outputs
        leave = partial(pack.draw, linear=linear, alpha=coverage, outputs=more)
        _, leaving = self._submit(inputs, False, False, leave)
        assert leaving is not None
        return leaving
