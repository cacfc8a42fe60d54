"""The exposure meter compared with closed forms, and what it depends on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, joined, scene_of, settings_of
from tolerances import HALVES

from dermis.frame.features.post.meter import (
    FULL_SKIN_REFLECTANCE,
    MAX_CLIPPED_FRACTION,
    MAX_SKIN_FACTOR,
    METER_GRID_SIDE,
    METERED_IRRADIANCE,
    MIN_HIGHLIGHT_FACTOR,
    SKIN_COMPENSATION,
)
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import plane, uv_sphere
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.techniques import TECHNIQUES

FLAT = head_of(plane(100.0), colour=np.full((8, 8, 3), 0.3))
DULL = {"rho_s": 0.0}


def metered(renderer: Renderer, scene: Scene, **settings: Any) -> float:
    return renderer.draw(scene, settings_of(**({"exposure": "auto"} | settings))).exposure


def points(renderer: Renderer, scene: Scene) -> NDArray[np.float64]:
    """Return (n, 2) light and brightness at the points that were metered last."""
    meter = renderer.prepare(scene, settings_of(exposure="auto")).resources.post.meter
    assert meter is not None
    raw = np.frombuffer(renderer.device.handle.queue.read_buffer(meter.points), np.float32)
    found = raw.reshape(METER_GRID_SIDE * METER_GRID_SIDE, 2).astype(float)
    return found[found[:, 0] >= 0]


def test_a_lit_plane_is_exposed_for_the_key(renderer: Renderer) -> None:
    """Irradiance 3 makes a white surface 3 / pi, which the exposure brings to the key."""
    scene = scene_of(FLAT, frontal(3.0), **DULL)
    assert metered(renderer, scene) == pytest.approx(METERED_IRRADIANCE * np.pi / 3.0, rel=1e-5)
    assert metered(renderer, scene_of(FLAT, frontal(30.0), **DULL)) == pytest.approx(
        METERED_IRRADIANCE * np.pi / 30, rel=1e-5
    )
    assert metered(renderer, scene, exposure=0.4) == pytest.approx(0.4)


def test_uneven_light_is_metered_by_its_root_mean_square(renderer: Renderer) -> None:
    ball = head_of(uv_sphere(30.0, 48, 24), colour=np.full((8, 8, 3), 0.3))
    scene = scene_of(ball, frontal(np.pi), camera=front_camera(ball, frame_mm=80.0), **DULL)
    found = metered(renderer, scene)
    light = points(renderer, scene)[:, 0]
    assert 500 < len(light) < METER_GRID_SIDE * METER_GRID_SIDE and light.std() > 0.1
    assert found == pytest.approx(METERED_IRRADIANCE / np.sqrt((light**2).mean()), rel=1e-4)
    assert found == pytest.approx(
        METERED_IRRADIANCE * np.sqrt(2.0), rel=0.05
    )  # the mean square cosine is 1/2


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_meter_measures_incident_light(renderer: Renderer, technique: str) -> None:
    """Dark skin is metered like light skin for every technique, so that it stays dark."""
    dark = head_of(plane(100.0), colour=np.full((8, 8, 3), 0.05))
    both = [
        metered(renderer, scene_of(head, frontal(3.0), **DULL), technique=technique) for head in (FLAT, dark)
    ]
    assert both[0] == pytest.approx(both[1], rel=1e-6)
    assert both[0] == pytest.approx(METERED_IRRADIANCE * np.pi / 3.0, rel=1e-5)


@pytest.mark.parametrize("colour", [0.8, 0.3, 0.1, 0.01])
def test_exposure_for_skin_grows_with_its_darkness(renderer: Renderer, colour: float) -> None:
    head = head_of(plane(100.0), colour=np.full((8, 8, 3), colour))
    scene = scene_of(head, frontal(0.5), **DULL)
    usual, found = (metered(renderer, scene, exposure=word) for word in ("auto", "skin"))
    light, brightness = points(renderer, scene).T
    factor = (FULL_SKIN_REFLECTANCE * np.sqrt((light**2).mean()) / brightness.mean()) ** SKIN_COMPENSATION
    assert found / usual == pytest.approx(np.clip(factor, 1.0, MAX_SKIN_FACTOR), rel=1e-4)
    assert (found > usual) == (colour < 0.5)


def test_environment_counts_as_incident_light(renderer: Renderer) -> None:
    scene = Scene(FLAT, (), front_camera(FLAT), environment=Environment(name="uniform", exposure=4.0))
    assert metered(renderer, scene, occlusion="none") == pytest.approx(METERED_IRRADIANCE / 4.0, rel=HALVES)


def glossy(irradiance: float, share: float) -> Scene:
    """Return a scene of a plane with a bright strip over a fraction of the picture."""
    bright = np.full((8, 200, 3), 0.1)
    bright[:, : round(200 * (0.1 + 0.8 * share))] = 40.0 / irradiance
    head = head_of(plane(100.0), colour=bright)
    return scene_of(head, frontal(irradiance), mix=0.0, **DULL)


def test_highlights_reduce_exposure_by_at_most_one_stop(renderer: Renderer) -> None:
    for irradiance in (1.0, 9.0):
        usual, scene = METERED_IRRADIANCE * np.pi / irradiance, glossy(irradiance, 0.2)
        found = metered(renderer, scene, technique="none")
        bright = np.sort(points(renderer, scene)[:, 1])[::-1]
        limit = 1.0 / bright[int(MAX_CLIPPED_FRACTION * len(bright))]
        assert limit < usual
        assert found == pytest.approx(max(limit, MIN_HIGHLIGHT_FACTOR * usual), rel=1e-3)


def test_only_skin_is_metered(renderer: Renderer) -> None:
    """The exposure is that of the skin beside a plain plane; without skin it is 1."""
    mesh = plane(50.0)
    parts = ((mesh, (-25, 0, 0), (0.0, 0.0, 0.5)), (mesh, (25, 0, 0), (0.5, 0.0, 0.5)))
    both = head_of(joined(*parts, kinds=["skin", "opaque"]))
    count = {}
    for name, head in (("both", both), ("plain", head_of(joined(*parts, kinds=["opaque"] * 2)))):
        scene = scene_of(head, frontal(3.0), **DULL)
        count[name] = metered(renderer, scene), len(points(renderer, scene))
    assert count["both"][0] == pytest.approx(METERED_IRRADIANCE * np.pi / 3.0, rel=1e-5)
    assert 0.1 < count["both"][1] / METER_GRID_SIDE**2 < 0.6
    assert count["plain"] == (1.0, 0)


def test_exposure_does_not_depend_on_earlier_frames(renderer: Renderer) -> None:
    """The exposure is the same after other scenes, and nearly the same at another size."""
    scene = scene_of(FLAT, frontal(2.0))
    first = metered(renderer, scene)
    metered(renderer, scene_of(FLAT, frontal(20.0)))
    assert metered(renderer, scene) == first
    assert metered(renderer, scene, size=(90, 90)) == pytest.approx(first, rel=0.01)
    dark = replace(scene, lights=(frontal(0.0),))
    assert metered(renderer, dark) == 1.0


def test_metered_picture_equals_one_with_that_exposure(renderer: Renderer) -> None:
    scene = scene_of(FLAT, frontal(0.7))
    auto = renderer.draw(scene, settings_of(exposure="auto", background="gradient"))
    bytes_, exposure = auto.srgb8(), auto.exposure
    given = renderer.draw(scene, settings_of(exposure=exposure, background="gradient"))
    assert np.array_equal(given.srgb8(), bytes_)


def test_clipping_is_counted_over_the_head(renderer: Renderer) -> None:
    ball = head_of(uv_sphere(30.0, 48, 24), colour=np.full((8, 8, 3), 0.5))
    scene = scene_of(ball, frontal(np.pi), camera=front_camera(ball, frame_mm=120.0), **DULL)
    white = renderer.draw(scene, settings_of(background=(1.0, 1.0, 1.0)))
    assert white.clipped_fraction() == 0.0
    assert 0.2 < renderer.draw(scene, settings_of(exposure=3.0, technique="none")).clipped_fraction() < 1.0
