"""Devices: WebGPU's default limits, named features, and threads that end with the device."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from dermis.gpu import ComputeProgram, Device, open_device
from dermis.gpu.adapters import DEFAULT_LIMITS, OPTIONAL_FEATURES

RAISED = {"max-texture-dimension-2d", "max-storage-buffer-binding-size", "max-buffer-size"}


@pytest.fixture(scope="module")
def bare(device: Device) -> Device:
    return open_device(device.adapter.name, guaranteed_capabilities_only=True)


def test_limits_are_the_default_ones(device: Device, bare: Device) -> None:
    limits = {name: device.handle.limits[name] for name in DEFAULT_LIMITS}
    offered = device.adapter.handle.limits
    assert limits == DEFAULT_LIMITS | {name: offered[name] for name in RAISED}
    assert {name: bare.handle.limits[name] for name in DEFAULT_LIMITS} == DEFAULT_LIMITS
    assert (bare.max_texture_size, bare.max_storage_bytes) == (8192, 128 << 20)


def test_only_named_features_are_asked_for(device: Device, bare: Device) -> None:
    """Check the requested features; wgpu always adds `core-features-and-limits`."""
    known = set(device.handle.features) - set(bare.handle.features)
    assert known <= set(OPTIONAL_FEATURES)
    assert not set(bare.handle.features) & set(device.adapter.handle.features) - {"core-features-and-limits"}
    assert not bare.has_timestamps


@pytest.mark.parametrize(
    "declared",
    [
        [f"var t{k}: texture_storage_2d<rgba8uint, write>;" for k in range(5)],
        [f"var<storage, read_write> b{k}: array<u32>;" for k in range(9)],
        [f"var t{k}: texture_2d<f32>;" for k in range(17)],
        ["var t: texture_storage_2d<rgba8uint, read_write>;"],
    ],
    ids=["storage textures", "storage buffers", "sampled textures", "access"],
)
def test_programs_beyond_the_limits_are_refused(device: Device, tmp_path: Path, declared: list[str]) -> None:
    bound = [f"@group(0) @binding({k}) {text}" for k, text in enumerate(declared)]
    shader = tmp_path / "greedy.wgsl"
    shader.write_text("\n".join([*bound, "@compute @workgroup_size(1) fn main() {}"]))
    with pytest.raises(Exception, match=r"(?i)limit|exceed|too many|access|features"):
        assert ComputeProgram(device, shader).pipeline


def test_dropped_device_starts_no_more_work(device: Device) -> None:
    """Check that no compilation starts after the device is dropped, which would delay exit."""
    gate = threading.Event()
    dropped = open_device(device.adapter.name)
    busy = [dropped.executor.submit(gate.wait) for _ in range(os.cpu_count() or 1)]
    waiting = dropped.executor.submit(int)
    try:
        del dropped
        assert waiting.cancelled()
    finally:
        gate.set()
    assert all(one.result(timeout=60) for one in busy)
