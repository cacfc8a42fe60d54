"""Dependencies between the passes of a frame, used to find stale passes: those with outdated output."""

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

_access_ids = count(1)

_MAX_CACHED_STALE_PASSES = 16  # combinations of up-to-date resources for which the stale passes are cached


@dataclass(eq=False, slots=True)
class ResourceState:
    """Version of the content of a texture, buffer or texture view.

    Equal versions mean that the same pass wrote the content from equal inputs. Version 0 means that the
    content is unknown.

    parent : for a view, the state of the viewed texture; None for other resources
    views : for a texture, the states of its views
    version : version of the current content
    scratch : whether the resource only carries data between passes, so that nothing reads it after a frame
    """

    parent: ResourceState | None = None
    views: list[ResourceState] = field(default_factory=list)
    version: int = 0
    scratch: bool = False

    def overlapping_states(self, written_states: Container[ResourceState]) -> list[ResourceState]:
        """Return the states in `written_states` that share content with this state.

        These may be the state itself, the states of its views, or the state of the texture that it views.
        """
        found = [view for view in self.views if view in written_states]
        if self in written_states:
            found.append(self)
        elif self.parent is not None and self.parent in written_states:
            found.append(self.parent)
        return found

    def set_version(self, version: int) -> None:
        """Set the version of this resource and of its views, a number that identifies their current content.

        If this resource is a view, the version of the viewed texture becomes unknown (0).
        """
        self.version = version
        for view in self.views:
            view.version = version
        if self.parent is not None:
            self.parent.version = 0


@dataclass(eq=False, slots=True)
class Access:
    """Resources that a program reads and writes with one set of bindings.

    id : unique number of the combination of program and resources
    reads : states of the resources that the program reads
    writes : states of the resources that the program writes, some of which it may also read
    dispatches : cache of the native dispatches of earlier frames and their bind groups; the keys are stage,
        workgroups and positions of the uniform records
    """

    id: int
    reads: tuple[ResourceState, ...]
    writes: tuple[ResourceState, ...]
    dispatches: dict[Hashable, tuple[list[Dispatch], object]] = field(default_factory=dict)


def new_access_id() -> int:
    """Return a number for `Access.id` that has not been returned before."""
    return next(_access_ids)


def mark_scratch(device: Device, resource: R) -> R:
    """Mark a texture or buffer as scratch, and return it.

    The content of a scratch resource is not needed after the frame, so no pass runs only to update it.
    """
    resource_state(device, resource).scratch = True
    return resource


def resource_state(device: Device, resource: Bindable) -> ResourceState:
    """Return the state of a texture, buffer or view; its version is tracked from the first call on."""
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
"""`Access.id` of a pass, states of the resources it reads, and states of the resources it writes."""


class Dependencies:
    """Dependencies between the passes of a frame, used to find stale passes: those with outdated output.

    A version is a number that identifies the content of a resource. The version of a pass's outputs is a hash
    of the versions of the resources that the pass reads and of the key of the pass, which stands for all
    other inputs. A pass is skipped if its outputs already have their version. It is also skipped if no pass
    that runs reads its outputs, and each output is overwritten later or is not needed after the frame (see
    `mark_scratch`).

    passes : for each pass, in order, the number of its combination of program and resources (`Access.id`),
        and the states of the resources that it reads and writes
    """

    def __init__(self, passes: list[PassAccess]) -> None:
        self.passes = passes
        # The resources that each pass reads, with the earlier pass that wrote them, if one did.
        self._reads: list[list[tuple[int | None, ResourceState]]] = []
        # For each resource, the last pass that writes it or a resource that overlaps it.
        self._last_writer: dict[ResourceState, int] = {}
        self._cached_stale = lru_cache(_MAX_CACHED_STALE_PASSES)(self._find_stale)
        writers: dict[ResourceState, int] = {}
        for index, (_, reads, writes) in enumerate(passes):
            found = [
                one for state in reads for one in state.overlapping_states(writers) or [state, *state.views]
            ]
            unwritten = set(found).difference(writers, writes)
            sources = [one for one in found if one in writers or one in unwritten]
            self._reads.append([(writers.get(one), one) for one in sources])
            for state in writes:
                self._add_write(state, index, writers)

    def compute_versions(self, epoch: int, pass_keys: Iterable[Hashable]) -> list[int]:
        """Return the version of the output of each pass.

        epoch : number that changes when the contents of all resources are invalidated
        pass_keys : for each pass, everything that its output depends on besides the resources that it reads
        """
        versions: list[int] = []
        for key, reads in zip(pass_keys, self._reads, strict=True):
            inputs = [state.version if index is None else versions[index] for index, state in reads]
            versions.append(hash((epoch, key, *inputs)))
        return versions

    def find_stale_passes(self, versions: Sequence[int]) -> list[bool]:
        """Return for each pass whether it must run to bring all resources up to date.

        versions : version that the output of each pass should have
        """
        current = [state.version == versions[last] for state, last in self._last_writer.items()]
        return self._cached_stale(tuple(current))

    def _find_stale(self, is_up_to_date: tuple[bool, ...]) -> list[bool]:
        """Return for each pass whether it must run to bring all resources up to date.

        is_up_to_date : for each written resource, in the order of `_last_writer`, whether it already has its
            final version
        """
        valid = {state for state, now in zip(self._last_writer, is_up_to_date, strict=True) if now}
        while True:
            stale = self._passes_with_outdated_output(valid)
            running = [writes for (*_, writes), now in zip(self.passes, stale, strict=True) if now]
            overwritten = {one for writes in running for one in writes if not stale[self._last_writer[one]]}
            if not overwritten & valid:
                return stale
            valid -= overwritten

    def _passes_with_outdated_output(self, valid_states: set[ResourceState]) -> list[bool]:
        """Return for each pass whether it writes an output that is needed and not up to date.

        An output is needed if it is the final content of a resource that is not scratch, or the input of a
        stale pass.

        valid_states : resources whose final content is already up to date
        """
        stale, needed = [False] * len(self.passes), set[tuple[int | None, ResourceState]]()
        for index in range(len(stale) - 1, -1, -1):
            for state in self.passes[index][-1]:
                is_last = self._last_writer[state] == index
                is_needed = (is_last and not state.scratch) or (index, state) in needed
                if is_needed and not (is_last and state in valid_states):
                    stale[index] = True
                    needed.update(self._reads[index])
                    break
        return stale

    def set_versions(self, pass_has_run: Sequence[bool], versions: Sequence[int]) -> None:
        """Set the versions of all resources that the executed passes wrote.

        pass_has_run : for each pass, whether it ran in this frame
        versions : version that each pass writes
        """
        for (*_, writes), now, version in zip(self.passes, pass_has_run, versions, strict=True):
            if now:
                for state in writes:
                    state.set_version(version)

    def _add_write(
        self, state: ResourceState, pass_index: int, last_writers: dict[ResourceState, int]
    ) -> None:
        """Register a pass as the last writer of a resource and of overlapping views and textures.

        state, pass_index : state of the resource, and index of the pass
        last_writers : dictionary from each state to the index of its last writer so far, changed in place
        """
        self._last_writer[state] = last_writers[state] = pass_index
        for view in state.views:
            if (
                last_writers.pop(view, None) is not None
            ):  # from here on, reads of the view come from the texture
                self._last_writer[view] = pass_index
        if state.parent is not None and state.parent in last_writers:
            self._last_writer[state.parent] = pass_index
