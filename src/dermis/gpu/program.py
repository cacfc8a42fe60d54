"""Compiled shaders: WGSL in, pipeline and bindings by name out."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cached_property
from operator import itemgetter
from pathlib import Path
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import DermisError
from dermis.gpu.bind_groups import UNIFORM, BindGroup, ResourceCache, key_of, make_group
from dermis.gpu.dependencies import Access, new_number, resource_state
from dermis.gpu.device import Device
from dermis.gpu.shader_types import Binding, bindings, members_read, record_of
from dermis.gpu.types import Bindable, Bindings, Native, Record, Untyped
from dermis.gpu.uniforms import Uniforms
from dermis.gpu.wgsl_source import Folder, Source, compose

Records = Mapping[str, NDArray[np.generic]]
"""The uniforms of bindings, where a shader is known to declare them so."""

P = TypeVar("P")

_TOOLKIT_SHADERS = Path(__file__).parent / "wgsl"

_LARGE_RECORD = 2048  # bytes; a skin is smaller, of which few shaders read all

_MOST_VARIANTS = 12  # of a shader: on a software adapter each takes some 7 MB

Constants = tuple[tuple[str, float], ...]
"""Names and values of pipeline constants, a shader's `override`s; those left out keep their default."""


class Program:
    """What compute and raster programs share: the composed text, its bindings and their layouts.

    stages : wgpu's names of the stages that see the bindings
    """

    stages: ClassVar[tuple[str, ...]]

    def __init__(
        self,
        device: Device,
        path: Path,
        folders: Sequence[Folder] = (),
        constants: Mapping[str, float] | None = None,
    ) -> None:
        self.device, self.name = device, path.stem
        self.constants = dict(constants or {})
        self.source = source_of(path, folders)
        self.bindings: tuple[Binding, ...] = bindings(self.source.text)
        self._module = self._compile(path)
        self._uniforms = [b for b in self.bindings if _is_uniform(b)]
        self._others = [b for b in self.bindings if not _is_uniform(b)]
        self._read = _reader([b.name for b in self._others])
        self._numbers_of = [(one.name, members_read(self.source.text, one.name)) for one in self._uniforms]
        self.kept_groups: ResourceCache[BindGroup] = ResourceCache()
        self._accesses: ResourceCache[Access] = ResourceCache()
        self._group_layout = device.handle.create_bind_group_layout(entries=self._layout_entries())
        self._layout = device.handle.create_pipeline_layout(bind_group_layouts=[self._group_layout])

    def record(self, struct: str, **values: object) -> Record:
        """A zeroed record of one of the shader's structs with the given members filled in."""
        return record_of(self.source.text, struct, **values)

    def places(self, resources: Bindings, uniforms: Uniforms) -> tuple[int, ...]:
        """Where the records are among the uniforms."""
        records: Records = resources  # type: ignore[assignment]  # no cast, which costs time
        try:
            return tuple([uniforms.place(records[name]) for name, _ in self._numbers_of])
        except KeyError as missing:
            raise self._unbound(missing) from None

    def bind_group(self, resources: Bindings, uniforms: Uniforms) -> tuple[BindGroup, list[int]]:
        """A bind group of resources by their name in the shader, and the offsets of its uniforms.

        A resource is a buffer, a texture, a texture view, a sampler, or a numpy record, which finds a place
        among the uniforms.
        """
        found = [uniforms.at(place) for place in self.places(resources, uniforms)]
        bound = [*self._bound(resources), *(buffer for buffer, _ in found)]
        key = key_of(bound)
        group = self.kept_groups.find(key)
        if group is None:
            group = self._make_group(bound, resources)
            self.kept_groups.keep(key, bound, group)
        return group, [offset for _, offset in found]

    def access(self, resources: Bindings) -> Access:
        """What a pass of this program with these resources reads and writes, records aside."""
        bound = self._bound(resources)
        key = key_of(bound)
        found = self._accesses.find(key)
        if found is None:
            named = list(zip(self._others, bound, strict=True))
            reads = tuple(
                resource_state(self.device, value) for one, value in named if one.holds and one.reads
            )
            writes = tuple(resource_state(self.device, value) for one, value in named if one.writes)
            found = Access(new_number(), reads, writes)
            self._accesses.keep(key, bound, found)
        return found

    def numbers(self, resources: Bindings, uniforms: Uniforms) -> tuple[Hashable, ...]:
        """What the shader reads of the records; all of large ones, whose hash several passes share."""
        found: list[Hashable] = []
        records: Records = resources  # type: ignore[assignment]  # no cast, which costs time
        try:
            for name, read in self._numbers_of:
                raw = uniforms.bytes_of(records[name])
                found.append(raw if len(raw) > _LARGE_RECORD else read(raw))
        except KeyError as missing:
            raise self._unbound(missing) from None
        return tuple(found)

    def _bound(self, resources: Bindings) -> Sequence[Bindable]:
        """What is bound besides records, in the shader's order."""
        try:
            return self._read(resources)
        except KeyError as missing:
            raise self._unbound(missing) from None

    def _unbound(self, missing: KeyError) -> KeyError:
        return KeyError(f"{self.name}.wgsl declares {missing.args[0]!r}, and nothing is bound to it")

    def _make_group(self, bound: Sequence[Bindable], resources: Bindings) -> BindGroup:
        """The group of what the others are, and then the uniforms' buffers."""
        records: Records = resources  # type: ignore[assignment]  # no cast, which costs time
        sizes = [records[one.name].nbytes for one in self._uniforms]
        return make_group(self.device, self._group_layout, (*self._others, *self._uniforms), bound, sizes)

    def _compile(self, path: Path) -> Untyped:
        try:
            return self.device.handle.create_shader_module(code=self.source.text, label=path.name)
        except Exception as error:
            raise DermisError(
                f"{path.name}: the shader did not compile.\n{self.source.locate(str(error))}"
            ) from error

    def _layout_entries(self) -> list[dict[str, object]]:
        import wgpu

        visibility = sum(int(getattr(wgpu.ShaderStage, stage)) for stage in self.stages)
        uniform = {"buffer": {**UNIFORM, "has_dynamic_offset": True}}
        return [
            {"binding": one.index, "visibility": visibility, **(uniform if _is_uniform(one) else one.entry)}
            for one in self.bindings
        ]


class ComputeProgram(Program):
    """A compute shader with the entry point `main`; `constants` are the shader's `override`s."""

    stages = ("COMPUTE",)

    def __init__(
        self,
        device: Device,
        path: Path,
        folders: Sequence[Folder] = (),
        constants: Mapping[str, float] | None = None,
    ) -> None:
        super().__init__(device, path, folders, constants)
        stage = {"module": self._module, "entry_point": "main", "constants": self.constants}
        self._compiled = device.executor.submit(
            device.handle.create_compute_pipeline, layout=self._layout, compute=stage
        )

    @cached_property
    def pipeline(self) -> Native:
        """Compiled from when the program is made, while others load what it is to work on."""
        pipeline: Native = self._compiled.result()
        return pipeline

    def groups_for(self, size: tuple[int, int], tile: int = 8) -> tuple[int, int]:
        """Workgroups that cover an image of `size` with tiles of `tile` squared."""
        return math.ceil(size[0] / tile), math.ceil(size[1] / tile)


class RasterProgram(Program):
    """A vertex shader `vertex`, and a fragment shader `fragment` when there is a colour target.

    target : format of the colour target, or None for depth only
    depth_compare : wgpu's name ("less", "greater")
    drawn : both
    """

    stages = "VERTEX", "FRAGMENT"

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


class FragmentProgram(Program):
    """A shader whose `fragment` fills whole targets; its `vertex` makes the one triangle that covers them.

    targets : their formats
    """

    stages = ("FRAGMENT",)

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


def compiled(device: Device, shader: Hashable, constants: Constants, make: Callable[[], P]) -> P:
    """What `make` compiles of a shader with these pipeline constants, unless it is one of those used last.

    shader : what tells it from others
    """
    variants: dict[Constants, P] = device.programs.setdefault(shader, {})
    found = variants.pop(constants, None)
    if found is None:
        found = make()
    variants[constants] = found  # the last one
    if len(variants) > _MOST_VARIANTS:
        del variants[next(iter(variants))]
    return found


def declared(path: Path, folders: Sequence[Folder], constants: Constants) -> dict[str, float]:
    """Those of some pipeline constants that the shader has."""
    text = source_of(path, folders).text
    return {name: value for name, value in constants if f"override {name}:" in text}


def source_of(path: Path, folders: Sequence[Folder]) -> Source:
    """The composed text of a shader, which may include the toolkit's own."""
    return compose(path, (*folders, _TOOLKIT_SHADERS))


def _reader(names: Sequence[str]) -> Callable[[Bindings], Sequence[Bindable]]:
    """Takes what is named out of what is given."""
    if len(names) > 1:
        return itemgetter(*names)
    return lambda resources: [resources[name] for name in names]  # of one name it would give no sequence


def _is_uniform(binding: Binding) -> bool:
    return binding.entry.get("buffer") == UNIFORM
