"""A small toolkit over wgpu: it knows adapters, shaders, textures and passes, and nothing of skin."""

from dermis.gpu.access import scratch
from dermis.gpu.adapters import Adapter, list_adapters
from dermis.gpu.device import Device, open_device
from dermis.gpu.frame import Frame
from dermis.gpu.graph import Graph
from dermis.gpu.memo import Memo
from dermis.gpu.program import ComputeProgram, Constants, compiled
from dermis.gpu.raster_program import FragmentProgram, RasterProgram
from dermis.gpu.recorder import Recorder
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
    "ComputeProgram",
    "Constants",
    "Device",
    "FragmentProgram",
    "Frame",
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
    "scratch",
    "texture_from",
    "upload",
    "view_of",
]
