"""Interface of objects that accept the passes of a frame, to run, replay, capture or list them."""

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
    """Attachments of a render pass, which are cleared when the pass begins.

    depth : view of the depth attachment
    clear_depth : depth to which the depth attachment is cleared
    colour : colour attachment; None to draw only depth
    """

    depth: TextureView
    clear_depth: float
    colour: TextureOrView | None = None


class Recorder(ABC):
    """Interface for adding passes, so that the same code can run, schedule, store or list them.

    The implementations are a command list, which runs the passes; a graph, which runs only passes with
    outdated output; a recording, which stores compute passes to replay them in later frames; a capture, which
    stores a frame for export; and a recorder that adds the passes of a recording to a listing for inspection.
    All accept compute passes; the recording and the listing accept no others.
    """

    device: Device

    @abstractmethod
    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        workgroups: Workgroups,
        in_place_resource: str = "",
    ) -> None:
        """Add a dispatch of a compute program.

        stage : name of the stage, under which the pass is timed
        resources : resources and uniform records by their names in the shader
        workgroups : number of workgroups along each axis
        in_place_resource : name of a resource whose content the pass only completes, such as a map whose
            gutters it fills; the pass does not change the version of this resource
        """

    def compute(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        invocation_counts: tuple[int, int],
        tile_side: int = 8,
        in_place_resource: str = "",
    ) -> None:
        """Add a dispatch of square workgroups that cover a 2-D grid of invocations.

        stage : name of the stage, under which the pass is timed
        resources : resources and uniform records by their names in the shader
        invocation_counts : number of invocations along x and y
        tile_side : side of a workgroup [invocations]
        in_place_resource : see `dispatch`
        """
        self.dispatch(
            stage,
            program,
            resources,
            (*program.workgroups_for(invocation_counts, tile_side), 1),
            in_place_resource,
        )

    def write(self, stage: str, buffer: Buffer, content: bytes) -> None:
        """Write bytes from the host to the start of a buffer, before all passes of the frame.

        content : bytes; the same object should be passed in each frame, as Python caches the hash of bytes
        """
        raise self._unsupported_error(stage)

    def draw(
        self,
        stage: str,
        program: RenderProgram,
        resources: Bindings,
        vertex_count: int,
        target: DrawTarget,
        *,
        index_buffer: Buffer | None = None,
        instance_index: int = 0,
    ) -> None:
        """Add a render pass of triangles.

        stage : name of the stage, under which the pass is timed
        resources : resources and uniform records by their names in the shader
        vertex_count : number of vertices, three per triangle
        target : depth and colour attachments
        index_buffer : index buffer; None to number the vertices in order
        instance_index : instance index, which shaders use as an index into the layers of a texture array
        """
        raise self._unsupported_error(stage)

    def draw_fullscreen(
        self, stage: str, program: RenderProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Add a render pass that runs a program once per texel of its targets.

        stage : name of the stage, under which the pass is timed
        resources : resources and uniform records by their names in the shader
        targets : colour attachments, which the pass writes
        """
        raise self._unsupported_error(stage)

    def add_replayable(self, record_passes: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Add the passes that `record_passes(recorder, *args)` adds, and return the result of the call.

        An implementation may reuse the passes and the result of an earlier call with equal `args`, so both
        must depend only on `args`.
        """
        return record_passes(self, *args)

    def _unsupported_error(self, stage: str) -> NotImplementedError:
        return NotImplementedError(f"{stage}: {type(self).__name__} takes compute passes only")
