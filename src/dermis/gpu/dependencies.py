"""Dependencies between the passes of a frame, from which the passes that have to run are found."""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import count
from typing import TYPE_CHECKING, TypeVar

from dermis.gpu.types import Bindable, Resource

if TYPE_CHECKING:
    from dermis.gpu.command_list import Dispatch
    from dermis.gpu.device import Device

R = TypeVar("R", bound=Resource)

_id = count(1)

_CACHED_STATES = 16  # combinations of up-to-date resources


@dataclass(eq=False, slots=True)
class ResourceState:
    """Version of the content of a texture, a buffer or a texture view.

    Equal versions are the output of the same pass from equal inputs; 0 is unknown content.

    parent : state of the texture, for a view
    views : states of a texture's views
    version : version of the current content
    scratch : whether the resource only carries data between passes, so that nothing reads it after a frame
    """

    parent: ResourceState | None = None
    views: list[ResourceState] = field(default_factory=list)
    version: int = 0
    scratch: bool = False

    def overlapping(self, written: Container[ResourceState]) -> list[ResourceState]:
        """Return the written states that share content with this one: itself, its views or its texture."""
        found = [view for view in self.views if view in written]
        if self in written:
            found.append(self)
        elif self.parent is not None and self.parent in written:
            found.append(self.parent)
        return found

    def set_version(self, version: int) -> None:
        """Set the version of the content and of its views; the texture of a view becomes unknown."""
        self.version = version
        for view in self.views:
            view.version = version
        if self.parent is not None:
            self.parent.version = 0


@dataclass(eq=False, slots=True)
class Access:
    """Resources that a program reads and writes under one set of bindings.

    id : unique number of this program with these resources
    reads, writes : states of the resources; a resource that is both read and written is in both
    dispatches : dispatches of earlier frames with bind groups, by stage, workgroups and record positions
    """

    id: int
    reads: tuple[ResourceState, ...]
    writes: tuple[ResourceState, ...]
    dispatches: dict[Hashable, tuple[list[Dispatch], object]] = field(default_factory=dict)


def unique_id() -> int:
    """Return a number that has not been returned before."""
    return next(_id)


def mark_scratch(device: Device, resource: R) -> R:
    """Mark a texture or buffer as scratch: no pass runs only to keep its content up to date."""
    resource_state(device, resource).scratch = True
    return resource


def resource_state(device: Device, resource: Bindable) -> ResourceState:
    """Return the state of a texture, a buffer or a view, created on first use."""
    found = device.resource_states.get(resource)
    if found is None:
        texture = getattr(resource, "texture", None)
        parent = resource_state(device, texture) if texture is not None else None
        found = device.resource_states[resource] = ResourceState(parent)
        if parent is not None:
            parent.views.append(found)
            found.scratch, found.version = parent.scratch, parent.version
    return found


PassAccess = tuple[int, tuple[ResourceState, ...], tuple[ResourceState, ...]]
"""Access id of a pass, the resources that it reads, and those that it writes."""


class Dependencies:
    """Passes of a frame in order, and which of them have to run.

    The version that a pass writes follows from its key and the versions of what it reads. A pass is skipped
    while its outputs have that version, and when no pass that runs needs them.
    """

    def __init__(self, passes: list[PassAccess]) -> None:
        self.passes = passes
        # The resources that each pass reads, with the earlier pass that wrote them, if one did.
        self._reads: list[list[tuple[int | None, ResourceState]]] = []
        self._last_writer: dict[ResourceState, int] = {}  # of the resource, or of one that overlaps it
        self._cached_stale = lru_cache(_CACHED_STATES)(self._find_stale)
        writers: dict[ResourceState, int] = {}
        for index, (_, reads, writes) in enumerate(passes):
            found = [one for state in reads for one in state.overlapping(writers) or [state, *state.views]]
            unwritten = set(found).difference(writers, writes)
            sources = [one for one in found if one in writers or one in unwritten]
            self._reads.append([(writers.get(one), one) for one in sources])
            for state in writes:
                self._add_write(state, index, writers)

    def versions(self, epoch: int, keys: Iterable[Hashable]) -> list[int]:
        """Return the version that each pass writes.

        keys : for each pass, everything that its output depends on besides the resources that it reads
        """
        versions: list[int] = []
        for key, reads in zip(keys, self._reads, strict=True):
            inputs = [state.version if index is None else versions[index] for index, state in reads]
            versions.append(hash((epoch, key, *inputs)))
        return versions

    def stale(self, versions: Sequence[int]) -> list[bool]:
        """Return for each pass whether it has to run to bring every resource up to date."""
        current = [state.version == versions[last] for state, last in self._last_writer.items()]
        return self._cached_stale(tuple(current))

    def _find_stale(self, current: tuple[bool, ...]) -> list[bool]:
        """Return the stale passes, given which resources already have their final version."""
        valid = {state for state, now in zip(self._last_writer, current, strict=True) if now}
        while True:
            stale = self._stale_given(valid)
            running = [writes for (*_, writes), now in zip(self.passes, stale, strict=True) if now]
            overwritten = {one for writes in running for one in writes if not stale[self._last_writer[one]]}
            if not overwritten & valid:
                return stale
            valid -= overwritten

    def _stale_given(self, valid: set[ResourceState]) -> list[bool]:
        """Return the passes that write an output which is not valid, or an input of such a pass."""
        stale, needed = [False] * len(self.passes), set[tuple[int | None, ResourceState]]()
        for index in range(len(stale) - 1, -1, -1):
            for state in self.passes[index][-1]:
                is_last = self._last_writer[state] == index
                is_needed = (is_last and not state.scratch) or (index, state) in needed
                if is_needed and not (is_last and state in valid):
                    stale[index] = True
                    needed.update(self._reads[index])
                    break
        return stale

    def set_versions(self, executed: Sequence[bool], versions: Sequence[int]) -> None:
        """Set the versions of everything that the executed passes wrote."""
        for (*_, writes), now, version in zip(self.passes, executed, versions, strict=True):
            if now:
                for state in writes:
                    state.set_version(version)

    def _add_write(self, state: ResourceState, index: int, writers: dict[ResourceState, int]) -> None:
        """Register a pass as the last writer of a resource and of what overlaps it."""
        self._last_writer[state] = writers[state] = index
        for view in state.views:
            if writers.pop(view, None) is not None:  # from here on, reads of the view come from the texture
                self._last_writer[view] = index
        if state.parent is not None and state.parent in writers:
            self._last_writer[state.parent] = index
