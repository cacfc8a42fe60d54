"""Compiled shaders: WGSL in, pipeline and bindings by name out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dermis.errors import DermisError
from dermis.gpu.device import Device
from dermis.gpu.layout import Binding, bindings, struct_dtype
from dermis.gpu.wgsl_source import Source, compose

Resources = Mapping[str, Any]
_TOOLKIT_SHADERS = Path(__file__).parent / "wgsl"


class Program:
    """What compute and raster programs share: the composed text, its bindings and their layouts."""

    def __init__(self, device: Device, path: Path, folders: Sequence[Path] = ()) -> None:
        self.device = device
        self.name = path.stem
        self.source: Source = compose(path, (*folders, _TOOLKIT_SHADERS))
        self.bindings: tuple[Binding, ...] = bindings(self.source.text)
        self._module = self._compile(path)
        self._layouts = [self._group_layout(group) for group in range(self._group_count())]
        self._layout = device.handle.create_pipeline_layout(bind_group_layouts=self._layouts)

    def record(self, struct: str, **values: Any) -> np.ndarray[Any, Any]:
        """A zeroed record of one of the shader's structs with the given members filled in."""
        record = np.zeros((), dtype=struct_dtype(self.source.text, struct))
        for member, value in values.items():
            record[member] = value
        return record

    def bind_groups(self, resources: Resources) -> list[Any]:
        """Bind groups for resources by their name in the shader.

        A resource is a buffer, a texture, a texture view, a sampler, or a numpy record (then it becomes a
        uniform buffer).
        """
        groups = []
        for group, layout in enumerate(self._layouts):
            entries = [
                {"binding": b.index, "resource": self._resource(b, resources)}
                for b in self.bindings
                if b.group == group
            ]
            groups.append(self.device.handle.create_bind_group(layout=layout, entries=entries))
        return groups

    def _resource(self, binding: Binding, resources: Resources) -> Any:
        if binding.name not in resources:
            raise KeyError(f"{self.name}.wgsl declares {binding.name!r}, and nothing is bound to it")
        value = resources[binding.name]
        if isinstance(value, np.ndarray):
            value = self.device.uniform(value)
        if "buffer" in binding.entry:
            return {"buffer": value, "offset": 0, "size": value.size}
        texture = binding.entry.get("texture") or binding.entry.get("storage_texture")
        if texture and hasattr(value, "create_view"):
            return value.create_view(dimension=texture["view_dimension"])
        return value

    def _compile(self, path: Path) -> Any:
        try:
            return self.device.handle.create_shader_module(code=self.source.text, label=path.name)
        except Exception as error:
            raise DermisError(
                f"{path.name}: the shader did not compile.\n{self.source.locate(str(error))}"
            ) from error

    def _group_count(self) -> int:
        return 1 + max((b.group for b in self.bindings), default=-1)

    def _group_layout(self, group: int) -> Any:
        entries = [
            {"binding": b.index, "visibility": self._visibility(), **b.entry}
            for b in self.bindings
            if b.group == group
        ]
        return self.device.handle.create_bind_group_layout(entries=entries)

    def _visibility(self) -> int:
        raise NotImplementedError


class ComputeProgram(Program):
    """A compute shader with the entry point `main`; `constants` are the shader's `override`s."""

    def __init__(
        self,
        device: Device,
        path: Path,
        folders: Sequence[Path] = (),
        constants: Mapping[str, float] | None = None,
    ) -> None:
        super().__init__(device, path, folders)
        stage = {"module": self._module, "entry_point": "main", "constants": dict(constants or {})}
        self.pipeline = device.handle.create_compute_pipeline(layout=self._layout, compute=stage)

    def groups_for(self, size: tuple[int, int], tile: int = 8) -> tuple[int, int]:
        """Workgroups that cover an image of `size` with tiles of `tile` squared."""
        return math.ceil(size[0] / tile), math.ceil(size[1] / tile)

    def _visibility(self) -> int:
        import wgpu

        return int(wgpu.ShaderStage.COMPUTE)


class RasterProgram(Program):
    """A vertex shader `vertex`, and a fragment shader `fragment` when there is a colour target.

    target : format of the colour target, or None for depth only
    depth_compare : wgpu's name ("less", "greater")
    """

    def __init__(
        self,
        device: Device,
        path: Path,
        folders: Sequence[Path] = (),
        *,
        target: str | None,
        depth_compare: str,
    ) -> None:
        super().__init__(device, path, folders)
        fragment = {"module": self._module, "entry_point": "fragment", "targets": [{"format": target}]}
        self.pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={"module": self._module, "entry_point": "vertex"},
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
