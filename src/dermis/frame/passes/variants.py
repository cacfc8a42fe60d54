"""One shader as several pipelines, so that what a scene does not use costs nothing."""

from __future__ import annotations

from pathlib import Path

from dermis.frame.geometry import mesh_constants
from dermis.frame.passes import SHARED_SHADERS
from dermis.gpu import ComputeProgram, Device

Constants = tuple[tuple[str, int], ...]
"""Names and values of a shader's `override`s; those left out keep their default."""


def lighting_constants(device: Device) -> Constants:
    """Values of lighting.wgsl's `override`s that suit the device."""
    return (("PASSES_DARK", 1),) if device.adapter.kind == "CPU" else ()


_MOST = 12  # pipelines of a shader: a software adapter's take some 7 MB each


class Variants:
    """The pipelines of a shader that computes from the mesh, by its constants: those that were used last.

    folders : of the shaders that it includes, besides those that all share
    """

    def __init__(self, device: Device, path: Path, folders: tuple[Path, ...] = ()) -> None:
        self._device, self._path, self._folders = device, path, (SHARED_SHADERS, *folders)
        self._programs: dict[Constants, ComputeProgram] = {}

    def program(self, constants: Constants = ()) -> ComputeProgram:
        """The pipeline for these constants, made unless it is one of those."""
        made = self._programs.pop(constants, None)
        if made is None:
            every = dict(constants + mesh_constants(self._device))
            made = ComputeProgram(self._device, self._path, self._folders, every)
        self._programs[constants] = made  # the last one
        for oldest in list(self._programs)[:-_MOST]:
            del self._programs[oldest]
        return made
