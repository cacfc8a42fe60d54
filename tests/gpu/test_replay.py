"""Recorded passes: replay in later frames while their resources exist."""

from __future__ import annotations

import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.gpu import CommandList, ComputeProgram, Device, Graph, Recorder, download, make_texture, upload

SIZE = (19, 5)


@pytest.fixture(scope="module")
def scale(device: Device) -> ComputeProgram:
    return ComputeProgram(device, Path(__file__).parent / "scale.wgsl")


class Chain:
    """Two successive passes that count how often they are recorded."""

    def __init__(self, device: Device, scale: ComputeProgram) -> None:
        self.graph = Graph(device)
        self.textures = [make_texture(device, SIZE, "r32float") for _ in range(3)]
        self.scale, self.recorded = scale, 0

    def record(self, recorder: Recorder, first: Any, between: Any, last: Any, factor: float) -> float:
        self.recorded += 1
        for stage, image, scaled in (("a", first, between), ("b", between, last)):
            record = self.scale.make_record("Factor", value=factor)
            recorder.compute(stage, self.scale, {"factor": record, "image": image, "scaled": scaled}, SIZE)
        return 10.0 * self.recorded

    def repeated(self, factor: float) -> float:
        """Run a frame of the passes only and return the result of the recording."""
        self.graph.begin()
        returned = self.graph.add_replayable(self.record, *self.textures, factor)
        self.graph.submit()
        return returned

    def drawn(self, value: float, factor: float = 3.0) -> Any:
        """Return the output of the passes for an image of one value."""
        upload(self.graph.device, self.textures[0], np.full(SIZE[::-1], value, np.float32))
        self.graph.invalidate()  # it does not know of uploads
        self.repeated(factor)
        return download(self.graph.device, self.textures[2])


def test_replayed_frames_use_new_light(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale)
    for value in (1.0, 2.0, 5.0):
        assert np.array_equal(chain.drawn(value), np.full(SIZE[::-1], 9 * value))
    assert chain.recorded == 1


def test_changed_arguments_are_recorded_again(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale)
    assert [chain.drawn(1.0, factor)[0, 0] for factor in (3.0, 3.0, 2.0)] == [9.0, 9.0, 4.0]
    assert chain.recorded == 2


def test_alternating_arguments_are_recorded_once_each(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale)
    for _ in range(3):
        for factor in (2.0, 3.0, 4.0):
            assert chain.drawn(1.0, factor)[0, 0] == factor**2
    assert chain.recorded == 3


def test_expired_recordings_are_recorded_again(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale)
    for factor in (0.0, 1.0, 0.0, 2.0, 3.0, 4.0, 0.0, 1.0):  # 1 has gone when 4 came
        chain.drawn(1.0, factor)
    assert chain.recorded == 6


def test_replay_returns_the_recorded_result(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale)
    assert [chain.repeated(factor) for factor in (2.0, 3.0, 2.0)] == [10.0, 20.0, 10.0]


def test_uniforms_of_other_frames_do_not_interfere(device: Device, scale: ComputeProgram) -> None:
    chain, other = Chain(device, scale), Chain(device, scale)
    chain.drawn(1.0)
    frame = CommandList(device)
    other.record(frame, *other.textures, 7.0)
    frame.submit()
    assert chain.drawn(1.0)[0, 0] == 9.0


def test_recording_does_not_keep_arguments_alive(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale)
    chain.drawn(1.0)
    gone = weakref.ref(chain.textures[1])
    chain.textures[1] = make_texture(device, SIZE, "r32float")
    assert gone() is None
    assert chain.drawn(2.0)[0, 0] == 18.0  # void, so it was recorded again
    assert chain.recorded == 2


def test_recording_may_be_void_while_its_arguments_live(device: Device, scale: ComputeProgram) -> None:
    """Check that a recording becomes invalid when a resource is released that is not among its arguments."""
    chain, graph, held = Chain(device, scale), Graph(device), [make_texture(device, SIZE, "r32float")]

    def record(recorder: Recorder, first: Any, last: Any) -> None:
        chain.record(recorder, first, held[0], last, 3.0)

    for value in (1.0, 2.0):
        upload(device, chain.textures[0], np.full(SIZE[::-1], value, np.float32))
        graph.invalidate()
        graph.begin()
        graph.add_replayable(record, chain.textures[0], chain.textures[2])
        graph.submit()
        assert download(device, chain.textures[2])[0, 0] == 9.0 * value
        held[:] = [make_texture(device, SIZE, "r32float")]
    assert chain.recorded == 2


def test_only_compute_passes_can_be_recorded(device: Device) -> None:
    def record(recorder: Any) -> None:
        recorder.draw_fullscreen("filled", None, {}, [])

    graph = Graph(device)
    graph.begin()
    with pytest.raises(NotImplementedError, match="filled: Recording takes compute"):
        graph.add_replayable(record)


def test_stages_of_repeated_passes_are_timed(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale)
    for _ in range(2):
        chain.graph.invalidate()
        chain.graph.begin()
        chain.graph.add_replayable(chain.record, *chain.textures, 3.0)
        frame = chain.graph.submit(timed=True)
        frame.wait()
        times = frame.stage_ms()
        assert times is None or set(times) == {"a", "b", "total"}
