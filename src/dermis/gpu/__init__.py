"""A small toolkit over wgpu: it knows adapters, shaders, textures and passes, and nothing of skin."""

from dermis.gpu.adapters import Adapter, list_adapters
from dermis.gpu.device import Device, open_device
from dermis.gpu.frame import Frame
from dermis.gpu.program import ComputeProgram, FragmentProgram, RasterProgram
from dermis.gpu.textures import download, make_texture, upload

__all__ = [
    "Adapter",
    "ComputeProgram",
    "Device",
    "FragmentProgram",
    "Frame",
    "RasterProgram",
    "download",
    "list_adapters",
    "make_texture",
    "open_device",
    "upload",
]
