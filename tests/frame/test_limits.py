"""Every program stays within the limits that WebGPU promises everywhere, whatever this machine offers."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from dermis.frame.passes import SHARED_SHADERS, SOURCE_SHADERS, STAGES, STORE_SHADERS
from dermis.gpu.shader_types import bindings, struct_dtype
from dermis.gpu.wgsl_source import compose

TOOLKIT = Path(SHARED_SHADERS).parent.parent / "gpu" / "wgsl"
FOLDERS = (SHARED_SHADERS, TOOLKIT, SOURCE_SHADERS["rgba16float"], STORE_SHADERS["rgba16float"])
MOST = {"texture": 16, "sampler": 16, "storage_texture": 4, "storage": 8, "uniform": 12}


@pytest.mark.parametrize("path", sorted(STAGES.glob("*.wgsl")), ids=lambda path: path.stem)
def test_bindings_fit_any_device(path: Path) -> None:
    found = bindings(compose(path, FOLDERS).text)
    assert found
    kinds = Counter(_kind(binding.entry) for binding in found)
    assert not {kind: count for kind, count in kinds.items() if count > MOST[kind]}
    assert len({binding.index for binding in found}) == len(found)


def test_uniforms_fit_64_kib() -> None:
    text = compose(STAGES / "shade.wgsl", (SHARED_SHADERS, TOOLKIT)).text
    for name in ("Skin", "Lights", "Shade"):
        assert struct_dtype(text, name).itemsize <= 65536


def _kind(entry: dict[str, dict[str, str]]) -> str:
    if "buffer" in entry:
        return "uniform" if entry["buffer"]["type"] == "uniform" else "storage"
    return next(iter(entry))
