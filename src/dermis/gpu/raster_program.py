"""Shaders of the graphics pipeline: triangles rasterised, and whole targets filled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from dermis.gpu.device import Device
from dermis.gpu.program import Program
from dermis.gpu.wgsl_source import Folder


class RasterProgram(Program):
    """A vertex shader `vertex`, and a fragment shader `fragment` when there is a colour target.

    target : format of the colour target, or None for depth only
    depth_compare : wgpu's name ("less", "greater")
    drawn : both
    """

    def __init__(
        self,
        device: Device,
        path: Path,
        folders: Sequence[Folder] = (),
        constants: Mapping[str, float] | None = None,
        *,
        target: str | None,
        depth_compare: str,
    ) -> None:
        super().__init__(device, path, folders, constants)
        self.drawn = {"target": target, "depth_compare": depth_compare}
        fragment = {"module": self._module, "entry_point": "fragment", "targets": [{"format": target}]}
        self.pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={"module": self._module, "entry_point": "vertex", "constants": self.constants},
            fragment=fragment if target else None,
            primitive={"topology": "triangle-list", "cull_mode": "none"},
            depth_stencil={
                "format": "depth32float",
                "depth_write_enabled": True,
                "depth_compare": depth_compare,
            },
        )

    def _visibility(self) -> int:
        import wgpu

        return int(wgpu.ShaderStage.VERTEX | wgpu.ShaderStage.FRAGMENT)


class FragmentProgram(Program):
    """A shader whose `fragment` fills whole targets; its `vertex` makes the one triangle that covers them.

    targets : their formats
    """

    def __init__(
        self,
        device: Device,
        path: Path,
        folders: Sequence[Folder] = (),
        constants: Mapping[str, float] | None = None,
        *,
        targets: Sequence[str],
    ) -> None:
        super().__init__(device, path, folders, constants)
        stage = {"module": self._module, "entry_point": "fragment", "constants": self.constants}
        self.pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={"module": self._module, "entry_point": "vertex"},
            fragment={**stage, "targets": [{"format": texel} for texel in targets]},
            primitive={"topology": "triangle-list"},
        )

    def _visibility(self) -> int:
        import wgpu

        return int(wgpu.ShaderStage.FRAGMENT)
