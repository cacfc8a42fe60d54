"""Observed scenes can have settings of their own."""

from __future__ import annotations

import numpy as np

from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene import Scene, Settings


def test_each_scene_is_drawn_with_its_settings() -> None:
    scene = Scene(Head("ball", uv_sphere(100.0, 24, 12), Maps()))
    usual = Settings(size=(24, 24), atlas=64, samples=1, shadow_size=64, exposure=0.3)
    each = [usual, usual.replace(exposure=0.1), usual.replace(size=(16, 8)), usual]
    renderer = Renderer("cpu")
    seen = [one.picture for one in renderer.observe([scene] * 4, each)]
    alone = [next(renderer.observe([scene], settings)).picture for settings in each]
    assert [one.shape for one in seen] == [(24, 24, 3), (24, 24, 3), (8, 16, 3), (24, 24, 3)]
    assert all(np.array_equal(a, b) for a, b in zip(seen, alone, strict=True))
    assert not np.array_equal(seen[0], seen[1])
