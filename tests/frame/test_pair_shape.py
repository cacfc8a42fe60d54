"""Translucent pairs of the head at rest follow other positions, until these strain the surface."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from setups import head_of, scene_of

from dermis import Pose
from dermis.base.arrays import Floats
from dermis.frame.features.translucency import build, pair_shape
from dermis.frame.features.translucency.pair_shape import StrainGauge
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.mesh.primitives import uv_sphere
from dermis.scene import Settings
from dermis.scene.lights import DirectionalLight

ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
SETTINGS = Settings(size=(64, 64), atlas=128, samples=1, interreflection=False)
FROM_BEHIND = DirectionalLight(direction=(0, 0, 1), irradiance=(3.0, 3.0, 3.0))
SEARCHED = 0.02  # largest deviation from a picture with a search of its own, relative to the brightest pixel


@pytest.fixture(scope="module")
def disc() -> Head:
    """Return a flattened ball, 6 mm thick."""
    ball = uv_sphere(30.0, 48, 24)
    return head_of(replace(ball, positions=ball.positions * np.float32([1.0, 1.0, 0.1])))


def scaled(head: Head, *factors: float) -> Floats:
    return np.asarray(head.positions_mm * np.float32(factors))


def drawn(renderer: Renderer, head: Head, positions: Floats | None) -> Floats:
    scene = replace(scene_of(head, FROM_BEHIND, rho_s=0.0), pose=Pose(positions_mm=positions))
    return renderer.draw(scene, SETTINGS).linear()[..., :3]


def test_strain_is_the_change_of_lengths(disc: Head) -> None:
    gauge, positions = StrainGauge(disc), disc.positions_mm
    turned = positions[:, [2, 0, 1]] + np.float32(7.0)
    assert gauge.strain(positions) == 0.0 and gauge.strain(turned) < 1e-4
    assert gauge.strain(scaled(disc, 1.1, 1.1, 1.1)) == pytest.approx(0.1, abs=1e-4)
    assert gauge.strain(scaled(disc, 0.7, 0.7, 0.7)) == pytest.approx(0.3, abs=1e-4)


def test_pairs_are_searched_again_only_for_strained_shapes(
    disc: Head, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    for name in ("search_pairs", "divide_into_cells"):
        function: Any = getattr(build, name)
        monkeypatch.setattr(
            build, name, lambda *args, name=name, function=function: (calls.append(name), function(*args))[1]
        )
    renderer = Renderer(ADAPTER)
    drawn(renderer, disc, None)
    assert calls == ["divide_into_cells", "search_pairs"]
    for factor in (1.05, 0.9):
        drawn(renderer, disc, scaled(disc, factor, 1.0, factor))
    assert len(calls) == 2
    drawn(renderer, disc, scaled(disc, 1.5, 1.5, 1.5))
    assert calls[2:] == ["search_pairs"]


@pytest.mark.parametrize("factors", [(1.15, 1.15, 1.15), (1.1, 1.0, 0.8), (1.0, 1.0, 0.6)])
def test_pictures_are_those_of_pairs_of_the_shape(
    disc: Head, factors: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    positions = scaled(disc, *factors)
    followed = drawn(Renderer(ADAPTER), disc, positions)
    monkeypatch.setattr(pair_shape, "MAX_SHARED_PAIR_STRAIN", -1.0)
    searched = drawn(Renderer(ADAPTER), disc, positions)
    assert searched.max() > 0.0
    assert np.abs(followed - searched).max() < SEARCHED * searched.max()
