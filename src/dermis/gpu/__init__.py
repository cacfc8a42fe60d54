"""A small toolkit over wgpu: it knows adapters, shaders, textures and passes, and nothing of skin."""

from dermis.gpu.adapters import Adapter, list_adapters
from dermis.gpu.command_list import CommandList
from dermis.gpu.dependencies import mark_scratch
from dermis.gpu.device import Device, open_device
from dermis.gpu.graph import Graph
from dermis.gpu.memo import Memo
from dermis.gpu.program import ComputeProgram, Constants, FragmentProgram, RasterProgram, compiled
from dermis.gpu.recorder import DrawTarget, Recorder
from dermis.gpu.textures import download, make_texture, texture_from, upload, view_of
from dermis.gpu.types import (
    Bindable,
    Bindings,
    Buffer,
    MutableBindings,
    Record,
    Resource,
    Sampler,
    Texture,
    TextureOrView,
    TextureView,
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
    "FragmentProgram",
    "Graph",
    "Memo",
    "MutableBindings",
    "RasterProgram",
    "Record",
    "Recorder",
    "Resource",
    "Sampler",
    "Texture",
    "TextureOrView",
    "TextureView",
    "compiled",
    "download",
    "list_adapters",
    "make_texture",
    "open_device",
    "mark_scratch",
    "texture_from",
    "upload",
    "view_of",
]
