"""One shader as several pipelines, so that what a scene does not use costs nothing."""

from __future__ import annotations

from pathlib import Path

from dermis.gpu import ComputeProgram, Device
from dermis.rendering.geometry import mesh_switches
from dermis.rendering.stages import SHARED_SHADERS

Switches = tuple[tuple[str, int], ...]
"""Names and values of a shader's `override`s; those left out keep their default."""


class Variants:
    """The pipelines of a shader that computes from the mesh, by its switches, made when first asked for."""

    def __init__(self, device: Device, path: Path) -> None:
        self._device, self._path = device, path
        self._programs: dict[Switches, ComputeProgram] = {}

    def program(self, switches: Switches = ()) -> ComputeProgram:
        """The pipeline for these switches."""
        if switches not in self._programs:
            every = dict(switches + mesh_switches(self._device))
            made = ComputeProgram(self._device, self._path, (SHARED_SHADERS,), every)
            self._programs[switches] = made
        return self._programs[switches]
