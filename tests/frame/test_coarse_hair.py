"""Hair of the head in the frame: few wide strands for many, deep opacity, and dual scattering."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, run_frame, scene_of
from strand_setups import hairy, woolly
from tolerances import FURNACE_OF_HAIR

from dermis.frame.features.hair import passes as drawing
from dermis.frame.features.hair import resources as hairs
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.mesh.head import Head
from dermis.scene.environment import Environment
from dermis.scene.model import Scene

FRAME_MM, SIZE = 40.0, 40  # a pixel is a millimetre
BLACK = 1e5  # absorption [1/mm]


def picture(renderer: Renderer, scene: Scene, **settings: Any) -> NDArray[np.float64]:
    """Return the (h, w, 4) picture with its coverage."""
    given = {"size": (SIZE, SIZE), "technique": "none"} | settings
    made = run_frame(renderer, scene, **given).resources.post.picture
    return download(renderer.device, made.exposed).astype(float)


def lit(head: Head, **more: Any) -> Scene:
    return scene_of(head, frontal(), camera=front_camera(head, frame_mm=FRAME_MM), **more)


def wool(count: int, absorption: float, cover: float = 0.0) -> Head:
    """Return a sheet with upright coarse strands."""
    rng = np.random.default_rng(5)
    begins = np.column_stack([rng.uniform(-9, 9, (count, 2)), np.full(count, 0.05)])
    ends = begins + np.column_stack([rng.normal(0, 0.8, (count, 2)), rng.uniform(1.5, 3.0, count)])
    return woolly(begins, ends, 0.03, absorption, cover)


@pytest.mark.parametrize("absorption", [0.5, 20.0])
def test_brightness_does_not_depend_on_how_many_hairs_are_drawn(
    renderer: Renderer, absorption: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A quarter of the strands is drawn four times as wide."""
    scene = replace(lit(wool(6000, absorption)), lights=(frontal(shadows=True),))
    shown = []
    for share in (1, 4):
        monkeypatch.setattr(
            drawing,
            "drawn_strand_counts",
            lambda made, _, share=share: made.coarse._replace(hairs=made.coarse.hairs // share),
        )
        renderer.clear_cache()
        shown.append(picture(renderer, scene, size=(48, 48))[..., :3])
    renderer.clear_cache()
    bare = picture(renderer, scene, size=(48, 48), strands=False)[..., :3]
    middle = np.s_[18:30, 18:30]
    assert shown[1][middle].mean() == pytest.approx(shown[0][middle].mean(), rel=0.06)
    assert np.abs(shown[0][middle].mean() / bare[middle].mean() - 1.0) > 0.1


def test_coarse_hairs_are_drawn_as_wide_as_pixels_are(renderer: Renderer) -> None:
    """Short hairs are drawn narrower, because few wide ones look like dots."""
    head, device = wool(20_000, 1.0), renderer.device
    coarse, none = hairs.max_coarse_counts(device, head), hairs.StrandCounts(0, 2)
    capacity = hairs.strand_capacity(none, coarse)
    buffers = hairs.make_strand_buffers(device, capacity, capacity)
    tables = hairs.make_strand_tables(device, head, coarse, buffers, None)
    near, far = (hairs.drawn_strand_counts(tables, pixel_mm).hairs for pixel_mm in (0.01, 0.5))
    assert near == far == 20_000
    far = hairs.drawn_strand_counts(replace(tables, length_mm=90.0, shortest_mm=90.0), 0.5).hairs
    assert hairs._MIN_DRAWN_STRANDS <= far < 12_000
    assert tables.coarse == (20_000, 5) and tables.fine.hairs == 0


@pytest.mark.parametrize("absorption", [0.0, 4.0])
def test_white_hair_does_not_gain_light(renderer: Renderer, absorption: float) -> None:
    head = wool(4000, absorption, cover=2.0)
    scene = replace(lit(head, rho_s=0.0), lights=(), environment=Environment(name="uniform"))
    made = picture(renderer, scene, occlusion="none", samples=4)[..., :3]
    assert made.max() <= FURNACE_OF_HAIR
    if absorption == 0.0:
        assert made[8:32, 8:32].mean() == pytest.approx(1.0, abs=0.02)
    else:
        assert made[16:24, 16:24].mean() < 0.9


@pytest.mark.parametrize(("absorption", "low", "high"), [(0.0, 0.3, 0.95), (BLACK, 0.0, 0.3)])
def test_hair_shades_hair(renderer: Renderer, absorption: float, low: float, high: float) -> None:
    """A strand below a roof of strands gets light through white ones and none through black ones."""
    y = np.linspace(-4, 4, 80)
    roof = np.column_stack([np.full(80, -14.0), y, np.full(80, 9.0)])
    seen = []
    for above in (roof[:1] + np.array([0.0, 40.0, 0.0]), roof):
        begins = np.concatenate([[[-12.0, 0.0, 0.6]], above])
        head = hairy(begins, begins * [-1, 1, 1], 0.1, absorption)
        scene = replace(lit(head), lights=(frontal(shadows=True),))
        made = run_frame(renderer, scene, technique="none", size=(SIZE, SIZE)).resources.hair
        assert made is not None
        raw = renderer.device.handle.queue.read_buffer(made.tables.buffers.projected)
        seen.append(np.frombuffer(raw, np.float32, 5 * 8).reshape(5, 8)[2, 4:7].mean())
    assert low <= seen[1] / seen[0] < high
