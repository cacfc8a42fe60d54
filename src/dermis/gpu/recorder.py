"""Where passes go: a graph, which runs what is due; a frame, which runs all at once; a recording."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, Resources

T = TypeVar("T")


class Recorder(Protocol):
    """Takes the passes of a stage; see `Graph` for what each method means."""

    @property
    def device(self) -> Device:
        """The passes' device."""

    def compute(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Resources,
        size: tuple[int, int],
        tile: int = 8,
        completes: str = "",
    ) -> None:
        """Take a pass of size[0] x size[1] invocations."""

    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Resources,
        groups: tuple[int, int, int],
        completes: str = "",
    ) -> None:
        """Take a pass of a number of workgroups."""

    def repeat(self, record: Callable[..., T], *args: Any) -> T:
        """Take the passes of `record(recorder, *args)`."""
