"""Struct offsets by hand from the WGSL specification, and bindings in wgpu's form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dermis
from dermis.base.errors import DermisError
from dermis.gpu import CommandList, ComputeProgram, Device, download, make_texture
from dermis.gpu.shader_types import shader_bindings, struct_dtype

SHADERS = sorted(Path(dermis.__file__).parent.rglob("*.wgsl"))

TIGHT = "struct S { a: vec3f, b: f32, c: vec2f, d: u32 }"
LOOSE = "struct S { a: f32, b: vec3f, c: vec3f, d: vec2f, }"
MATRIX = "struct S { a: u32, m: mat4x4f, b: vec2u, c: vec4u }"
SCALARS = "struct S { a: f32, b: i32, c: u32 }"
NESTED = """
struct Inner { p: vec3f, k: u32 } // { not a member: f32 }
struct S {
    count: u32, // of them: u32
    inner: array<Inner, 3>,
    weight: array<vec4f, 2>,
    last: f32,
}
"""


@pytest.mark.parametrize(
    ("text", "offsets", "size"),
    [
        (TIGHT, {"a": 0, "b": 12, "c": 16, "d": 24}, 32),
        (LOOSE, {"a": 0, "b": 16, "c": 32, "d": 48}, 64),
        (MATRIX, {"a": 0, "m": 16, "b": 80, "c": 96}, 112),
        (SCALARS, {"a": 0, "b": 4, "c": 8}, 12),
        (NESTED, {"count": 0, "inner": 16, "weight": 64, "last": 96}, 112),
    ],
)
def test_member_offsets_follow_wgsl_rules(text: str, offsets: dict[str, int], size: int) -> None:
    dtype = struct_dtype(text, "S")
    assert {name: dtype.fields[name][1] for name in dtype.names or ()} == offsets
    assert dtype.itemsize == size


def test_nested_elements_are_records() -> None:
    inner = struct_dtype(NESTED, "S")["inner"]
    assert inner.shape == (3,) and inner.base.itemsize == 16
    assert inner.base.fields["k"][1] == 12


def test_unknown_struct_is_refused() -> None:
    with pytest.raises(DermisError, match="struct Gone"):
        struct_dtype(TIGHT, "Gone")


def test_padded_array_elements_are_refused() -> None:
    with pytest.raises(DermisError, match="padding"):
        struct_dtype("struct S { a: array<vec3f, 4> }", "S")


def test_shader_reads_what_numpy_wrote(device: Device) -> None:
    """Check all kinds of members by a shader that reads them on the device."""
    program = ComputeProgram(device, Path(__file__).parent / "layout_probe.wgsl")
    record = program.make_record("Probe")
    numbers = iter(range(1, 100))
    flat: list[int] = []
    for member in ("lone", "three", "matrix", "pair", "inner", "last"):
        flat += fill(record, member, numbers)
    read = make_texture(device, (len(flat), 1), "r32float")
    frame = CommandList(device)
    frame.compute("probe", program, {"probe": record, "read": read}, (1, 1))
    frame.submit()
    assert download(device, read)[0].tolist() == flat


def fill(record: Any, member: str, numbers: Any) -> list[int]:
    """Return consecutive numbers that are written to a member of a record, in the order of its scalars."""
    if record[member].dtype.names:
        parts = [(one, name) for one in record[member].reshape(-1) for name in one.dtype.names]
        return [n for one, name in parts for n in fill(one, name, numbers)]
    values = [next(numbers) for _ in range(record[member].size)]
    record[member] = np.reshape(values, record[member].shape)
    return values


@pytest.mark.parametrize(
    ("declaration", "entry"),
    [
        ("var<uniform> x: S;", {"buffer": {"type": "uniform"}}),
        ("var<storage> x: array<f32>;", {"buffer": {"type": "read-only-storage"}}),
        ("var<storage, read_write> x: array<u32>;", {"buffer": {"type": "storage"}}),
        ("var x: sampler;", {"sampler": {"type": "filtering"}}),
        ("var x: sampler; // non-filtering", {"sampler": {"type": "non-filtering"}}),
        ("var x: sampler_comparison;", {"sampler": {"type": "comparison"}}),
        (
            "var x: texture_2d<f32>;",
            {"texture": {"sample_type": "unfilterable-float", "view_dimension": "2d"}},
        ),
        (
            "var x: texture_2d<f32>; // filtered: why",
            {"texture": {"sample_type": "float", "view_dimension": "2d"}},
        ),
        (
            "var x: texture_2d_array<u32>;",
            {"texture": {"sample_type": "uint", "view_dimension": "2d-array"}},
        ),
        (
            "var x: texture_depth_2d_array;",
            {"texture": {"sample_type": "depth", "view_dimension": "2d-array"}},
        ),
        (
            "var x: texture_storage_2d<rgba32float, write>;",
            {"storage_texture": {"format": "rgba32float", "access": "write-only", "view_dimension": "2d"}},
        ),
    ],
)
def test_bindings_give_layout_entries(declaration: str, entry: dict[str, Any]) -> None:
    (found,) = shader_bindings(f"@group(0) @binding(7) {declaration}")
    assert (found.index, found.name, found.entry) == (7, "x", entry)


def test_bindings_come_in_order() -> None:
    text = "\n".join(f"@group(0) @binding({b}) var x{b}: sampler;" for b in (30, 3, 1))
    assert [b.name for b in shader_bindings(text)] == ["x1", "x3", "x30"]


@pytest.mark.parametrize("path", SHADERS, ids=lambda p: p.stem)
def test_every_binding_of_the_package_is_parsed(path: Path) -> None:
    """Check that the parser skips no declaration."""
    text = path.read_text(encoding="utf-8")
    assert len(shader_bindings(text)) == text.count("@binding(")
