"""Dispatches that are the same in every frame: recorded once, then repeated."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NoReturn, TypeVar

from dermis.gpu.compute_pass import Step
from dermis.gpu.device import Device
from dermis.gpu.frame import Frame, step_of
from dermis.gpu.program import ComputeProgram, Resources
from dermis.gpu.uniforms import CHUNK_BYTES, Uniforms

T = TypeVar("T")
_MOST = 4  # recordings of a role: two states, each in motion and still


class Recording(Frame):
    """Takes dispatches as a frame does, and keeps them with the numbers they read.

    It keeps no texture alive: what it would bind goes when its last owner does. The recording is void then,
    and its numbers go too.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._chunks: list[Any] = []
        self._uniforms = Uniforms(device, partial(_chunk, device, self._chunks))
        self._steps: list[Step] = []
        self._pipelines: list[Any] = []
        self._bound: list[weakref.ref[Any]] = []

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Resources, groups: tuple[int, int, int]
    ) -> None:
        """Keep a dispatch."""
        chunks, steps = self._chunks, self._steps  # and not the recording, which would keep itself alive

        def void(_: Any) -> None:
            chunks.clear()
            steps.clear()

        group, offsets = program.bind_group(resources, self._uniforms)
        self._bound.append(weakref.ref(group, void))
        self._pipelines.append(program.pipeline)
        # as the native library takes them, so that no frame needs to convert them
        kept = program.device.ffi.new("uint32_t[]", offsets)
        steps.append(step_of(stage, program, group, kept, groups))

    def submit(self) -> None:
        """Put the numbers in their place; the dispatches run where a frame repeats them."""
        self._uniforms.upload()
        self._uniforms.finish()
        del self._uniforms  # it holds on to the buffers

    def steps(self) -> Sequence[Step] | None:
        """The dispatches; None when something they bind is gone."""
        return self._steps if len(self._steps) == len(self._pipelines) else None

    def clear(self, *_: Any, **__: Any) -> NoReturn:
        """Dispatches only."""
        raise TypeError("only dispatches can be repeated")

    copy = fetch = draw = fill = clear


def _chunk(device: Device, chunks: list[Any], index: int) -> Any:
    if index == len(chunks):
        chunks.append(device.uniform_buffer(CHUNK_BYTES))
    return chunks[index]


class Repeated:
    """For each role the recordings used last, for who goes back and forth between some."""

    def __init__(self) -> None:
        self._known: dict[str, list[tuple[Any, Recording, Any]]] = {}

    def draw(self, frame: Frame, role: str, key: Any, record: Callable[[Frame], T]) -> T:
        """Repeat what `record` did for this role and key, or call it when that is not known any more.

        key : everything that it reads

        Returns what it returned.
        """
        known = self._known.setdefault(role, [])
        index = next((k for k, one in enumerate(known) if one[0] == key), None)
        found = known.pop(index) if index is not None else None
        steps = found[1].steps() if found else None
        if found is None or steps is None:
            recording = Recording(frame.device)
            found = key, recording, record(recording)
            recording.submit()
            steps = recording.steps()
            assert steps is not None, "what was just bound is gone"
        known.insert(0, found)
        del known[_MOST:]
        frame.repeat(steps)
        result: T = found[2]
        return result
