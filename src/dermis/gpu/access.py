"""What each pass reads and writes, taken from its shader's bindings, and what each resource holds."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any, TypeVar

from dermis.gpu.types import Bindable, Resource

if TYPE_CHECKING:
    from dermis.gpu.device import Device

_number = count(1)
R = TypeVar("R", bound=Resource)


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
    steps: dict[Any, tuple[Any, Any]] = field(default_factory=dict)


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
