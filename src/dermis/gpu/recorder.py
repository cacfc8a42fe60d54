"""The interface that takes passes: graphs, frames, recordings and listings implement it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, TypeVar

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, Resources

T = TypeVar("T")


class Recorder(ABC):
    """Takes the compute passes of a stage."""

    device: Device

    @abstractmethod
    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Resources,
        groups: tuple[int, int, int],
        completes: str = "",
    ) -> None:
        """Take a pass of a number of workgroups along each axis.

        completes : name of a resource that the pass fills up with what follows from its own content, which is
            therefore no other afterwards
        """

    def compute(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Resources,
        size: tuple[int, int],
        tile: int = 8,
        completes: str = "",
    ) -> None:
        """Take a pass of size[0] x size[1] invocations, in tiles of `tile` squared."""
        self.dispatch(stage, program, resources, (*program.groups_for(size, tile), 1), completes)

    def repeat(self, record: Callable[..., T], *args: Any) -> T:
        """Take the passes of `record(recorder, *args)`."""
        return record(self, *args)
