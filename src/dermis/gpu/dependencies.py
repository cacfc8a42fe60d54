"""What the passes of a frame read of each other: worked out once for frames that declare the same passes."""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import count
from typing import TYPE_CHECKING, TypeVar

from dermis.gpu.types import Bindable, Resource

if TYPE_CHECKING:
    from dermis.gpu.command_list import Step
    from dermis.gpu.device import Device

R = TypeVar("R", bound=Resource)

_number = count(1)

_MOST = 16  # sets of slots that are there


@dataclass(eq=False, slots=True)
class Slot:
    """The content of a texture, a buffer or a view of one layer.

    Contents have version numbers: equal for what the same pass made from equal inputs, 0 when unknown.

    parent : of a view, the texture's slot
    parts : of a texture, the slots of its views
    held : the version that is there now
    scratch : whether it only carries data between passes, so that its content after a frame does not matter
    """

    parent: Slot | None = None
    parts: list[Slot] = field(default_factory=list)
    held: int = 0
    scratch: bool = False

    def sources(self, written: Container[Slot]) -> list[Slot]:
        """Of the slots that passes wrote, those with what it holds: itself, its views, or its texture."""
        found = [part for part in self.parts if part in written]
        if self in written:
            found.append(self)
        elif self.parent is not None and self.parent in written:
            found.append(self.parent)
        return found

    def hold(self, value: int) -> None:
        """Note what is there now, in its views too; what it is a view of is no longer what it was."""
        self.held = value
        for part in self.parts:
            part.held = value
        if self.parent is not None:
            self.parent.held = 0


@dataclass(eq=False, slots=True)
class Access:
    """What a program does with the resources bound to it.

    number : of this program with these resources, never given twice
    reads, writes : slots; what is both stands in both
    steps : dispatches of a device's frames with their bind groups, by stage, workgroups and places of records
    """

    number: int
    reads: tuple[Slot, ...]
    writes: tuple[Slot, ...]
    steps: dict[Hashable, tuple[list[Step], object]] = field(default_factory=dict)


def new_number() -> int:
    """A number that nothing has had before."""
    return next(_number)


def scratch(device: Device, resource: R) -> R:
    """The texture or buffer, which passes share: none runs only for what it leaves there."""
    slot_of(device, resource).scratch = True
    return resource


def slot_of(device: Device, resource: Bindable) -> Slot:
    """The slot of a texture, a buffer or a view."""
    found = device.slots.get(resource)
    if found is None:
        texture = getattr(resource, "texture", None)
        found = device.slots[resource] = Slot(slot_of(device, texture) if texture is not None else None)
        if found.parent is not None:
            found.parent.parts.append(found)
            found.scratch, found.held = found.parent.scratch, found.parent.held
    return found


Declared = tuple[int, tuple[Slot, ...], tuple[Slot, ...]]
"""Of a pass the number of its access, what it reads, and what it leaves."""


class Dependencies:
    """Tells which of some passes, in order, have to run.

    The version that a pass leaves follows from its key and the versions of what it reads. It is skipped while
    its outputs hold that version, and also when no pass that runs needs them.
    """

    def __init__(self, declared: list[Declared]) -> None:
        self.declared = declared
        # What each pass reads, with the pass before it that left it there, if one did.
        self._reads: list[list[tuple[int | None, Slot]]] = []
        self._last: dict[Slot, int] = {}  # the pass that writes it last, or what overlaps it
        self._due_of = lru_cache(_MOST)(self._find_due)
        writers: dict[Slot, int] = {}
        for index, (_, reads, writes) in enumerate(declared):
            found = [one for slot in reads for one in slot.sources(writers) or [slot, *slot.parts]]
            former = set(found).difference(writers, writes)
            self._reads.append([(writers.get(one), one) for one in found if one in writers or one in former])
            for slot in writes:
                self._write(slot, index, writers)

    def versions(self, epoch: int, keys: Iterable[Hashable]) -> list[int]:
        """What each pass leaves.

        keys : what that follows from besides the content that it reads
        """
        made: list[int] = []
        for key, reads in zip(keys, self._reads, strict=True):
            found = [slot.held if index is None else made[index] for index, slot in reads]
            made.append(hash((epoch, key, *found)))
        return made

    def due(self, versions: Sequence[int]) -> list[bool]:
        """Which passes have to run for every resource to hold what all of them together leave."""
        return self._due_of(tuple([slot.held == versions[last] for slot, last in self._last.items()]))

    def _find_due(self, there: tuple[bool, ...]) -> list[bool]:
        """The same, by whether each slot holds what the last pass leaves there."""
        kept = {slot for slot, now in zip(self._last, there, strict=True) if now}  # unless a pass spoils it
        while True:
            due = self._due_with(kept)
            ran = [writes for (*_, writes), now in zip(self.declared, due, strict=True) if now]
            spoilt = {slot for writes in ran for slot in writes if not due[self._last[slot]]}
            if not spoilt & kept:
                return due
            kept -= spoilt

    def _due_with(self, kept: set[Slot]) -> list[bool]:
        due, wanted = [False] * len(self.declared), set[tuple[int | None, Slot]]()
        for index in range(len(due) - 1, -1, -1):
            for slot in self.declared[index][-1]:
                last = self._last[slot] == index
                if not (last and slot in kept) and ((last and not slot.scratch) or (index, slot) in wanted):
                    due[index] = True
                    wanted.update(self._reads[index])
                    break
        return due

    def ran(self, due: Sequence[bool], versions: Sequence[int]) -> None:
        """Note what the passes have left."""
        for (*_, writes), now, version in zip(self.declared, due, versions, strict=True):
            if now:
                for slot in writes:
                    slot.hold(version)

    def _write(self, slot: Slot, index: int, writers: dict[Slot, int]) -> None:
        """Note who leaves what is in a slot now, and in what overlaps it."""
        self._last[slot] = writers[slot] = index
        for part in slot.parts:
            if writers.pop(part, None) is not None:  # what is read of it now is the texture's
                self._last[part] = index
        if slot.parent is not None and slot.parent in writers:
            self._last[slot.parent] = index
