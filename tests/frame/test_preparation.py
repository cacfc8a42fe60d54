"""Cameras and lights do not recreate other resources, and old resources are released."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from setups import front_camera, frontal, head_of, scene_of, settings_of

from dermis.frame import allocation, preparation
from dermis.frame.features.diffusion import resources as blurred_levels
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import uv_sphere
from dermis.scene.environment import Environment
from dermis.scene.lights import PointLight
from dermis.scene.model import Scene

BALL = head_of(uv_sphere(30.0, 24, 12))
LAMP = PointLight(position=(0.0, 80.0, 300.0))


def scene(**changed: Any) -> Scene:
    return replace(scene_of(BALL, LAMP, camera=front_camera(BALL, frame_mm=70.0)), **changed)


def made(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that grows whenever resources are created."""
    log: list[int] = []

    def counted(*given: Any) -> Any:
        log.append(1)
        return allocation.make_resources(*given)

    monkeypatch.setattr(preparation, "make_resources", counted)
    return log


def moved(k: int) -> Scene:
    """Return a scene with the lamp and the camera at other positions."""
    lamp = LAMP.model_copy(update={"position": (10.0 * k, 80.0, 300.0)})
    plain = scene()
    x, y, z = plain.camera.position
    return scene(lights=(lamp,), camera=plain.camera.model_copy(update={"position": (x + k, y, z)}))


def test_camera_and_light_changes_do_not_prepare_again(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, settings = made(monkeypatch), settings_of()
    found = [renderer.prepare(moved(k), settings) for k in range(3)]
    assert len(log) == 1
    assert len({one.shadow_views.clips.tobytes() for one in found}) == 3
    assert len({one.view.tobytes() for one in found}) == 3
    assert len({one.camera_views.clips.tobytes() for one in found}) == 3
    assert len({one.bindings["lights"].tobytes() for one in found}) == 3
    assert len({id(one.resources.diffusion.levels) for one in found}) == 1


@pytest.mark.parametrize(
    "changed",
    [
        {"lights": (LAMP, LAMP)},
        {"lights": (LAMP.model_copy(update={"shadows": False}),)},
        {"head": head_of(uv_sphere(30.0, 20, 10))},
        {"skin": scene().skin.model_copy(update={"roughness": 0.5})},
        {"environment": Environment(name="uniform")},
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_all_other_changes_prepare_again(
    renderer: Renderer, changed: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    log, settings = made(monkeypatch), settings_of()
    renderer.prepare(scene(), settings)
    renderer.prepare(scene(**changed), settings)
    renderer.prepare(scene(), settings.model_copy(update={"exposure": 2.0}))
    renderer.prepare(scene(), settings.model_copy(update={"exposure": 2.0}), "elsewhere")
    assert len(log) == 4


def test_unused_results_are_released(renderer: Renderer) -> None:
    """A frame of a still scene counts towards the lifetime of unused resources."""
    two = Renderer(renderer.device.adapter.name, cache_size=2)
    settings = settings_of()
    two.prepare(scene(), settings, "left")
    assert (blurred_levels._make_levels, "left") in two.memo._results
    for _ in range(8):
        two.prepare(scene(), settings)
    assert {of for make, of in two.memo._results if make is blurred_levels._make_levels} == {""}


def test_moving_frames_equal_first_frames(renderer: Renderer) -> None:
    settings = settings_of()
    for k in range(3):
        last = renderer.draw(moved(k), settings).linear()
    renderer.clear_cache()
    assert np.array_equal(renderer.draw(moved(2), settings).linear(), last)


def test_moved_light_of_the_same_type_is_updated(renderer: Renderer) -> None:
    settings = settings_of()
    front = renderer.draw(scene(lights=(frontal(),)), settings).linear()
    dark = renderer.draw(scene(lights=(frontal(0.01),)), settings).linear()
    assert front.max() > 50 * dark.max()
