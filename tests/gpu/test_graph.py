"""The frame graph: only stale passes run, and the result is that of all passes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.gpu import CommandList, ComputeProgram, Device, Graph, download, make_texture, mark_scratch
from dermis.gpu.shader_types import shader_bindings, struct_dtype, used_member_selector
from dermis.gpu.textures import texture_from_array

SIZE = (9, 5)


@pytest.fixture(scope="module")
def scale(device: Device) -> ComputeProgram:
    return ComputeProgram(device, Path(__file__).parent / "scale.wgsl")


class Chain:
    """Textures, and passes that scale one into another."""

    def __init__(self, device: Device, scale: ComputeProgram, count: int) -> None:
        self.graph, self.scale = Graph(device), scale
        first = texture_from_array(device, np.ones(SIZE[::-1], np.float32), "r32float")
        self.textures = [first, *(make_texture(device, SIZE, "r32float") for _ in range(count))]

    def frame(self, *passes: tuple[int, int, float]) -> list[str]:
        """Return which of the passes (source, destination, factor) ran, as "0-1"."""
        self.graph.begin()
        for source, into, factor in passes:
            record = self.scale.make_record("Factor", value=factor)
            bound = {"factor": record, "image": self.textures[source], "scaled": self.textures[into]}
            self.graph.compute(f"{source}-{into}", self.scale, bound, SIZE)
        self.graph.submit()
        return self.graph.executed_stages

    def value(self, index: int) -> float:
        return float(download(self.graph.device, self.textures[index])[0, 0])


def test_valid_stages_do_not_run_again(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale, 3)
    assert chain.frame((0, 1, 2.0), (1, 2, 3.0), (2, 3, 5.0)) == ["0-1", "1-2", "2-3"]
    assert chain.frame((0, 1, 2.0), (1, 2, 3.0), (2, 3, 5.0)) == []
    assert chain.frame((0, 1, 2.0), (1, 2, 3.0), (2, 3, 7.0)) == ["2-3"]
    assert chain.frame((0, 1, 4.0), (1, 2, 3.0), (2, 3, 7.0)) == ["0-1", "1-2", "2-3"]
    assert chain.value(3) == 4.0 * 3.0 * 7.0


def test_clearing_the_cache_runs_everything(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale, 2)
    passes = (0, 1, 2.0), (1, 2, 3.0)
    for _ in range(2):
        chain.graph.invalidate()
        assert chain.frame(*passes) == ["0-1", "1-2"]
    assert chain.frame(*passes) == []


def test_results_of_other_frames_are_replaced(device: Device, scale: ComputeProgram) -> None:
    """Check that a pass runs again after another frame has overwritten its output.

    This includes the case in which the output of a later pass is still valid.
    """
    chain = Chain(device, scale, 3)
    one, other = ((0, 1, 2.0), (1, 2, 3.0)), ((0, 1, 5.0), (1, 3, 3.0))
    assert [chain.frame(*one), chain.frame(*other)] == [["0-1", "1-2"], ["0-1", "1-3"]]
    assert chain.frame(*one) == ["0-1"]
    assert (chain.value(1), chain.value(2), chain.value(3)) == (2.0, 6.0, 15.0)


def test_scratch_resources_may_have_any_content(device: Device, scale: ComputeProgram) -> None:
    """Check that no pass runs only to update a scratch texture."""
    chain = Chain(device, scale, 3)
    mark_scratch(device, chain.textures[1])
    one, other = ((0, 1, 2.0), (1, 2, 3.0)), ((0, 1, 5.0), (1, 3, 3.0))
    chain.frame(*one), chain.frame(*other)
    assert chain.frame(*one) == []
    assert chain.frame((0, 1, 2.0), (1, 2, 4.0)) == ["0-1", "1-2"]
    assert (chain.value(2), chain.value(3)) == (8.0, 15.0)


def test_resource_written_twice_is_read_in_order(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale, 3)
    passes = (0, 1, 2.0), (1, 2, 1.0), (0, 1, 3.0), (1, 3, 1.0)
    assert chain.frame(*passes) == ["0-1", "1-2", "0-1", "1-3"]
    assert chain.frame(*passes) == []
    assert chain.frame((0, 1, 2.0), (1, 2, 5.0), (0, 1, 3.0), (1, 3, 1.0)) == ["0-1", "1-2", "0-1"]
    assert (chain.value(1), chain.value(2), chain.value(3)) == (3.0, 10.0, 3.0)


def test_pass_result_does_not_depend_on_preceding_passes(device: Device, scale: ComputeProgram) -> None:
    """Check a pass at many positions of its record, in more kinds of frames than are cached."""
    chain = Chain(device, scale, 20)
    for _ in range(2):
        for others in range(19):
            factor = 2.0 + others
            chain.frame(*((0, 2 + k, 3.0 * factor) for k in range(others)), (0, 1, factor))
            assert chain.value(1) == factor


@pytest.mark.parametrize("looks_at_view", [True, False])
def test_view_and_texture_share_their_state(
    device: Device, scale: ComputeProgram, looks_at_view: bool
) -> None:
    """Check that writes to a texture are seen through its view, and vice versa, in later frames too."""
    graph, image = Graph(device), texture_from_array(device, np.ones(SIZE[::-1], np.float32), "r32float")
    whole, copy = (make_texture(device, SIZE, "r32float") for _ in range(2))
    view = whole.create_view()
    read, other = (view, whole) if looks_at_view else (whole, view)

    def frame(*passes: tuple[Any, Any, float]) -> int:
        graph.begin()
        for source, into, factor in passes:
            bound = {"factor": scale.make_record("Factor", value=factor), "image": source, "scaled": into}
            graph.compute("scale", scale, bound, SIZE)
        graph.submit()
        return len(graph.executed_stages)

    for factor in (2.0, 3.0):
        assert frame((image, read, factor), (read, copy, 1.0)) == 2
        assert frame((image, other, 5.0 * factor), (read, copy, 1.0)) == 2
        assert frame((image, other, 7.0 * factor)) == 1
        assert frame((read, copy, 1.0)) == 1
        assert float(download(device, copy)[0, 0]) == 7.0 * factor
        assert frame((image, other, 9.0 * factor)) == 1
        assert frame((read, copy, 1.0)) == 1
        assert frame((read, copy, 1.0)) == 0


def test_unneeded_stages_do_not_run(device: Device, scale: ComputeProgram) -> None:
    chain = Chain(device, scale, 1)
    assert chain.frame((0, 1, 2.0), (0, 1, 3.0)) == ["0-1"]
    assert chain.value(1) == 3.0


def test_layers_are_tracked_separately_and_together(device: Device) -> None:
    whole = make_texture(device, SIZE, "r32float", layer_count=2)
    options = {"dimension": "2d", "array_layer_count": 1}
    layers = [whole.create_view(base_array_layer=k, **options) for k in range(2)]
    program = ComputeProgram(device, Path(__file__).parent / "scale.wgsl")
    graph, image = Graph(device), texture_from_array(device, np.ones(SIZE[::-1], np.float32), "r32float")

    def frame(*factors: float) -> list[str]:
        graph.begin()
        for k, factor in enumerate(factors):
            bound = {
                "factor": program.make_record("Factor", value=factor),
                "image": image,
                "scaled": layers[k],
            }
            graph.compute(f"layer {k}", program, bound, SIZE)
        graph.submit()
        return graph.executed_stages

    assert frame(2.0, 3.0) == ["layer 0", "layer 1"]
    assert [frame(2.0, 3.0), frame(2.0, 4.0)] == [[], ["layer 1"]]
    assert [float(download(device, whole, layer=k)[0, 0]) for k in range(2)] == [2.0, 4.0]


def test_a_frame_that_failed_is_run_again(
    device: Device, scale: ComputeProgram, monkeypatch: pytest.MonkeyPatch
) -> None:
    chain, passes = Chain(device, scale, 2), ((0, 1, 2.0), (1, 2, 3.0))
    chain.frame(*passes)

    def fail(*_: Any) -> None:
        raise ValueError

    with monkeypatch.context() as patch:
        patch.setattr(CommandList, "submit", fail)
        with pytest.raises(ValueError):
            chain.frame((0, 1, 2.0), (1, 2, 7.0))
    assert chain.frame(*passes) == ["0-1", "1-2"]


def test_downloaded_bytes_are_those_after_all_passes(device: Device) -> None:
    graph, buffer = Graph(device), device.buffer(np.arange(4, dtype=np.uint32), "STORAGE")
    graph.begin()
    fetched = graph.read_back(buffer)
    graph.submit()
    assert fetched.array().view(np.uint32).tolist() == [0, 1, 2, 3]


def test_accesses_are_what_shaders_declare() -> None:
    declared = {
        "var x: texture_2d<f32>;": (True, True, False),
        "var x: texture_storage_2d<r32float, write>;": (True, False, True),
        "var<storage> x: array<u32>;": (True, True, False),
        "var<storage, read_write> x: array<u32>;": (True, True, True),
    }
    for declaration, expected in declared.items():
        (one,) = shader_bindings(f"@group(0) @binding(0) {declaration}")
        assert (one.has_content, one.is_readable, one.is_writable) == expected, declaration
    (sampler,) = shader_bindings("@group(0) @binding(0) var x: sampler;")
    assert not sampler.has_content and not sampler.is_writable


STRUCT = "struct S { a: f32, b: vec3f, c: f32 }\n@group(0) @binding(0) var<uniform> one: S;\n"


@pytest.mark.parametrize(
    ("code", "read"),
    [
        ("fn f() -> f32 { return one.a; }", {"a"}),
        ("fn f() -> f32 { return one.b.x + none.c + other.one.c; } // one.a", {"b"}),
        ("fn f() -> f32 { return one.a + one.b.y; }", {"a", "b"}),
        ("fn f() -> f32 { return g(one); }", {"a", "b", "c"}),
    ],
)
def test_only_members_that_are_read_count(code: str, read: set[str]) -> None:
    reader, dtype = used_member_selector(STRUCT + code, "one"), struct_dtype(STRUCT, "S")
    plain = np.zeros((), dtype)
    for member in ("a", "b", "c"):
        changed = np.zeros((), dtype)
        changed[member] = 1.0
        assert (reader(changed.tobytes()) != reader(plain.tobytes())) == (member in read)
