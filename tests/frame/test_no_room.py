"""Without enough memory, the message names the resource, its size and settings that fit; and these fit."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
import wgpu
from setups import frontal, head_of, scene_of, settings_of
from test_memory import Held

from dermis.base.errors import DermisError
from dermis.frame import limits
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import uv_sphere
from dermis.scene.settings import Settings

LIT = scene_of(head_of(uv_sphere(30.0, 24, 12)), frontal(shadows=True))
SAID = re.compile(
    r"(?P<device>.+): expected room for the (?P<what>.+), (?P<size>[\d.]+ [MG]B), but it has none left\. "
    r"With (?P<options>--.+) it takes about (?P<fits>[\d.]+) (?P<unit>[MG])B\."
)


class Small(Held):
    """Device with little memory, which reports errors as drivers do."""

    def __init__(self, renderer: Renderer, patch: pytest.MonkeyPatch, most: float) -> None:
        renderer.clear_cache()
        super().__init__(renderer.device, patch)
        self._most = most

    def _counting(self, create: Callable[..., Any]) -> Callable[..., Any]:
        counted = super()._counting(create)

        def tried(*args: Any, **kwargs: Any) -> Any:
            made = counted(*args, **kwargs)
            if self.bytes(collected=False) > self._most and self.bytes() > self._most:
                raise wgpu.GPUOutOfMemoryError("Not enough memory left")
            return made

        return tried


def chosen(text: str, settings: Settings) -> Settings:
    """Return settings with the options of a command line."""
    given: dict[str, Any] = {}
    for name, value in re.findall(r"--([\w-]+) (\S+)", text):
        sides = tuple(map(int, value.split("x")))
        given[name.replace("-", "_")] = sides if name == "size" else sides[0]
    return settings.model_copy(update=given)


@pytest.mark.parametrize(
    ("asked", "what", "option"),
    [
        ({"atlas": 512}, "blurred light of 512x512x6 ", "--atlas"),
        ({"size": (1024, 512), "samples": 16}, "picture of 1024x512x1 rgba32float", "--size"),
    ],
    ids=["atlas", "size"],
)
def test_suggested_settings_fit_in_memory(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, asked: dict[str, Any], what: str, option: str
) -> None:
    settings = settings_of(**({"transmission": "none"} | asked))
    Small(renderer, monkeypatch, 24e6 if "atlas" in asked else 50e6)
    with pytest.raises(DermisError, match=re.escape(what)) as caught:
        renderer.draw(LIT, settings)
    said = SAID.fullmatch(str(caught.value))
    assert said and said["device"] == renderer.device.adapter.name, caught.value
    assert option in said["options"]
    smaller = chosen(said["options"], settings)
    assert renderer.draw(LIT, smaller).linear().max() > 0.1


def test_memory_of_other_allocations_counts_as_used(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "allocated_bytes", lambda: 10**9)
    settings = settings_of(transmission="none", atlas=512)
    Small(renderer, monkeypatch, 24e6)
    with pytest.raises(DermisError) as caught:
        renderer.draw(LIT, settings)
    said = SAID.fullmatch(str(caught.value))
    assert said and "--atlas" in said["options"]
    assert renderer.draw(LIT, chosen(said["options"], settings)).linear().max() > 0.1


def test_buffers_over_the_limit_are_reported(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer.device, "max_storage_bytes", 4000)
    with pytest.raises(
        DermisError, match=r"expected room for the list, 4\.0 MB, but it takes at most 0\.0 MB"
    ):
        renderer.device.storage_buffer(4_000_000, "list")


def test_driver_errors_about_textures_are_reported(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A texture of the largest side exceeds any memory: the error of the library is reported."""
    device = renderer.device
    if device.adapter.kind != "CPU":
        pytest.skip("a GPU may have so much")
    from dermis.gpu import make_texture

    side = device.max_texture_size
    with pytest.raises(DermisError, match=rf"the sheet of {side}x{side}x256 rgba32float, [\d.]+ GB, but"):
        make_texture(device, (side, side), "rgba32float", layer_count=256, texture_name="sheet")
