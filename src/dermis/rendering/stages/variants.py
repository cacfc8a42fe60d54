"""One shader as several pipelines, so that what a scene does not use costs nothing."""

from __future__ import annotations

from pathlib import Path

from dermis.gpu import ComputeProgram, Device
from dermis.rendering.geometry import mesh_switches
from dermis.rendering.stages import SHARED_SHADERS

Switches = tuple[tuple[str, int], ...]
"""Names and values of a shader's `override`s; those left out keep their default."""


def lighting_switches(device: Device) -> Switches:
    """Values of lighting.wgsl's `override`s that suit the device."""
    return (("PASSES_DARK", 1),) if device.adapter.kind == "CPU" else ()


_MOST = 12  # pipelines of a shader: a software adapter's take some 7 MB each


class Variants:
    """The pipelines of a shader that computes from the mesh, by its switches: those that were used last.

    folders : of the shaders that it includes, besides those that all share
    """

    def __init__(self, device: Device, path: Path, folders: tuple[Path, ...] = ()) -> None:
        self._device, self._path, self._folders = device, path, (SHARED_SHADERS, *folders)
        self._programs: dict[Switches, ComputeProgram] = {}

    def program(self, switches: Switches = ()) -> ComputeProgram:
        """The pipeline for these switches, made unless it is one of those."""
        made = self._programs.pop(switches, None)
        if made is None:
            every = dict(switches + mesh_switches(self._device))
            made = ComputeProgram(self._device, self._path, self._folders, every)
        self._programs[switches] = made  # the last one
        for oldest in list(self._programs)[:-_MOST]:
            del self._programs[oldest]
        return made
