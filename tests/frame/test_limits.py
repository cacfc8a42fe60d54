"""Every program stays within the default limits of WebGPU, whatever this machine offers."""

from __future__ import annotations

import math
import re
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from setups import settings_of

import dermis
from dermis.frame import renderer as renderer_module
from dermis.frame.programs import shader_folders
from dermis.frame.renderer import Renderer
from dermis.gpu import open_device
from dermis.gpu.adapters import DEFAULT_LIMITS
from dermis.gpu.shader_types import shader_bindings, struct_dtype
from dermis.gpu.wgsl_source import compose_shader
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene import Environment, Scene, load_lights
from dermis.scene.techniques import TECHNIQUES

PACKAGE = Path(dermis.__file__).parent
SHADERS = sorted(PACKAGE.rglob("*.wgsl"))
FOLDERS = (*shader_folders("FILTERED_SOURCE", "HAIR_LABELS"), *sorted({path.parent for path in SHADERS}))
MOST = {
    kind: DEFAULT_LIMITS[f"max-{name}-per-shader-stage"]
    for kind, name in {
        "texture": "sampled-textures",
        "sampler": "samplers",
        "storage_texture": "storage-textures",
        "storage": "storage-buffers",
        "uniform": "uniform-buffers",
    }.items()
} | {"dynamic": DEFAULT_LIMITS["max-dynamic-uniform-buffers-per-pipeline-layout"]}
STORED = re.compile(r"rgba8(unorm|snorm|uint|sint)|rgba16(uint|sint|float)|(r|rg|rgba)32(uint|sint|float)")
READ_AND_WRITTEN = re.compile(r"r32(uint|sint|float)")
LARGEST = {"TRIANGLES": 128, "THREADS": 256}  # that visibility_buffer.py gives
STRIDES = {"": 4, "u32": 4, "f32": 4, "vec2f": 8, "vec3f": 16, "vec4f": 16}
WHOLE = {"seams": "multi-uv", "bloom": 0.1, "tone": "filmic"}


def _programs() -> list[Path]:
    """Return the shaders with an entry point."""
    entry = re.compile(r"^@(compute|vertex|fragment)\b", re.MULTILINE)
    return [path for path in SHADERS if entry.search(compose_shader(path, FOLDERS).text)]


@pytest.mark.parametrize("path", _programs(), ids=lambda path: path.stem)
def test_bindings_fit_any_device(path: Path) -> None:
    text = compose_shader(path, FOLDERS).text
    found = shader_bindings(text)
    kinds = Counter(_kind(binding.entry) for binding in found)
    kinds["dynamic"] = kinds["uniform"]  # each has an offset of its own in every frame
    assert not {kind: count for kind, count in kinds.items() if count > MOST[kind]}
    assert len({binding.index for binding in found}) == len(found)
    for texel, access in re.findall(r"texture_storage_\w+<\s*(\w+)\s*,\s*(\w+)\s*>", text):
        allowed = READ_AND_WRITTEN if access == "read_write" else STORED
        assert allowed.fullmatch(texel), f"{texel} for {access} takes a feature"
    assert not re.findall(r"^\s*enable\s.*", text, re.MULTILINE)


def test_uniforms_fit_64_kib() -> None:
    text = compose_shader(next(path for path in SHADERS if path.name == "shade.wgsl"), FOLDERS).text
    for name in ("Skin", "Lights", "Shade"):
        assert struct_dtype(text, name).itemsize <= DEFAULT_LIMITS["max-uniform-buffer-binding-size"]


@pytest.mark.parametrize("path", _programs(), ids=lambda path: path.stem)
def test_workgroups_fit_any_device(path: Path) -> None:
    """The wgpu library does not check the shared memory of workgroups."""
    text = re.sub(r"//[^\n]*", "", compose_shader(path, FOLDERS).text)
    structs = set(re.findall(r"struct (\w+)", text))
    held = 0
    for kind, count in re.findall(r"var<workgroup> \w+: (?:array<(\w+), (\w+)>|atomic<u32>);", text):
        one = struct_dtype(text, kind).itemsize if kind in structs else STRIDES[kind]
        held += one * (_number(text, count) if count else 1)
    assert held <= DEFAULT_LIMITS["max-compute-workgroup-storage-size"]
    for sides in re.findall(r"@workgroup_size\(([^)]+)\)", text):
        invocations = [_number(text, side) for side in sides.split(",")]
        assert math.prod(invocations) <= DEFAULT_LIMITS["max-compute-invocations-per-workgroup"]


def _number(text: str, spelled: str) -> int:
    """Return the value of an expression of constants and numbers."""
    if declared := LARGEST.get(spelled):
        return declared
    spelled = spelled.removesuffix(".x")
    if given := re.search(rf"(?:const|override) {spelled}\s*(?::\s*\w+)?\s*=\s*(?:vec2u\()?([^;,]+)", text):
        return _number(text, given[1])
    return math.prod(
        int(part.rstrip("u")) if part[0].isdigit() else _number(text, part)
        for part in spelled.strip().split(" * ")
    )


@pytest.fixture(scope="module")
def bare(renderer: Renderer) -> Renderer:
    """Return a renderer on a device without features and with default limits."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(renderer_module, "open_device", partial(open_device, guaranteed_capabilities_only=True))
        return Renderer(renderer.device.adapter.name)


@pytest.mark.parametrize("given", [*({"technique": name} for name in TECHNIQUES.names), WHOLE], ids=str)
def test_device_without_optional_features_draws_the_same(
    renderer: Renderer, bare: Renderer, given: dict[str, Any]
) -> None:
    head = Head("ball", uv_sphere(90.0, 24, 12), Maps())
    lights = [*load_lights("window"), *load_lights("rim"), *load_lights("laser")]
    scene = Scene(head, lights=lights, environment=Environment(name="uniform"))
    shown = {"background": "environment", "exposure": "auto"}
    settings = settings_of(**({"seams": "stitch"} | shown | given))
    usual, plain = (one.draw(scene, settings).linear() for one in (renderer, bare))
    assert np.array_equal(usual, plain) and usual.max() > 0


def _kind(entry: dict[str, dict[str, str]]) -> str:
    if "buffer" in entry:
        return "uniform" if entry["buffer"]["type"] == "uniform" else "storage"
    return next(iter(entry))
