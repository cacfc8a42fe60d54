"""The limits of WebGPU that every device has, with which ours are opened."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from dermis.base.errors import refuse

DEFAULT_LIMITS = {
    "max-texture-dimension-1d": 8192,
    "max-texture-dimension-2d": 8192,
    "max-texture-dimension-3d": 2048,
    "max-texture-array-layers": 256,
    "max-bind-groups": 4,
    "max-bindings-per-bind-group": 1000,
    "max-dynamic-uniform-buffers-per-pipeline-layout": 8,
    "max-dynamic-storage-buffers-per-pipeline-layout": 4,
    "max-sampled-textures-per-shader-stage": 16,
    "max-samplers-per-shader-stage": 16,
    "max-storage-buffers-per-shader-stage": 8,
    "max-storage-textures-per-shader-stage": 4,
    "max-uniform-buffers-per-shader-stage": 12,
    "max-uniform-buffer-binding-size": 65536,
    "max-storage-buffer-binding-size": 128 << 20,
    "max-buffer-size": 256 << 20,
    "min-uniform-buffer-offset-alignment": 256,
    "min-storage-buffer-offset-alignment": 256,
    "max-vertex-buffers": 8,
    "max-vertex-attributes": 16,
    "max-vertex-buffer-array-stride": 2048,
    "max-inter-stage-shader-variables": 16,
    "max-color-attachments": 8,
    "max-color-attachment-bytes-per-sample": 32,
    "max-compute-workgroup-storage-size": 16384,
    "max-compute-invocations-per-workgroup": 256,
    "max-compute-workgroup-size-x": 256,
    "max-compute-workgroup-size-y": 256,
    "max-compute-workgroup-size-z": 64,
    "max-compute-workgroups-per-dimension": 65535,
    "max-immediate-size": 0,
}
"""Limits that WebGPU guarantees on every machine ("Limits" in its specification)."""
_NEEDED = tuple(
    name for name in DEFAULT_LIMITS if any(word in name for word in ("stage", "compute", "group", "layout"))
)
"""What programs rely on; sizes of textures and buffers may be smaller."""


def check_limits(adapter: str, offered: Mapping[str, int]) -> None:
    """Raises DermisError for an adapter that cannot run the programs of a frame.

    adapter, offered : its name and its limits
    """
    for name in _NEEDED:
        least = DEFAULT_LIMITS[name]
        if offered.get(name, least) < least:
            expected = f"{name} of at least {least}, as WebGPU promises"
            remedy = "Choose another adapter, which dermis doctor lists, or update its driver"
            refuse(f"adapter {adapter}", expected, f"it has {offered[name]}", remedy)


def limits_within(offered: Mapping[str, int], raised: Sequence[str]) -> dict[str, int]:
    """WebGPU's default limits; the adapter's own where it offers less or the limit is to be raised."""
    fitting = {
        name: (max if name.startswith("min-") else min)(default, offered.get(name, default))
        for name, default in DEFAULT_LIMITS.items()
    }
    return fitting | {name: offered[name] for name in raised}
