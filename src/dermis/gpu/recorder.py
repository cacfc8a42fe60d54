"""The interface for declaring passes, which graphs, frames, recordings and listings implement."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TypeVar, TypeVarTuple

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram
from dermis.gpu.types import Bindings

T = TypeVar("T")
Ts = TypeVarTuple("Ts")


class Recorder(ABC):
    """Takes compute passes."""

    device: Device

    @abstractmethod
    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        groups: tuple[int, int, int],
        completes: str = "",
    ) -> None:
        """Take a pass with its number of workgroups along each axis.

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
        """Take a pass of size[0] x size[1] invocations, in workgroups of tile x tile."""
        self.dispatch(stage, program, resources, (*program.groups_for(size, tile), 1), completes)

    def repeat(self, record: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Take the passes of `record(recorder, *args)`."""
        return record(self, *args)
