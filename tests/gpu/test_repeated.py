"""Passes recorded once do in each frame what they did in the first, as long as what they bind lives."""

from __future__ import annotations

import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.gpu import ComputeProgram, Device, Frame, download, make_texture, upload
from dermis.gpu.repeated import Recording, Repeated

SIZE = (19, 5)


@pytest.fixture(scope="module")
def scale(device: Device) -> ComputeProgram:
    return ComputeProgram(device, Path(__file__).parent / "scale.wgsl")


class Chain:
    """Two passes in a row, counting how often they are recorded."""

    def __init__(self, device: Device, scale: ComputeProgram, factor: float = 3.0) -> None:
        self.textures = [make_texture(device, SIZE, "r32float") for _ in range(3)]
        self.scale, self.factor, self.recorded = scale, factor, 0

    def record(self, frame: Frame) -> None:
        self.recorded += 1
        for stage, (image, scaled) in zip(
            "ab", zip(self.textures, self.textures[1:], strict=False), strict=True
        ):
            factor = self.scale.record("Factor", value=self.factor)
            frame.compute(stage, self.scale, {"factor": factor, "image": image, "scaled": scaled}, SIZE)


def drawn(device: Device, repeated: Repeated, chain: Chain, key: Any, value: float) -> Any:
    upload(device, chain.textures[0], np.full(SIZE[::-1], value, np.float32))
    frame = Frame(device)
    repeated.draw(frame, "chain", key, chain.record)
    frame.submit()
    return download(device, chain.textures[2])


def test_later_frames_do_the_same_with_other_light(device: Device, scale: ComputeProgram) -> None:
    chain, repeated = Chain(device, scale), Repeated()
    for value in (1.0, 2.0, 5.0):
        assert np.array_equal(drawn(device, repeated, chain, "one", value), np.full(SIZE[::-1], 9 * value))
    assert chain.recorded == 1


def test_another_key_is_recorded_anew(device: Device, scale: ComputeProgram) -> None:
    chain, repeated = Chain(device, scale), Repeated()
    drawn(device, repeated, chain, "one", 1.0)
    chain.factor = 2.0
    assert drawn(device, repeated, chain, "one", 1.0)[0, 0] == 9.0
    assert drawn(device, repeated, chain, "two", 1.0)[0, 0] == 4.0
    assert chain.recorded == 2


def test_going_back_and_forth_records_each_once(device: Device, scale: ComputeProgram) -> None:
    chain, repeated = Chain(device, scale), Repeated()
    for _ in range(3):
        for factor in (2.0, 3.0, 4.0):
            chain.factor = factor
            assert drawn(device, repeated, chain, factor, 1.0)[0, 0] == factor**2
    assert chain.recorded == 3


def test_those_used_long_ago_are_recorded_anew(device: Device, scale: ComputeProgram) -> None:
    chain, repeated = Chain(device, scale), Repeated()
    for key in (0, 1, 0, 2, 3, 4, 0, 1):  # 1 has gone when 4 came
        drawn(device, repeated, chain, key, 1.0)
    assert chain.recorded == 6


def test_what_the_recording_returned_comes_again(device: Device, scale: ComputeProgram) -> None:
    chain, repeated = Chain(device, scale), Repeated()

    def record(frame: Frame) -> int:
        chain.record(frame)
        return 10 * chain.recorded

    found = []
    for key in ("a", "b", "a"):
        frame = Frame(device)
        found.append(repeated.draw(frame, "chain", key, record))
        frame.submit()
    assert found == [10, 20, 10]


def test_numbers_of_other_frames_do_not_come_in_between(device: Device, scale: ComputeProgram) -> None:
    chain, other, repeated = Chain(device, scale), Chain(device, scale, 7.0), Repeated()
    drawn(device, repeated, chain, "one", 1.0)
    frame = Frame(device)
    other.record(frame)
    frame.submit()
    assert drawn(device, repeated, chain, "one", 1.0)[0, 0] == 9.0


def test_a_recording_keeps_nothing_alive(device: Device, scale: ComputeProgram) -> None:
    chain, repeated = Chain(device, scale), Repeated()
    drawn(device, repeated, chain, "one", 1.0)
    gone = weakref.ref(chain.textures[1])
    chain.textures[1] = make_texture(device, SIZE, "r32float")
    assert gone() is None
    assert drawn(device, repeated, chain, "one", 2.0)[0, 0] == 18.0  # void, so it was recorded anew
    assert chain.recorded == 2


def test_only_dispatches_can_be_recorded(device: Device) -> None:
    with pytest.raises(TypeError, match="only dispatches"):
        Recording(device).clear(None)


def test_stages_of_repeated_passes_are_timed(device: Device, scale: ComputeProgram) -> None:
    chain, repeated = Chain(device, scale), Repeated()
    for _ in range(2):
        frame = Frame(device)
        repeated.draw(frame, "chain", "one", chain.record)
        frame.submit()
        frame.wait()
        times = frame.stage_ms()
        assert times is None or set(times) == {"a", "b", "total"}
