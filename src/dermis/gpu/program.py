"""Programs: compiled WGSL shaders whose resources are bound by their names in the shader."""

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
from dermis.gpu.bind_groups import UNIFORM_BUFFER, BindGroup, ResourceCache, make_bind_group, resource_key
from dermis.gpu.dependencies import Access, new_access_id, resource_state
from dermis.gpu.device import Device
from dermis.gpu.shader_types import Binding, make_record, shader_bindings, used_member_selector
from dermis.gpu.types import Bindable, Bindings, NativeObject, UniformRecord, Untyped
from dermis.gpu.uniforms import Uniforms
from dermis.gpu.wgsl_source import Folder, ShaderSource, compose_shader

UniformRecords = Mapping[str, NDArray[np.generic]]
"""Uniform records by their names in the shader, without other resources."""

P = TypeVar("P")

_GPU_SHADER_FOLDER = Path(__file__).parent / "wgsl"

_MIN_LARGE_RECORD_BYTES = 2048  # the record of a skin is smaller, and few shaders read all of it

_MAX_CACHED_VARIANTS = 12  # for each shader; on a software adapter each variant takes some 7 MB

Constants = tuple[tuple[str, float], ...]
"""Names and values of pipeline constants (`override` in WGSL); others keep their default."""


class Program:
    """Base class of programs: a composed shader with its bindings and its pipeline layout.

    path : WGSL file
    folders : folders that are searched for included files
    constants : pipeline constants by name
    stages : shader stages that can use the bindings, by their names in `wgpu.ShaderStage`
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
        self.source = shader_source(path, folders)
        self.bindings: tuple[Binding, ...] = shader_bindings(self.source.text)
        self._module = self._compile_shader(path)
        self._uniforms = [b for b in self.bindings if _is_uniform(b)]
        self._resource_bindings = [b for b in self.bindings if not _is_uniform(b)]
        self._get_resources = _binding_getter([b.name for b in self._resource_bindings])
        self._used_members = [
            (one.name, used_member_selector(self.source.text, one.name)) for one in self._uniforms
        ]
        self.bind_groups: ResourceCache[BindGroup] = ResourceCache()
        self._accesses: ResourceCache[Access] = ResourceCache()
        self._group_layout = device.handle.create_bind_group_layout(entries=self._layout_entries())
        self._layout = device.handle.create_pipeline_layout(bind_group_layouts=[self._group_layout])

    def make_record(self, struct_name: str, **values: object) -> UniformRecord:
        """Return a uniform record for a struct of the shader; members without a value are 0."""
        return make_record(self.source.text, struct_name, **values)

    def uniform_record_positions(self, resources: Bindings, uniforms: Uniforms) -> tuple[int, ...]:
        """Return the positions of the bound uniform records in uniform memory [byte].

        resources : resources and uniform records by their names in the shader
        uniforms : memory in which the uniform records are placed
        """
        records: UniformRecords = resources  # type: ignore[assignment]  # no cast, which costs time
        try:
            return tuple([uniforms.position(records[name]) for name, _ in self._used_members])
        except KeyError as missing:
            raise self._unbound_error(missing) from None

    def bind_group(self, resources: Bindings, uniforms: Uniforms) -> tuple[BindGroup, list[int]]:
        """Return the bind group for resources, and the dynamic offsets of its uniform records [byte].

        resources : buffers, textures, texture views, samplers and NumPy records by their names in the shader;
            records are placed in uniform memory
        uniforms : memory in which the records are placed
        """
        located = [
            uniforms.locate(position) for position in self.uniform_record_positions(resources, uniforms)
        ]
        bound = [*self._bound_resources(resources), *(buffer for buffer, _ in located)]
        key = resource_key(bound)
        group = self.bind_groups.find(key)
        if group is None:
            group = self._make_bind_group(bound, resources)
            self.bind_groups.add(key, bound, group)
        return group, [offset for _, offset in located]

    def resource_access(self, resources: Bindings) -> Access:
        """Return the resources that a pass with these bindings reads and writes, without uniform records."""
        bound = self._bound_resources(resources)
        key = resource_key(bound)
        found = self._accesses.find(key)
        if found is None:
            named = list(zip(self._resource_bindings, bound, strict=True))
            reads = tuple(
                resource_state(self.device, value)
                for one, value in named
                if one.has_content and one.is_readable
            )
            writes = tuple(resource_state(self.device, value) for one, value in named if one.is_writable)
            found = Access(new_access_id(), reads, writes)
            self._accesses.add(key, bound, found)
        return found

    def used_uniform_bytes(self, resources: Bindings, uniforms: Uniforms) -> tuple[Hashable, ...]:
        """Return the bytes of uniform records that the shader reads, to detect passes with changed inputs.

        For large records, all bytes are returned: they are the same object for all passes that use the
        record, so Python computes their hash only once.

        resources : resources and uniform records by their names in the shader
        uniforms : memory in which the uniform records are placed
        """
        found: list[Hashable] = []
        records: UniformRecords = resources  # type: ignore[assignment]  # no cast, which costs time
        try:
            for name, select in self._used_members:
                raw = uniforms.bytes_of(records[name])
                found.append(raw if len(raw) > _MIN_LARGE_RECORD_BYTES else select(raw))
        except KeyError as missing:
            raise self._unbound_error(missing) from None
        return tuple(found)

    def _bound_resources(self, resources: Bindings) -> Sequence[Bindable]:
        """Return the resources to bind, in the order of the shader's bindings, without uniform records.

        resources : resources and uniform records by their names in the shader
        """
        try:
            return self._get_resources(resources)
        except KeyError as missing:
            raise self._unbound_error(missing) from None

    def _unbound_error(self, key_error: KeyError) -> KeyError:
        return KeyError(f"{self.name}.wgsl declares {key_error.args[0]!r}, and nothing is bound to it")

    def _make_bind_group(
        self, ordered_resources: Sequence[Bindable], resources_by_name: Bindings
    ) -> BindGroup:
        """Create the bind group of the shader.

        ordered_resources : resources to bind, in the order of the bindings; the last ones are the buffers
            that contain the uniform records
        resources_by_name : resources and uniform records by their names in the shader; only the sizes of the
            uniform records are used
        """
        records: UniformRecords = resources_by_name  # type: ignore[assignment]  # no cast, which costs time
        sizes = [records[one.name].nbytes for one in self._uniforms]
        return make_bind_group(
            self.device,
            self._group_layout,
            (*self._resource_bindings, *self._uniforms),
            ordered_resources,
            sizes,
        )

    def _compile_shader(self, path: Path) -> Untyped:
        try:
            return self.device.handle.create_shader_module(code=self.source.text, label=path.name)
        except Exception as error:
            raise DermisError(
                f"{path.name}: the shader did not compile.\n{self.source.locate(str(error))}"
            ) from error

    def _layout_entries(self) -> list[dict[str, object]]:
        import wgpu

        visibility = sum(int(getattr(wgpu.ShaderStage, stage)) for stage in self.stages)
        uniform = {"buffer": {**UNIFORM_BUFFER, "has_dynamic_offset": True}}
        return [
            {"binding": one.index, "visibility": visibility, **(uniform if _is_uniform(one) else one.entry)}
            for one in self.bindings
        ]


class ComputeProgram(Program):
    """Compute program with the entry point `main`, whose pipeline is compiled on another thread."""

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
    def pipeline(self) -> NativeObject:
        """Return the compute pipeline, waiting for its compilation if necessary."""
        pipeline: NativeObject = self._compiled.result()
        return pipeline

    def workgroups_for(self, image_size: tuple[int, int], tile_side: int = 8) -> tuple[int, int]:
        """Return the numbers of workgroups along x and y that cover an image.

        image_size : width and height of the image [texel]
        tile_side : side of a workgroup [invocations]
        """
        return math.ceil(image_size[0] / tile_side), math.ceil(image_size[1] / tile_side)


class RenderProgram(Program):
    """Render program with the entry points `vertex` and, if it has colour targets, `fragment`.

    targets : texture formats of the colour targets; empty to draw only depth
    depth_compare : wgpu's name of the depth test, such as "less"; None for no depth attachment
    has_fragment : whether `fragment` runs; None to run it if there are targets. Without targets, `fragment`
        may discard pixels of the depth pass
    raster : depth test and format of the first target, for programs that replay captured frames
        (see capture.py)
    """

    stages = "VERTEX", "FRAGMENT"

    def __init__(
        self,
        device: Device,
        path: Path,
        folders: Sequence[Folder] = (),
        constants: Mapping[str, float] | None = None,
        *,
        targets: Sequence[str],
        depth_compare: str | None = None,
        has_fragment: bool | None = None,
    ) -> None:
        super().__init__(device, path, folders, constants)
        self.raster = {"target": next(iter(targets), None), "depth_compare": depth_compare}
        stage = {"module": self._module, "constants": self.constants}
        fragment = {**stage, "entry_point": "fragment", "targets": [{"format": texel} for texel in targets]}
        depth = {"format": "depth32float", "depth_write_enabled": True, "depth_compare": depth_compare}
        self.pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={**stage, "entry_point": "vertex"},
            fragment=fragment if (targets if has_fragment is None else has_fragment) else None,
            primitive={"topology": "triangle-list"},
            depth_stencil=depth if depth_compare else None,
        )


def cached_program(
    device: Device, shader_key: Hashable, constants: Constants, compile_program: Callable[[], P]
) -> P:
    """Return the program for a shader and pipeline constants, from the cache if it was used recently.

    shader_key : key that identifies the shader
    compile_program : function that compiles the program
    """
    variants: dict[Constants, P] = device.programs.setdefault(shader_key, {})
    found = variants.pop(constants, None)
    if found is None:
        found = compile_program()
    variants[constants] = found  # the most recently used one is last
    if len(variants) > _MAX_CACHED_VARIANTS:
        del variants[next(iter(variants))]
    return found


def used_constants(path: Path, folders: Sequence[Folder], constants: Constants) -> dict[str, float]:
    """Return, by name, only those pipeline constants that a shader declares, as WebGPU refuses others."""
    text = shader_source(path, folders).text
    return {name: value for name, value in constants if f"override {name}:" in text}


def shader_source(path: Path, folders: Sequence[Folder]) -> ShaderSource:
    """Return a shader with its includes and other directives expanded.

    folders : folders that are searched for included files, before the shaders of `dermis.gpu`
    """
    return compose_shader(path, (*folders, _GPU_SHADER_FOLDER))


def _binding_getter(resource_names: Sequence[str]) -> Callable[[Bindings], Sequence[Bindable]]:
    """Return a function that takes bindings and returns the resources with the given names, in order."""
    if len(resource_names) > 1:
        return itemgetter(*resource_names)
    return lambda resources: [
        resources[name] for name in resource_names
    ]  # itemgetter returns no sequence for one name


def _is_uniform(binding: Binding) -> bool:
    return binding.entry.get("buffer") == UNIFORM_BUFFER
