"""Every program stays within the limits that WebGPU promises everywhere, whatever this machine offers."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

import dermis.gpu
from dermis.frame.passes import PASSES, TECHNIQUES, shader_folders
from dermis.gpu.shader_types import bindings, struct_dtype
from dermis.gpu.wgsl_source import compose

FOLDERS = (*shader_folders("rgba16float", "rgba16float"), Path(dermis.gpu.__file__).parent / "wgsl")
SHADERS = [
    path
    for folder in (PASSES, TECHNIQUES)
    for path in sorted(folder.glob("*.wgsl"))
    if re.search("@(compute|fragment|vertex)", path.read_text(encoding="utf-8"))  # others are included
]
MOST = {"texture": 16, "sampler": 16, "storage_texture": 4, "storage": 8, "uniform": 12}


@pytest.mark.parametrize("path", SHADERS, ids=lambda path: path.stem)
def test_bindings_fit_any_device(path: Path) -> None:
    found = bindings(compose(path, FOLDERS).text)
    assert found
    kinds = Counter(_kind(binding.entry) for binding in found)
    assert not {kind: count for kind, count in kinds.items() if count > MOST[kind]}
    assert len({binding.index for binding in found}) == len(found)


def test_uniforms_fit_64_kib() -> None:
    text = compose(PASSES / "shade.wgsl", FOLDERS).text
    for name in ("Skin", "Lights", "Shade"):
        assert struct_dtype(text, name).itemsize <= 65536


def _kind(entry: dict[str, dict[str, str]]) -> str:
    if "buffer" in entry:
        return "uniform" if entry["buffer"]["type"] == "uniform" else "storage"
    return next(iter(entry))
