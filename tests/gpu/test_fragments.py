"""Render passes that run for each texel of their targets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.gpu import CommandList, Device, RenderProgram, download, make_texture

SIZE = (37, 21)


def test_fragments_fill_every_texel_of_all_targets(device: Device) -> None:
    program = RenderProgram(
        device,
        Path(__file__).parent / "places.wgsl",
        constants={"TIMES": 2.0},
        targets=["rgba32float", "rgba16float"],
    )
    one = make_texture(device, SIZE, "rgba32float", content_source="raster")
    layered = make_texture(device, SIZE, "rgba16float", layer_count=3, content_source="raster")
    view = layered.create_view(dimension="2d", base_array_layer=1, array_layer_count=1)
    frame = CommandList(device)
    frame.draw_fullscreen(
        "places", program, {"added": program.make_record("Added", more=(0, 0, 5, 0))}, [one, view]
    )
    frame.submit()
    frame.wait()
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    expected = np.stack([x, y, np.zeros_like(x), np.ones_like(x)], axis=-1)
    assert np.array_equal(download(device, one), expected)
    assert np.array_equal(download(device, layered, layer=1), 2.0 * expected + (0, 0, 5, 0))
    assert not download(device, layered, layer=0).any()
    times = frame.stage_ms()
    assert times is None or times["places"] > 0.0
