"""Bind groups. They are created by direct calls of wgpu's native library, as wgpu's Python code is slower."""

from __future__ import annotations

import weakref
from collections.abc import Sequence, Sized
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

from dermis.gpu.device import Device
from dermis.gpu.shader_types import Binding, LayoutEntry
from dermis.gpu.types import NativeObject, Texture, TextureOrView, Untyped, is_texture

UNIFORM_BUFFER = {"type": "uniform"}

_NATIVE_VIEW_DIMENSIONS = {"2d": 2, "2d-array": 3}  # WGPUTextureViewDimension

_ALL_MIP_LEVELS = _ALL_LAYERS = 0xFFFFFFFF

_ALL_TEXTURE_ASPECTS = 1  # WGPUTextureAspect_All

ResourceKey = tuple[int, ...]

T = TypeVar("T")


class BindGroup:
    """Bind group, which keeps the bound resources alive.

    _internal : handle in the native library, released with this object; wgpu's own objects have the
        same attribute
    """

    __slots__ = ("__weakref__", "_internal")

    def __init__(self, device: Device, layout: NativeObject, native_entries: Sized) -> None:
        descriptor = device.ffi.new("WGPUBindGroupDescriptor *")
        descriptor.layout, descriptor.entries, descriptor.entryCount = (
            layout._internal,
            native_entries,
            len(native_entries),
        )
        handle = device.checked.wgpuDeviceCreateBindGroup(device.handle._internal, descriptor)
        self._internal = device.ffi.gc(handle, device.lib.wgpuBindGroupRelease)


def make_bind_group(
    device: Device,
    layout: NativeObject,
    bindings: Sequence[Binding],
    bound_objects: Sequence[Untyped],
    record_sizes: Sequence[int],
) -> BindGroup:
    """Create the bind group of a program.

    layout : native bind group layout of the program
    bindings : bindings that the shader declares
    bound_objects : buffer, texture, texture view or sampler for each binding, the uniform buffers last
    record_sizes : size of the record in each uniform buffer [byte]
    """
    entries = device.ffi.new("WGPUBindGroupEntry[]", len(bound_objects))
    first_uniform = len(bound_objects) - len(record_sizes)
    for k, (binding, value) in enumerate(zip(bindings, bound_objects, strict=True)):
        entry, kind = entries[k], binding.entry
        entry.binding = binding.index
        if "buffer" in kind:
            entry.buffer = value._internal
            entry.size = value.size if k < first_uniform else record_sizes[k - first_uniform]
        elif "sampler" in kind:
            entry.sampler = value._internal
        else:
            entry.textureView = _view_handle(device, value, kind.get("texture") or kind["storage_texture"])
    return BindGroup(device, layout, entries)


class ResourceCache(Generic[T]):
    """Cache keyed by the identity of resources; an object is dropped when one of its resources is released.

    A cached bind group keeps the memory of its resources allocated. The cache therefore drops a bind group as
    soon as one of its resources is no longer used elsewhere.
    """

    def __init__(self) -> None:
        self._entries: dict[ResourceKey, T] = {}
        # For the id of each resource: a reference that watches its release, and the keys that contain it.
        self._keys: dict[int, tuple[weakref.ref[object], set[ResourceKey]]] = {}

    def __len__(self) -> int:
        """Return the number of cached objects."""
        return len(self._entries)

    @property
    def resource_count(self) -> int:
        """Return the number of resources that the cached objects use.

        The cache observes these resources, to drop the objects that use a resource when it is released.
        """
        return len(self._keys)

    def find(self, cache_key: ResourceKey) -> T | None:
        """Return the cached object for a key from `resource_key`; None if there is no such object."""
        return self._entries.get(cache_key)

    def add(self, cache_key: ResourceKey, resources: Sequence[object], cached_object: T) -> None:
        """Cache an object until one of its resources is released."""
        self._entries[cache_key] = cached_object
        for resource in resources:
            self._cache_keys_of(resource).add(cache_key)

    def _cache_keys_of(self, resource: object) -> set[ResourceKey]:
        """Return the cache keys that contain a resource; for a new resource, start watching its release."""
        identity = id(resource)
        if identity not in self._keys:
            this = weakref.ref(self)

            def on_release(_: object) -> None:
                cache = this()
                if cache is not None:
                    cache._drop_objects_with(identity)

            self._keys[identity] = weakref.ref(resource, on_release), set()
        return self._keys[identity][1]

    def _drop_objects_with(self, resource_id: int) -> None:
        _, keys = self._keys.pop(resource_id)
        for key in keys:
            self._entries.pop(key, None)
            for other in set(key) & self._keys.keys():
                self._keys[other][1].discard(key)


def resource_key(resources: Sequence[object]) -> ResourceKey:
    """Return the cache key of a sequence of resources: their Python ids in order."""
    return tuple(map(id, resources))


def _view_handle(device: Device, texture_or_view: TextureOrView, texture_layout: LayoutEntry) -> object:
    """Return the native handle of a view; for a texture, the handle of its default view, which is cached.

    texture_layout : bind group layout entry of the texture; it contains the view dimension
    """
    if is_texture(texture_or_view):
        return _default_view(device, texture_or_view, texture_layout["view_dimension"])
    return texture_or_view._internal


def _default_view(device: Device, texture: Texture, view_dimension: str) -> object:
    views = device.cached("default views", WeakKeyDictionary[Texture, dict[str, object]]).setdefault(
        texture, {}
    )
    if view_dimension not in views:
        descriptor = device.ffi.new("WGPUTextureViewDescriptor *")
        descriptor.dimension, descriptor.aspect = (
            _NATIVE_VIEW_DIMENSIONS[view_dimension],
            _ALL_TEXTURE_ASPECTS,
        )
        descriptor.mipLevelCount = _ALL_MIP_LEVELS
        descriptor.arrayLayerCount = 1 if view_dimension == "2d" else _ALL_LAYERS
        handle = device.checked.wgpuTextureCreateView(texture._internal, descriptor)
        views[view_dimension] = device.ffi.gc(handle, device.lib.wgpuTextureViewRelease)
    return views[view_dimension]
