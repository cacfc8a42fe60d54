"""Types of what shaders are bound to, as far as this package uses it.

wgpu's objects have no types for mypy. They fit these protocols, which the types of their native handles tell
from each other.
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
    """A 2-D texture, or an array of them.

    size : width, height and layers [texel]
    format : wgpu's name ("rgba32float")
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
        """Return a view of some layers and mip levels, of all by default."""

    def destroy(self) -> None:
        """Free the memory."""


class TextureView(Protocol):
    """A view of layers and mip levels of a texture.

    part : layer and mip level, of a view made by `view_of`
    """

    _internal: ViewHandle
    texture: Texture
    part: tuple[int, int]


class Buffer(Protocol):
    """A buffer.

    size : bytes
    usage : flags of `wgpu.BufferUsage`
    """

    _internal: BufferHandle
    size: int
    usage: int

    def destroy(self) -> None:
        """Free the memory."""


class Sampler(Protocol):
    """A sampler, see `Device.sampler`."""

    _internal: SamplerHandle


class Native(Protocol):
    """An object with a handle for calls of the native library: a pipeline, a layout, a bind group."""

    _internal: object


Untyped = Any
"""Objects of wgpu with many methods, for which mypy has no types: devices, encoders, passes, query sets."""
Record = NDArray[np.void]
"""A struct of a shader in uniform memory: a structured array of no dimensions, as `Program.record` makes."""
TextureOrView = Texture | TextureView
"""What a pass reads as a texture or stores to."""
Resource = Texture | TextureView | Buffer
"""What has content on the device."""
Bindable = Resource | Sampler | NDArray[np.generic]
"""What a name in a shader can be bound to; arrays are records for uniform memory."""
Bindings = Mapping[str, Bindable]
"""What a shader is bound to, by the names in its text."""
MutableBindings = dict[str, Bindable]
"""Bindings that are filled one by one."""


def is_texture(value: Bindable) -> TypeGuard[Texture]:
    """Return whether it is a texture, and no view of one."""
    return hasattr(value, "mip_level_count")


def is_view(value: Bindable) -> TypeGuard[TextureView]:
    """Return whether it is a view of a texture."""
    return hasattr(value, "texture")


def is_buffer(value: Bindable) -> TypeGuard[Buffer]:
    """Return whether it is a buffer."""
    return hasattr(value, "write_mapped")


def is_sampler(value: Bindable) -> TypeGuard[Sampler]:
    """Return whether it is a sampler."""
    return not (is_texture(value) or is_view(value) or is_buffer(value) or isinstance(value, np.ndarray))
