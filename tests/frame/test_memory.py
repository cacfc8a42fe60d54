"""Device memory of a renderer: no more than its last frame needs, and as much as predicted."""

from __future__ import annotations

import gc
import re
import weakref
from collections.abc import Callable
from typing import Any

import pytest
from setups import frontal, head_of, scene_of, settings_of

from dermis.frame.limits import atlas_texel_bytes
from dermis.frame.renderer import Renderer
from dermis.gpu import Device
from dermis.mesh.primitives import uv_sphere
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

SCENE = scene_of(head_of(uv_sphere(30.0, 24, 12)), frontal())
KINDS: dict[str, dict[str, Any]] = {
    "texture-space": {},
    "two layouts": {"seams": "multi-uv"},
    "gpu-gems-3": {"technique": "gpu-gems-3"},
    "screen-space": {"technique": "screen-space"},
    "pre-integrated": {"technique": "pre-integrated"},
    "none": {"technique": "none"},
    "bloom": {"bloom": 0.3},
}


def bytes_of(texel: str) -> int:
    """Return the size of a texel in a format of wgpu, such as rgba16float."""
    channels, bits = re.fullmatch(r"(r|rg|rgba|depth)(\d+)[a-z-]+", texel).groups()  # type: ignore[union-attr]
    return len(channels.replace("depth", "d")) * int(bits) // 8


class Held:
    """Textures and buffers of a device that are still alive."""

    def __init__(self, device: Device, patch: pytest.MonkeyPatch) -> None:
        self._alive: list[tuple[weakref.ref[Any], int]] = []
        handle = device.handle
        for name in ("create_texture", "create_buffer", "create_buffer_with_data"):
            patch.setattr(handle, name, self._counting(getattr(handle, name)))

    def _counting(self, create: Callable[..., Any]) -> Callable[..., Any]:
        def counted(*args: Any, **kwargs: Any) -> Any:
            made = create(*args, **kwargs)
            size = made.size
            if not isinstance(size, int):
                width, height, layers = size
                texels = sum((width >> mip) * (height >> mip) for mip in range(made.mip_level_count))
                size = texels * layers * bytes_of(made.format)
            self._alive.append((weakref.ref(made), size))
            return made

        return counted

    def bytes(self, collected: bool = True) -> int:
        if collected:
            gc.collect()
        return sum(size for made, size in self._alive if made() is not None)


def chosen(kind: str) -> Settings:
    return settings_of(**({"atlas": 256, "size": (64, 64), "transmission": "none"} | KINDS[kind]))


@pytest.fixture
def held(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> Held:
    renderer.clear_cache()
    return Held(renderer.device, monkeypatch)


def test_frame_frees_resources_of_the_previous_one(renderer: Renderer, held: Held) -> None:
    """The memory is that of a fresh renderer, whatever was rendered before."""
    alone = {}
    for kind in KINDS:
        renderer.clear_cache()
        renderer.draw(SCENE, chosen(kind))
        alone[kind] = held.bytes()
    for kind in (*KINDS, *reversed(KINDS)):
        renderer.draw(SCENE, chosen(kind))
        assert held.bytes() == alone[kind], kind


@pytest.mark.parametrize("kind", ["texture-space", "two layouts", "gpu-gems-3", "none"])
def test_atlas_memory_matches_the_estimate(renderer: Renderer, held: Held, kind: str) -> None:
    """The difference of two sizes cancels resources of other sizes; halved levels take less."""
    if renderer.device.adapter.kind != "CPU":
        pytest.skip("only a software adapter takes main memory, and levels of floats")
    found = {}
    for side in (256, 512):
        renderer.clear_cache()
        renderer.draw(SCENE, chosen(kind).model_copy(update={"atlas": side}))
        found[side] = held.bytes()
    levels = 0 if kind == "none" else 5
    layouts = 2 if kind == "two layouts" else 1
    foreseen = atlas_texel_bytes(TECHNIQUES[chosen(kind).technique], levels, layouts) if levels else 0
    taken = (found[512] - found[256]) / (512**2 - 256**2)
    assert taken == foreseen if kind in ("gpu-gems-3", "none") else 0.6 * foreseen < taken < foreseen


def test_techniques_without_an_atlas_allocate_none(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sizes that no device could allocate are accepted."""
    monkeypatch.setattr(renderer.device, "max_texture_size", 2048)
    assert renderer.draw(SCENE, settings_of(technique="none", atlas=16384)).linear().max() > 0.1
