"""Typing protocols for the textures, buffers and samplers of wgpu, which has no type annotations.

Type checkers tell the protocols apart by the types of their native handles.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NewType, Protocol, TypeGuard

import numpy as np
from numpy.typing import NDArray

TextureHandle = NewType("TextureHandle", object)
ViewHandle = NewType("ViewHandle", object)
BufferHandle = NewType("BufferHandle", object)
SamplerHandle = NewType("SamplerHandle", object)


class Texture(Protocol):
    """Protocol of a 2-D texture or a 2-D texture array.

    size : width and height [texel], and number of layers
    format : wgpu's name of the texel format, such as "rgba32float"
    usage : flags of `wgpu.TextureUsage`
    """

    _internal: TextureHandle
    size: tuple[int, int, int]
    format: str
    usage: int
    mip_level_count: int

    def create_view(
        self,
        *,
        dimension: str | None = None,
        base_array_layer: int = 0,
        array_layer_count: int | None = None,
        base_mip_level: int = 0,
        mip_level_count: int | None = None,
    ) -> TextureView:
        """Return a view of a range of layers and mip levels; by default of all layers and levels."""

    def destroy(self) -> None:
        """Free the memory of the texture at once."""


class TextureView(Protocol):
    """Protocol of a view of some layers and mip levels of a texture.

    texture : the viewed texture
    layer_and_mip : layer and mip level of a view that `make_view` created
    """

    _internal: ViewHandle
    texture: Texture
    layer_and_mip: tuple[int, int]


class Buffer(Protocol):
    """Protocol of a buffer on a device.

    size : size of the buffer [byte]
    usage : flags of `wgpu.BufferUsage`
    """

    _internal: BufferHandle
    size: int
    usage: int

    def destroy(self) -> None:
        """Free the memory of the buffer at once."""


class Sampler(Protocol):
    """Protocol of a texture sampler, from `Device.sampler`."""

    _internal: SamplerHandle


class NativeObject(Protocol):
    """Protocol of objects with a handle in the native library: pipelines, layouts, bind groups."""

    _internal: object


Untyped = Any
"""Objects of wgpu without a protocol here: devices, encoders, passes, query sets."""
UniformRecord = NDArray[np.void]
"""Struct of a shader in uniform memory: a structured array without dimensions, see `Program.make_record`."""
TextureOrView = Texture | TextureView
"""A texture that a pass reads or stores to, or a view of one."""
Resource = Texture | TextureView | Buffer
"""Anything with content on the device."""
Bindable = Resource | Sampler | NDArray[np.generic]
"""Anything that a name in a shader can be bound to; arrays are records for uniform memory."""
Bindings = Mapping[str, Bindable]
"""Resources and records by their names in the shader."""
MutableBindings = dict[str, Bindable]
"""Bindings that can be added to."""


def is_texture(value: Bindable) -> TypeGuard[Texture]:
    """Return whether a bound object is a texture, as opposed to a texture view."""
    return hasattr(value, "mip_level_count")


def is_view(value: Bindable) -> TypeGuard[TextureView]:
    """Return whether a bound object is a texture view."""
    return hasattr(value, "texture")


def is_buffer(value: Bindable) -> TypeGuard[Buffer]:
    """Return whether a bound object is a buffer."""
    return hasattr(value, "write_mapped")


def is_sampler(value: Bindable) -> TypeGuard[Sampler]:
    """Return whether a bound object is a sampler."""
    return not (is_texture(value) or is_view(value) or is_buffer(value) or isinstance(value, np.ndarray))
