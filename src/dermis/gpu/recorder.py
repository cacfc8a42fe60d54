"""Interface of everything that takes the passes of a frame: to run, replay, capture or list them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar, TypeVarTuple

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, RenderProgram
from dermis.gpu.types import Bindings, Buffer, TextureOrView, TextureView

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
Workgroups = tuple[int, int, int]
"""Number of workgroups along each axis."""


class DrawTarget(NamedTuple):
    """Attachments of a render pass, which are cleared first.

    depth : depth attachment
    clear_depth : value that the depth attachment is cleared to
    colour : colour attachment; None to draw only depth
    """

    depth: TextureView
    clear_depth: float
    colour: TextureOrView | None = None


class Recorder(ABC):
    """A recorder of passes: a command list, a graph, a recording, a capture or a listing.

    All record compute passes; recordings and listings of recordings refuse all others.
    """

    device: Device

    @abstractmethod
    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Workgroups, in_place: str = ""
    ) -> None:
        """Add a compute pass.

        groups : number of workgroups along each axis
        in_place : name of a resource that the pass only extends from its own content, as gutters are, so that
            its version does not change
        """

    def compute(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        size: tuple[int, int],
        tile: int = 8,
        in_place: str = "",
    ) -> None:
        """Add a compute pass of at least size[0] x size[1] invocations, in workgroups of tile x tile."""
        self.dispatch(stage, program, resources, (*program.groups_for(size, tile), 1), in_place)

    def write(self, stage: str, buffer: Buffer, data: bytes) -> None:
        """Write bytes from the host to the start of a buffer, before all passes of the frame.

        data : pass the same object in each frame if possible, as Python caches the hash of bytes
        """
        raise self._refusal(stage)

    def draw(
        self,
        stage: str,
        program: RenderProgram,
        resources: Bindings,
        vertices: int,
        target: DrawTarget,
        *,
        indices: Buffer | None = None,
        layer: int = 0,
    ) -> None:
        """Add a render pass of `vertices` / 3 triangles.

        indices : index buffer; None numbers the vertices in order
        layer : instance index that the shader gets
        """
        raise self._refusal(stage)

    def fill(
        self, stage: str, program: RenderProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Add a render pass that runs `program` for each texel of its targets."""
        raise self._refusal(stage)

    def repeat(self, record: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Add the compute passes of `record(recorder, *args)`, which depend only on its arguments."""
        return record(self, *args)

    def _refusal(self, stage: str) -> NotImplementedError:
        return NotImplementedError(f"{stage}: {type(self).__name__} takes compute passes only")
