"""A frame graph as data: its passes, their bindings and resources, and which passes ran."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field

import numpy as np

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, Program
from dermis.gpu.recorder import Groups, Recorder
from dermis.gpu.types import Bindable, Bindings, Buffer, is_buffer, is_texture, is_view


@dataclass
class ListedPass:
    """One pass.

    shader : name of its file
    constants : pipeline constants
    bindings : by name in the shader: number of a resource, "sampler", or "record 128" with its bytes
    groups : workgroups, or vertices of a raster pass
    recorded : whether it is part of a recording, whose records do not change
    ran : whether it ran in that frame
    """

    stage: str
    shader: str
    constants: dict[str, float]
    bindings: dict[str, int | str]
    groups: tuple[int, ...]
    recorded: bool = False
    ran: bool = False


@dataclass
class Listing:
    """Passes in order, and the resources that they bind.

    resources : each described: "rgba32float 512 x 512 x 7", "buffer 4096"
    """

    passes: list[ListedPass] = field(default_factory=list)
    resources: list[str] = field(default_factory=list)
    _numbers: dict[int, int] = field(default_factory=dict)
    _indices: list[int] = field(default_factory=list)

    def add(
        self,
        stage: str,
        program: Program,
        resources: Bindings,
        groups: Sequence[int],
        index: int,
        recorded: bool = False,
    ) -> None:
        """Add a pass.

        index : of the graph's pass that it belongs to
        """
        bindings = {one.name: self._bound(resources[one.name]) for one in program.bindings}
        listed = ListedPass(stage, program.name, dict(program.constants), bindings, tuple(groups), recorded)
        self.passes.append(listed)
        self._indices.append(index)

    def add_write(self, stage: str, buffer: Buffer, size: int, index: int) -> None:
        """Write down that the host puts `size` bytes into a buffer."""
        self.passes.append(ListedPass(stage, "from the host", {}, {"written": self._bound(buffer)}, (size,)))
        self._indices.append(index)

    def finish(self, ran: Sequence[bool]) -> None:
        """Note which of the graph's passes ran."""
        for one, index in zip(self.passes, self._indices, strict=True):
            one.ran = ran[index]

    def as_dict(self) -> dict[str, object]:
        """The listing as plain data for JSON."""
        return {"resources": self.resources, "passes": [asdict(one) for one in self.passes]}

    def lines(self) -> Iterator[str]:
        """A line for each pass."""
        for one in self.passes:
            bound = " ".join(f"{name}={value}" for name, value in one.bindings.items())
            mark = "ran " if one.ran else "kept"
            yield f"{mark} {one.stage}: {one.shader} {'x'.join(map(str, one.groups))} {bound}"

    def _bound(self, value: Bindable) -> int | str:
        if isinstance(value, np.ndarray):
            return f"record {value.nbytes}"
        described = _described(value)
        if described == "sampler":
            return described
        if id(value) not in self._numbers:
            self._numbers[id(value)] = len(self.resources)
            self.resources.append(described)
        return self._numbers[id(value)]


class ListingRecorder(Recorder):
    """Lists the passes of a recording.

    index : of the recording among the graph's passes
    """

    def __init__(self, device: Device, listing: Listing, index: int) -> None:
        self.device, self._listing, self._index = device, listing, index

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Groups, completes: str = ""
    ) -> None:
        """Add a pass with its number of workgroups along each axis."""
        self._listing.add(stage, program, resources, groups, self._index, recorded=True)


def _described(value: Bindable) -> str:
    if is_view(value):
        return f"view of {_described(value.texture)}"
    if is_texture(value):
        width, height, layers = value.size
        return f"{value.format} {width} x {height} x {layers}"
    return f"buffer {value.size}" if is_buffer(value) else "sampler"
