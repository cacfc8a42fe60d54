"""Toolkit on top of wgpu: adapters, devices, shaders, textures, passes and the frame graph."""

from dermis.gpu.adapters import Adapter, list_adapters
from dermis.gpu.command_list import CommandList
from dermis.gpu.dependencies import mark_scratch
from dermis.gpu.device import Device, open_device
from dermis.gpu.graph import Graph
from dermis.gpu.memo import Memo
from dermis.gpu.program import ComputeProgram, Constants, RenderProgram, cached_program
from dermis.gpu.recorder import DrawTarget, Recorder
from dermis.gpu.textures import download, make_texture, make_view, texture_from_array, upload
from dermis.gpu.types import (
    Bindable,
    Bindings,
    Buffer,
    MutableBindings,
    Resource,
    Sampler,
    Texture,
    TextureOrView,
    TextureView,
    UniformRecord,
)

__all__ = [
    "Adapter",
    "Bindable",
    "Bindings",
    "Buffer",
    "CommandList",
    "ComputeProgram",
    "Constants",
    "Device",
    "DrawTarget",
    "Graph",
    "Memo",
    "MutableBindings",
    "Recorder",
    "RenderProgram",
    "Resource",
    "Sampler",
    "Texture",
    "TextureOrView",
    "TextureView",
    "UniformRecord",
    "cached_program",
    "download",
    "list_adapters",
    "make_texture",
    "make_view",
    "mark_scratch",
    "open_device",
    "texture_from_array",
    "upload",
]
