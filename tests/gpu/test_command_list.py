"""Command lists: order of passes, stage times and uniforms."""

from __future__ import annotations

import weakref
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.gpu import CommandList, ComputeProgram, Device, download, make_texture
from dermis.gpu.bind_groups import ResourceCache, resource_key
from dermis.gpu.command_list import Timing
from dermis.gpu.failures import converted_gpu_failures
from dermis.gpu.textures import float16_store_rounding, texture_from_array
from dermis.gpu.uniforms import UNIFORM_CHUNK_BYTES, Uniforms

SIZE = (37, 21)  # no multiple of a tile


@pytest.fixture(scope="module")
def scale(device: Device) -> ComputeProgram:
    return ComputeProgram(device, Path(__file__).parent / "scale.wgsl")


def test_passes_follow_each_other(device: Device, scale: ComputeProgram) -> None:
    image = np.random.default_rng(1).random(SIZE[::-1]).astype(np.float32)
    textures = [texture_from_array(device, image, "r32float")]
    frame = CommandList(device)
    for factor in (2.0, 3.0, 0.5):
        textures.append(make_texture(device, SIZE, "r32float"))
        bound = {
            "factor": scale.make_record("Factor", value=factor),
            "image": textures[-2],
            "scaled": textures[-1],
        }
        frame.compute("scale", scale, bound, SIZE)
    frame.submit()
    assert np.array_equal(download(device, textures[-1]), 3 * image)


def test_stage_times_add_up_to_the_total(device: Device, scale: ComputeProgram) -> None:
    frame = CommandList(device)
    image, into = (make_texture(device, (512, 512), "r32float") for _ in range(2))
    for stage in ("one", "two", "one"):
        bound = {"factor": scale.make_record("Factor", value=1), "image": image, "scaled": into}
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


def staged_times(device: Device, scale: ComputeProgram, timed: Timing) -> tuple[dict[str, float] | None, int]:
    """Return the stage times of a frame with two alternating stages, and the number of its timestamps."""
    image, into = (make_texture(device, SIZE, "r32float") for _ in range(2))
    frame = CommandList(device, timed=timed)
    for stage in ("one", "two", "one"):
        bound = {"factor": scale.make_record("Factor", value=1), "image": image, "scaled": into}
        frame.compute(stage, scale, bound, SIZE)
    frame.submit()
    frame.wait()
    return frame.stage_ms(), len(frame._timestamps._stages) if frame._timestamps else 0


def test_a_frame_timed_as_a_whole_is_not_divided(
    device: Device, scale: ComputeProgram, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Check that two timestamps are written; on software adapters their values are wrong."""
    if not device.has_timestamps:
        pytest.skip("no timestamps")
    monkeypatch.setattr(device, "adapter", replace(device.adapter, kind="DiscreteGPU"))
    times, stamps = staged_times(device, scale, "whole")
    assert times is not None and set(times) == {"total"} and stamps == 2
    times, stamps = staged_times(device, scale, True)
    assert times is not None and set(times) == {"one", "two", "total"} and stamps == 4


def test_software_adapters_time_stages(device: Device, scale: ComputeProgram) -> None:
    if device.adapter.kind != "CPU":
        pytest.skip("a GPU")
    times, _ = staged_times(device, scale, "whole")
    assert times is not None and set(times) == {"one", "two", "total"}


def test_an_empty_frame_takes_no_time(device: Device) -> None:
    frame = CommandList(device)
    frame.submit()
    frame.wait()
    assert sum((frame.stage_ms() or {}).values()) == 0


def record_of(scale: ComputeProgram, value: float) -> Any:
    return scale.make_record("Factor", value=value)


def test_uniform_records_keep_distinct_offsets(device: Device, scale: ComputeProgram) -> None:
    uniforms, record = Uniforms(device), record_of(scale, 1.25)
    first, same = (uniforms.position(record) for _ in range(2))
    others = [uniforms.position(record_of(scale, 1.5)) for _ in range(4)]  # each released before the next
    assert first == same and len({first, *others}) == 5


def test_uniform_memory_is_reused(device: Device, scale: ComputeProgram) -> None:
    image, into = (make_texture(device, SIZE, "r32float") for _ in range(2))
    spare = []
    for value in range(3):
        frame = CommandList(device, timed=False)
        bound = {"factor": record_of(scale, value), "image": image, "scaled": into}
        frame.compute("scale", scale, bound, SIZE)
        frame.submit()
        spare.append(len(device.spare_chunks))
    assert spare[0] > 0 and len(set(spare)) == 1


def test_one_frame_may_have_more_uniforms_than_a_buffer_holds(device: Device, scale: ComputeProgram) -> None:
    count = UNIFORM_CHUNK_BYTES // 256 + 3
    image = texture_from_array(device, np.ones((1, 1), np.float32), "r32float")
    frame, made = CommandList(device), [make_texture(device, (1, 1), "r32float") for _ in range(count)]
    for value, into in enumerate(made):
        frame.compute(
            "scale", scale, {"factor": record_of(scale, value), "image": image, "scaled": into}, (1, 1)
        )
    frame.submit()
    for value in (0, 1, count - 4, count - 3, count - 1):
        assert download(device, made[value])[0, 0] == value


def test_frames_in_flight_keep_their_uniforms(device: Device, scale: ComputeProgram) -> None:
    """Check that frames which share uniform buffers each read their own values, in any order of recording."""
    image = texture_from_array(device, np.ones((64, 64), np.float32), "r32float")
    made = [make_texture(device, (64, 64), "r32float") for _ in range(20)]
    frames = [CommandList(device, timed=False) for _ in made]
    for value, (frame, into) in enumerate(zip(frames, made, strict=True)):
        bound = {"factor": record_of(scale, value), "image": image, "scaled": into}
        frame.compute("scale", scale, bound, (64, 64))
    for frame in frames:
        frame.submit()
    assert [float(download(device, into).min()) for into in made] == list(range(20))


def test_bind_groups_are_cached(device: Device, scale: ComputeProgram) -> None:
    image, into = (make_texture(device, SIZE, "r32float") for _ in range(2))
    bound = [{"factor": record_of(scale, value), "image": image, "scaled": into} for value in (1, 2)]
    uniforms = Uniforms(device)
    (first, _), (second, _) = (scale.bind_group(one, uniforms) for one in bound)
    assert first is second  # other numbers, the same group


def test_bind_groups_are_dropped_with_their_resources(device: Device) -> None:
    """Check that bind groups do not keep textures alive."""
    program = ComputeProgram(device, Path(__file__).parent / "scale.wgsl")
    uniforms, image = Uniforms(device), make_texture(device, SIZE, "r32float")
    for _ in range(3):
        into = make_texture(device, SIZE, "r32float")
        bound = {"factor": record_of(program, 1), "image": image, "scaled": into}
        group, _ = program.bind_group(bound, uniforms)
        assert len(program.bind_groups) == 1
        gone = weakref.ref(group)
        del group, into, bound
        assert len(program.bind_groups) == 0 and gone() is None
    assert program.bind_groups.resource_count <= 2  # the image and the uniforms


def test_resources_dropped_before_submission_are_still_read(device: Device, scale: ComputeProgram) -> None:
    """Check that the library keeps a bound texture alive until the submission."""
    into, frame = make_texture(device, SIZE, "r32float"), CommandList(device, timed=False)
    image = texture_from_array(device, np.full(SIZE[::-1], 3.0, np.float32), "r32float")
    bound = {"factor": record_of(scale, 2.0), "image": image, "scaled": into}
    frame.compute("scale", scale, bound, SIZE)
    gone = weakref.ref(image)
    del image, bound
    assert gone() is None
    frame.submit()
    assert np.array_equal(download(device, into), np.full(SIZE[::-1], 6.0))


class Resource:
    """An object that can be bound."""


def test_dropped_resources_are_no_longer_tracked() -> None:
    """Check that a new resource at the same address cannot be mistaken for a released one."""
    groups, first, second = ResourceCache[str](), Resource(), Resource()
    groups.add(resource_key([first, second]), [first, second], "group")
    del first
    assert len(groups) == 0 and groups.resource_count == 1
    del second
    assert groups.resource_count == 0


def test_resource_missing_from_the_list_is_named(device: Device, scale: ComputeProgram) -> None:
    with pytest.raises(KeyError, match=r"scale\.wgsl declares 'image'"):
        scale.bind_group({"factor": record_of(scale, 1)}, Uniforms(device))


def test_untimed_frames_report_no_times(device: Device, scale: ComputeProgram) -> None:
    frame = CommandList(device, timed=False)
    image, into = (make_texture(device, SIZE, "r32float") for _ in range(2))
    frame.compute("one", scale, {"factor": record_of(scale, 2), "image": image, "scaled": into}, SIZE)
    frame.submit()
    assert frame.stage_ms() is None


def test_driver_messages_become_package_errors(device: Device) -> None:
    import wgpu

    with pytest.raises(DermisError, match=r"out of memory.*--adapter cpu"), converted_gpu_failures(device):
        raise wgpu.GPUOutOfMemoryError("out of memory")


def test_half_precision_stores_round_as_expected(device: Device) -> None:
    assert float16_store_rounding(device) in {"nearest", "toward zero", "other"}
