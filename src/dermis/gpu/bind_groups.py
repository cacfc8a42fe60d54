"""Bind groups, made by the native library: a frame of another head needs dozens of new ones."""

from __future__ import annotations

import weakref
from collections.abc import Sequence, Sized
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

from dermis.gpu.device import Device
from dermis.gpu.shader_types import Binding, Entry
from dermis.gpu.types import Native, Texture, TextureOrView, Untyped, is_texture

UNIFORM = {"type": "uniform"}

_DIMENSIONS = {"2d": 2, "2d-array": 3}  # WGPUTextureViewDimension

_ALL_LEVELS = _ALL_LAYERS = 0xFFFFFFFF

_WHOLE = 1  # WGPUTextureAspect_All

Key = tuple[int, ...]

T = TypeVar("T")


class BindGroup:
    """A bind group of the library, which keeps alive what is bound; released with this.

    _internal : the library's, as `wgpu` calls it too
    """

    __slots__ = ("__weakref__", "_internal")

    def __init__(self, device: Device, layout: Native, entries: Sized) -> None:
        described = device.ffi.new("WGPUBindGroupDescriptor *")
        described.layout, described.entries, described.entryCount = layout._internal, entries, len(entries)
        made = device.checked.wgpuDeviceCreateBindGroup(device.handle._internal, described)
        self._internal = device.ffi.gc(made, device.lib.wgpuBindGroupRelease)


def make_group(
    device: Device,
    layout: Native,
    bindings: Sequence[Binding],
    values: Sequence[Untyped],
    records: Sequence[int],
) -> BindGroup:
    """The bind group of values for bindings.

    values : a buffer, a texture, a view of one or a sampler each
    records : bytes of the records that the last ones, uniform buffers, have places for
    """
    entries = device.ffi.new("WGPUBindGroupEntry[]", len(values))
    plain = len(values) - len(records)
    for k, (binding, value) in enumerate(zip(bindings, values, strict=True)):
        entry, kind = entries[k], binding.entry
        entry.binding = binding.index
        if "buffer" in kind:
            entry.buffer, entry.size = value._internal, value.size if k < plain else records[k - plain]
        elif "sampler" in kind:
            entry.sampler = value._internal
        else:
            entry.textureView = _view(device, value, kind.get("texture") or kind["storage_texture"])
    return BindGroup(device, layout, entries)


class ResourceCache(Generic[T]):
    """Bind groups and the like, keyed by the identity of the resources that they bind.

    A bind group keeps its resources' memory alive, so it is dropped as soon as one of them is no longer held
    elsewhere.
    """

    def __init__(self) -> None:
        self._kept: dict[Key, T] = {}
        self._users: dict[int, tuple[weakref.ref[object], set[Key]]] = {}

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def followed(self) -> int:
        """Number of resources that entries depend on."""
        return len(self._users)

    def find(self, key: Key) -> T | None:
        """The entry for a key from `key_of`, None without one."""
        return self._kept.get(key)

    def keep(self, key: Key, resources: Sequence[object], made: T) -> None:
        """Keep an entry for as long as all of its key's resources live."""
        self._kept[key] = made
        for resource in resources:
            self._user(resource).add(key)

    def _user(self, resource: object) -> set[Key]:
        """The keys that contain a resource; new resources are watched until they are released."""
        name = id(resource)
        if name not in self._users:
            this = weakref.ref(self)

            def gone(_: object) -> None:
                kept = this()
                if kept is not None:
                    kept._forget(name)

            self._users[name] = weakref.ref(resource, gone), set()
        return self._users[name][1]

    def _forget(self, name: int) -> None:
        _, keys = self._users.pop(name)
        for key in keys:
            self._kept.pop(key, None)
            for other in set(key) & self._users.keys():
                self._users[other][1].discard(key)


def key_of(resources: Sequence[object]) -> Key:
    """The key for these resources in this order."""
    return tuple(map(id, resources))


def _view(device: Device, value: TextureOrView, texture: Entry) -> object:
    """The library's view of a whole texture, made once for each dimension; a view's own."""
    if is_texture(value):
        return _whole_view(device, value, texture["view_dimension"])
    return value._internal


def _whole_view(device: Device, texture: Texture, dimension: str) -> object:
    views = device.shared("whole views", WeakKeyDictionary[Texture, dict[str, object]]).setdefault(
        texture, {}
    )
    if dimension not in views:
        described = device.ffi.new("WGPUTextureViewDescriptor *")
        described.dimension, described.aspect = _DIMENSIONS[dimension], _WHOLE
        described.mipLevelCount = _ALL_LEVELS
        described.arrayLayerCount = 1 if dimension == "2d" else _ALL_LAYERS
        made = device.checked.wgpuTextureCreateView(texture._internal, described)
        views[dimension] = device.ffi.gc(made, device.lib.wgpuTextureViewRelease)
    return views[dimension]
