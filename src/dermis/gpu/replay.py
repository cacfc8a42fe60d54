"""Recordings of compute passes, which later frames replay while the bound resources exist."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from functools import cached_property, partial
from typing import Any, TypeVar, TypeVarTuple

import numpy as np

from dermis.gpu.bind_groups import BindGroup
from dermis.gpu.command_list import Dispatch, make_dispatch
from dermis.gpu.dependencies import Access, ResourceState, new_access_id, resource_state
from dermis.gpu.device import Device
from dermis.gpu.memo import are_equal, dataclass_field_names, has_value_equality
from dermis.gpu.program import ComputeProgram
from dermis.gpu.recorder import Recorder, Workgroups
from dermis.gpu.types import Bindings, Buffer, NativeObject
from dermis.gpu.uniforms import UNIFORM_CHUNK_BYTES, Uniforms

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
_MAX_CACHED_RECORDINGS = 4  # recordings per function: for two states, each with a moving and a still head


class Recording(Recorder):
    """Recorded dispatches with their bind groups and uniform buffers, ready to be replayed.

    A recording keeps no resource alive. When one of its resources is released, the recording becomes invalid
    and its uniform buffers are released too.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.dispatches: list[Dispatch] = []
        self._chunks: list[Buffer] = []
        self._uniforms: Uniforms | None = Uniforms(device, partial(_uniform_chunk, device, self._chunks))
        self._pipelines: list[NativeObject] = []
        self._bind_groups: list[weakref.ref[BindGroup]] = []
        self._reads: dict[ResourceState, None] = {}
        self._writes: dict[ResourceState, None] = {}

    @cached_property
    def access(self) -> Access:
        """Return the resources that the recording reads, and the non-scratch resources that it writes."""
        writes = tuple(state for state in self._writes if not state.scratch)
        return Access(new_access_id(), tuple(self._reads), writes)

    @cached_property
    def stages(self) -> tuple[str, ...]:
        """Return the names of the recorded stages without duplicates."""
        return tuple(dict.fromkeys(one.stage for one in self.dispatches))

    @property
    def is_valid(self) -> bool:
        """Return whether all bound resources still exist, so that the recording can be replayed."""
        return len(self.dispatches) == len(self._pipelines)

    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        workgroups: Workgroups,
        in_place_resource: str = "",
    ) -> None:
        """Record a dispatch of a compute program, see `Recorder.dispatch`."""
        chunks, dispatches = self._chunks, self.dispatches  # a reference to self would keep it alive

        def invalidate(_: object) -> None:
            chunks.clear()
            dispatches.clear()

        assert self._uniforms is not None, "a recording is made once"
        group, offsets = program.bind_group(resources, self._uniforms)
        self._bind_groups.append(weakref.ref(group, invalidate))
        self._pipelines.append(program.pipeline)
        dispatches.append(make_dispatch(stage, program, group, offsets, workgroups))
        access = program.resource_access(resources)
        for state in access.reads:
            if state not in self._writes and state not in access.writes:
                self._reads[state] = None
        unchanged = resource_state(self.device, resources[in_place_resource]) if in_place_resource else None
        self._writes |= dict.fromkeys(state for state in access.writes if state is not unchanged)

    def finish(self) -> None:
        """Upload the uniform records; no pass can be added after this."""
        assert self._uniforms is not None
        self._uniforms.upload()
        self._uniforms.finish()
        self._uniforms = None  # it keeps the buffers alive


def _uniform_chunk(device: Device, chunks: list[Buffer], chunk_index: int) -> Buffer:
    if chunk_index == len(chunks):
        chunks.append(device.make_uniform_buffer(UNIFORM_CHUNK_BYTES))
    return chunks[chunk_index]


class RecordingCache:
    """Cache of recorded compute passes, so that functions that add passes need not be called in each frame.

    For each function, the recordings of the most recent sets of arguments are kept, because some callers
    alternate between a few sets.
    """

    def __init__(self) -> None:
        self._recordings: dict[Callable[..., object], list[tuple[object, Recording, Any]]] = {}

    def get(
        self, device: Device, record_passes: Callable[[Recorder, *Ts], T], args: tuple[*Ts]
    ) -> tuple[Recording, T]:
        """Return the passes that `record_passes(recorder, *args)` records, and its result.

        A cached recording is returned if its arguments were equal and all its resources still exist.
        """
        known = self._recordings.setdefault(record_passes, [])
        found = next((one for one in known if one[1].is_valid and _matches_copy(one[0], args)), None)
        if found is None:
            recording = Recording(device)
            result = record_passes(recording, *args)
            recording.finish()
            assert recording.is_valid, "a resource was released right after it was bound"
            found = _weak_copy(args), recording, result
        if not known or known[0] is not found:
            known[:] = [found, *(one for one in known if one is not found)][:_MAX_CACHED_RECORDINGS]
        return found[1], found[2]


@dataclass(frozen=True)
class _WeakFields:
    """Copy of a dataclass instance whose fields refer to resources only by weak references.

    kind : type of the dataclass
    fields : weak copies of the field values
    """

    kind: type
    fields: tuple[object, ...]


def _weak_copy(argument: object) -> object:
    """Return a copy of an argument for later comparison; the copy keeps no resource alive.

    Arrays are copied; objects that compare by identity, such as textures, become weak references.
    """
    if isinstance(argument, tuple):
        return tuple(map(_weak_copy, argument))
    if isinstance(argument, np.ndarray):
        return argument.copy()
    if not has_value_equality(argument):
        return weakref.ref(argument) if argument is not None else None
    if not is_dataclass(argument):
        return argument
    kind: Any = type(argument)
    fields = tuple(_weak_copy(getattr(argument, name)) for name in dataclass_field_names(kind) or ())
    return _WeakFields(kind, fields) if any(map(_contains_weak_reference, fields)) else argument


def _contains_weak_reference(weak_copy: object) -> bool:
    return isinstance(weak_copy, weakref.ref | _WeakFields) or (
        isinstance(weak_copy, tuple) and any(map(_contains_weak_reference, weak_copy))
    )


def _matches_copy(weak_copy: object, argument: object) -> bool:
    """Return whether an argument equals the original of a copy that `_weak_copy` made."""
    if isinstance(weak_copy, weakref.ref):
        return weak_copy() is argument
    if isinstance(weak_copy, tuple):
        return (
            isinstance(argument, tuple)
            and len(weak_copy) == len(argument)
            and all(map(_matches_copy, weak_copy, argument))
        )
    if isinstance(weak_copy, _WeakFields):
        kind: Any = type(argument)
        if kind is not weak_copy.kind:
            return False
        parts = (getattr(argument, name) for name in dataclass_field_names(kind) or ())
        return all(map(_matches_copy, weak_copy.fields, parts))
    return are_equal(weak_copy, argument)
