"""Passes run in order, are timed by stage, and share their uniforms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.errors import DermisError
from dermis.gpu import ComputeProgram, Device, Frame, download, make_texture
from dermis.gpu.device import _POOLED_UNIFORMS, gpu_failures
from dermis.gpu.probe import half_store_rounding
from dermis.gpu.textures import texture_from

SIZE = (37, 21)  # no multiple of a tile


@pytest.fixture(scope="module")
def scale(device: Device) -> ComputeProgram:
    return ComputeProgram(device, Path(__file__).parent / "scale.wgsl")


def test_passes_follow_each_other(device: Device, scale: ComputeProgram) -> None:
    image = np.random.default_rng(1).random(SIZE[::-1]).astype(np.float32)
    textures = [texture_from(device, image, "r32float")]
    frame = Frame(device)
    for factor in (2.0, 3.0, 0.5):
        textures.append(make_texture(device, SIZE, "r32float"))
        bound = {
            "factor": scale.record("Factor", value=factor),
            "image": textures[-2],
            "scaled": textures[-1],
        }
        frame.compute("scale", scale, bound, SIZE)
    frame.submit()
    assert np.array_equal(download(device, textures[-1]), 3 * image)


def test_stage_times_add_up_to_the_total(device: Device, scale: ComputeProgram) -> None:
    frame = Frame(device)
    image, into = (make_texture(device, (512, 512), "r32float") for _ in range(2))
    for stage in ("one", "two", "one"):
        bound = {"factor": scale.record("Factor", value=1), "image": image, "scaled": into}
        frame.compute(stage, scale, bound, (512, 512))
    frame.submit()
    frame.wait()
    times = frame.stage_ms()
    if times is None:
        assert not device.has_timestamps
        return
    assert set(times) == {"one", "two", "total"}
    assert min(times.values()) >= 0 and times["total"] > 0
    assert times["one"] + times["two"] == pytest.approx(times["total"])


def test_an_empty_frame_takes_no_time(device: Device) -> None:
    frame = Frame(device)
    frame.submit()
    frame.wait()
    assert sum((frame.stage_ms() or {}).values()) == 0


def test_equal_uniforms_are_one_buffer(device: Device, scale: ComputeProgram) -> None:
    records = [scale.record("Factor", value=value) for value in (1.25, 1.25, 1.5)]
    first, same, other = (device.uniform(record) for record in records)
    assert first is same and first is not other


def test_the_uniform_pool_stays_bounded(device: Device, scale: ComputeProgram) -> None:
    kept = device.uniform(scale.record("Factor", value=-1))
    for value in range(_POOLED_UNIFORMS + 50):
        device.uniform(scale.record("Factor", value=value))
        assert device.uniform(scale.record("Factor", value=-1)) is kept  # used again and again: it stays
    assert len(device._uniforms) == _POOLED_UNIFORMS


def test_a_forgotten_resource_is_named(device: Device, scale: ComputeProgram) -> None:
    with pytest.raises(KeyError, match=r"scale\.wgsl declares 'image'"):
        scale.bind_groups({"factor": scale.record("Factor", value=1)})


def test_what_the_driver_says_becomes_our_error(device: Device) -> None:
    import wgpu

    with pytest.raises(DermisError, match=r"out of memory.*--adapter cpu"), gpu_failures(device):
        raise wgpu.GPUOutOfMemoryError("out of memory")


def test_half_stores_round_in_a_known_way(device: Device) -> None:
    assert half_store_rounding(device) in {"nearest", "toward zero", "other"}
