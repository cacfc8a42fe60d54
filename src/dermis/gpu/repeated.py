"""Dispatches that are the same in every frame: recorded once, then repeated."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import partial
from typing import Any, NoReturn

from dermis.gpu.device import Device
from dermis.gpu.frame import Frame, Step
from dermis.gpu.program import ComputeProgram, Resources
from dermis.gpu.uniforms import CHUNK_BYTES, Uniforms


class Recording(Frame):
    """Takes dispatches as a frame does, and keeps them with the numbers they read.

    It keeps no texture alive: what it would bind goes when its last owner does. The recording is void then,
    and its numbers go too.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._chunks: list[Any] = []
        self._uniforms = Uniforms(device, partial(_chunk, device, self._chunks))
        self._steps: list[
            tuple[str, Any, list[tuple[weakref.ref[Any], list[int]]], tuple[int, int, int]]
        ] = []

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Resources, groups: tuple[int, int, int]
    ) -> None:
        """Keep a dispatch."""
        chunks = self._chunks  # and not the recording, which would keep itself alive

        def void(_: Any) -> None:
            chunks.clear()

        bound = program.bind_groups(resources, self._uniforms)
        weak = [(weakref.ref(group, void), offsets) for group, offsets in bound]
        self._steps.append((stage, program.pipeline, weak, groups))

    def submit(self) -> None:
        """Put the numbers in their place; the dispatches run where a frame repeats them."""
        self._uniforms.upload()
        del self._uniforms  # it holds on to the buffers

    def steps(self) -> list[Step] | None:
        """The dispatches; None when something they bind is gone."""
        steps = [
            (stage, pipeline, [(group(), offsets) for group, offsets in weak], groups)
            for stage, pipeline, weak, groups in self._steps
        ]
        alive = all(group is not None for _, _, bound, _ in steps for group, _ in bound)
        return steps if alive else None

    def clear(self, *_: Any, **__: Any) -> NoReturn:
        """Dispatches only."""
        raise TypeError("only dispatches can be repeated")

    copy = fetch = draw = clear


def _chunk(device: Device, chunks: list[Any], index: int) -> Any:
    if index == len(chunks):
        chunks.append(device.uniform_buffer(CHUNK_BYTES))
    return chunks[index]


class Repeated:
    """For each role the recording made last."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[Any, Recording]] = {}

    def draw(self, frame: Frame, role: str, key: Any, record: Callable[[Frame], object]) -> None:
        """Repeat what `record` did when it was last called for this role, or call it when the key is another.

        key : everything that it reads
        """
        known = self._known.get(role)
        if known and known[0] == key and (steps := known[1].steps()) is not None:
            frame.repeat(steps)
            return
        recording = Recording(frame.device)
        record(recording)
        recording.submit()
        self._known[role] = key, recording
        steps = recording.steps()
        assert steps is not None, "what was just bound is gone"
        frame.repeat(steps)
