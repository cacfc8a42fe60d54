"""The interface for passes of a frame, however they are run, replayed or written down."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar, TypeVarTuple

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, FragmentProgram, RasterProgram
from dermis.gpu.types import Bindings, Buffer, TextureOrView, TextureView

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
Groups = tuple[int, int, int]
"""Number of workgroups along each axis."""


class DrawTarget(NamedTuple):
    """Attachments of a pass that rasterises, which are cleared first.

    far : depth with which the depth attachment is cleared
    colour : None for depth alone
    """

    depth: TextureView
    far: float
    colour: TextureOrView | None = None


class Recorder(ABC):
    """A receiver of passes: a command list, a graph, a recording, a capture or a listing.

    All take compute passes; recordings and listings of recordings take no others.
    """

    device: Device

    @abstractmethod
    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Groups, completes: str = ""
    ) -> None:
        """Add a pass that runs `program` in a number of workgroups.

        completes : name of a resource that the pass completes from its own content, as gutters are, and that
            therefore counts as unchanged
        """

    def compute(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        size: tuple[int, int],
        tile: int = 8,
        completes: str = "",
    ) -> None:
        """Add a pass of size[0] x size[1] invocations, in workgroups of tile x tile."""
        self.dispatch(stage, program, resources, (*program.groups_for(size, tile), 1), completes)

    def write(self, stage: str, buffer: Buffer, data: bytes) -> None:
        """Put bytes from the host into the start of a buffer, before all passes.

        data : the same object in each frame costs nothing, as Python keeps the hash of bytes
        """
        raise self._compute_only(stage)

    def draw(
        self,
        stage: str,
        program: RasterProgram,
        resources: Bindings,
        vertices: int,
        target: DrawTarget,
        *,
        indices: Buffer | None = None,
        layer: int = 0,
    ) -> None:
        """Add a pass that rasterises `vertices` / 3 triangles.

        indices : numbers of the vertices for the shader; None counts them
        layer : instance index for the shader
        """
        raise self._compute_only(stage)

    def fill(
        self, stage: str, program: FragmentProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Add a pass that runs `program` for each texel of its targets."""
        raise self._compute_only(stage)

    def repeat(self, record: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Add the compute passes of `record(recorder, *args)`, which return the same for equal arguments."""
        return record(self, *args)

    def _compute_only(self, stage: str) -> NotImplementedError:
        return NotImplementedError(f"{stage}: {type(self).__name__} takes compute passes alone")
