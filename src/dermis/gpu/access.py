"""What each pass reads and writes, taken from its shader's bindings, and what each resource holds."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dermis.gpu.device import Device

_number = count(1)


@dataclass(eq=False, slots=True)
class Slot:
    """The content of a texture, a buffer or a view of one layer.

    Contents have version numbers: equal for what the same pass made from equal inputs, 0 when unknown.
    `value` is the version that the passes declared so far will leave, `held` the one that is there now.

    parent : of a view, the texture's slot
    parts : of a texture, the slots of its views
    frame : the one in which `value`, `writer` and `last` hold
    writer : the pass that writes it last
    last : the same, or a later one that writes what contains it or is contained
    scratch : whether it only carries data between passes, so that its content after a frame does not matter
    active : whether any pass has ever written it
    """

    parent: Slot | None = None
    parts: list[Slot] = field(default_factory=list)
    held: int = 0
    value: int = 0
    frame: int = 0
    writer: int = 0
    last: int = 0
    scratch: bool = False
    active: bool = False

    @property
    def changes(self) -> bool:
        """Whether what is read of it may be another's from frame to frame."""
        around = (self, *self.parts) if self.parent is None else (self, self.parent, *self.parts)
        return any(slot.active for slot in around)

    def sources(self, frame: int) -> list[Slot]:
        """The slots from which it gets what it holds in the frame: itself, its views, or its texture."""
        if self.frame == frame and not self.parts:
            return [self]
        found = [part for part in self.parts if part.frame == frame]
        if self.frame == frame:
            found.append(self)
        elif self.parent is not None and self.parent.frame == frame:
            found.append(self.parent)
        return found

    def write(self, frame: int, index: int, value: int) -> None:
        """Let the pass of that index leave a value."""
        self.frame, self.value, self.writer, self.last = frame, value, index, index
        for part in self.parts:
            if part.frame == frame:
                part.last = index
                part.frame = 0  # what is read of it now is the texture's
        if self.parent is not None and self.parent.frame == frame:
            self.parent.last = index

    def hold(self, value: int) -> None:
        """Note what is there now; what overlaps it is no longer what it was."""
        self.held = value
        for part in self.parts:
            part.held = 0
        if self.parent is not None:
            self.parent.held = 0


@dataclass(eq=False, slots=True)
class Access:
    """What a program does with the resources bound to it.

    number : of this program with these resources, never given twice
    reads, writes : slots; what is both stands in both
    groups : bind groups with the buffers of a device's frames, by these
    """

    number: int
    reads: tuple[Slot, ...]
    writes: tuple[Slot, ...]
    groups: dict[tuple[int, ...], Any] = field(default_factory=dict)
    _changing: list[Slot] = field(default_factory=list)
    _of: int = -1

    def changing(self, active: int) -> list[Slot]:
        """Of what it reads that which passes write.

        active : how many slots passes have written; while there are no more, the answer is the same
        """
        if self._of != active:
            self._changing, self._of = [slot for slot in self.reads if slot.changes], active
        return self._changing


def new_number() -> int:
    """A number that nothing has had before."""
    return next(_number)


def scratch(device: Device, resource: Any) -> Any:
    """The texture or buffer, which passes share: none runs only for what it leaves there."""
    slot_of(device, resource).scratch = True
    return resource


def slot_of(device: Device, resource: Any) -> Slot:
    """The slot of a texture, a buffer or a view."""
    found: Slot | None = device.slots.get(resource)
    if found is None:
        texture = getattr(resource, "texture", None)
        found = device.slots[resource] = Slot(slot_of(device, texture) if texture is not None else None)
        if found.parent is not None:
            found.parent.parts.append(found)
            found.scratch = found.parent.scratch
    return found
