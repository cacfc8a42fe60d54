"""Runs of compute passes whose bindings stay the same: recorded once, then replayed."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from functools import cached_property, partial
from typing import Any, TypeVar, TypeVarTuple

import numpy as np

from dermis.gpu.bind_groups import BindGroup
from dermis.gpu.command_list import Step, step_of
from dermis.gpu.dependencies import Access, Slot, new_number, resource_state
from dermis.gpu.device import Device
from dermis.gpu.memo import field_names, is_value, same
from dermis.gpu.program import ComputeProgram
from dermis.gpu.recorder import Groups, Recorder
from dermis.gpu.types import Bindings, Buffer, Native
from dermis.gpu.uniforms import CHUNK_BYTES, Uniforms

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
_MOST = 4  # recordings of a function: two states, each in motion and still


class Recording(Recorder):
    """Takes dispatches as a graph does, and keeps them with the numbers they read.

    It keeps no texture alive: what it would bind goes when its last owner does. The recording is void then,
    and its numbers go too.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.steps: list[Step] = []
        self._chunks: list[Buffer] = []
        self._uniforms: Uniforms | None = Uniforms(device, partial(_chunk, device, self._chunks))
        self._pipelines: list[Native] = []
        self._bound: list[weakref.ref[BindGroup]] = []
        self._reads: dict[Slot, None] = {}
        self._writes: dict[Slot, None] = {}

    @cached_property
    def access(self) -> Access:
        """What it finds written and what it leaves written, scratch aside; once it is finished."""
        left = tuple(slot for slot in self._writes if not slot.scratch)
        return Access(new_number(), tuple(self._reads), left)

    @cached_property
    def stages(self) -> tuple[str, ...]:
        """Each once."""
        return tuple(dict.fromkeys(step.stage for step in self.steps))

    @property
    def is_void(self) -> bool:
        """Whether something that it binds is gone."""
        return len(self.steps) != len(self._pipelines)

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Groups, completes: str = ""
    ) -> None:
        """Keep a pass, as `Graph.dispatch` declares one."""
        chunks, steps = self._chunks, self.steps  # and not the recording, which would keep itself alive

        def void(_: object) -> None:
            chunks.clear()
            steps.clear()

        assert self._uniforms is not None, "a recording is made once"
        group, offsets = program.bind_group(resources, self._uniforms)
        self._bound.append(weakref.ref(group, void))
        self._pipelines.append(program.pipeline)
        steps.append(step_of(stage, program, group, offsets, groups))
        self._note(program, resources, completes)

    def _note(self, program: ComputeProgram, resources: Bindings, completes: str) -> None:
        access = program.access(resources)
        for slot in access.reads:
            if slot not in self._writes and slot not in access.writes:
                self._reads[slot] = None
        filled = resource_state(self.device, resources[completes]) if completes else None
        self._writes |= dict.fromkeys(slot for slot in access.writes if slot is not filled)

    def finish(self) -> None:
        """Put the numbers in their place."""
        assert self._uniforms is not None
        self._uniforms.upload()
        self._uniforms.finish()
        self._uniforms = None  # it holds on to the buffers


def _chunk(device: Device, chunks: list[Buffer], index: int) -> Buffer:
    if index == len(chunks):
        chunks.append(device.uniform_buffer(CHUNK_BYTES))
    return chunks[index]


class Recordings:
    """For each function the recordings used last, for who goes back and forth between some."""

    def __init__(self) -> None:
        self._known: dict[Callable[..., object], list[tuple[object, Recording, Any]]] = {}

    def find(
        self, device: Device, record: Callable[[Recorder, *Ts], T], args: tuple[*Ts]
    ) -> tuple[Recording, T]:
        """What `record` did for these arguments and what it returned; it is called when that is not known."""
        known = self._known.setdefault(record, [])
        found = next((one for one in known if not one[1].is_void and _alike(one[0], args)), None)
        if found is None:
            recording = Recording(device)
            result = record(recording, *args)
            recording.finish()
            assert not recording.is_void, "what was just bound is gone"
            found = _held_weakly(args), recording, result
        if not known or known[0] is not found:
            known[:] = [found, *(one for one in known if one is not found)][:_MOST]
        return found[1], found[2]


@dataclass(frozen=True)
class _Values:
    """The fields of a dataclass, held weakly."""

    kind: type
    fields: tuple[object, ...]


def _held_weakly(value: object) -> object:
    """A value, with references in the place of what it would keep alive."""
    if isinstance(value, tuple):
        return tuple(map(_held_weakly, value))
    if isinstance(value, np.ndarray):
        return value.copy()
    if not is_value(value):
        return weakref.ref(value) if value is not None else None
    if not is_dataclass(value):
        return value
    held = _fields(value)
    return _Values(type(value), held) if any(map(_is_weak, held)) else value


def _is_weak(held: object) -> bool:
    return isinstance(held, weakref.ref | _Values) or (isinstance(held, tuple) and any(map(_is_weak, held)))


def _fields(value: object) -> tuple[object, ...]:
    kind: Any = type(value)
    return tuple(_held_weakly(getattr(value, name)) for name in field_names(kind) or ())


def _alike(held: object, value: object) -> bool:
    if isinstance(held, weakref.ref):
        return held() is value
    if isinstance(held, tuple):
        return isinstance(value, tuple) and len(held) == len(value) and all(map(_alike, held, value))
    if isinstance(held, _Values):
        kind: Any = type(value)
        if kind is not held.kind:
            return False
        parts = (getattr(value, name) for name in field_names(kind) or ())
        return all(map(_alike, held.fields, parts))
    return same(held, value)
