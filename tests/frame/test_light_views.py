"""Shadow views of several lights equal those of each light alone."""

from __future__ import annotations

import numpy as np
import pytest
from setups import head_of, place, scene_of

from dermis.base.errors import DermisError
from dermis.frame.lights.records import light_shadow_views
from dermis.frame.projection import view_axes
from dermis.mesh.primitives import uv_sphere
from dermis.scene.lights import DirectionalLight, Light, PointLight, SpotLight

BALL = head_of(uv_sphere(30.0, 24, 12))
LIGHTS: tuple[Light, ...] = (
    PointLight(position=(0.0, 80.0, 300.0)),
    DirectionalLight(direction=(0.0, -1.0, -1.0)),
    SpotLight(position=(-200.0, 10.0, 60.0), shadows=False),
    SpotLight(position=(120.0, -40.0, -90.0)),
)


def test_each_view_equals_that_of_the_light_alone() -> None:
    together = light_shadow_views(scene_of(BALL, *LIGHTS), BALL.mesh.outline, 64)
    assert [view is None for view in together] == [False, False, True, False]
    for light, view in zip(LIGHTS, together, strict=True):
        (alone,) = light_shadow_views(scene_of(BALL, light), BALL.mesh.outline, 64)
        assert (alone is None) == (view is None)
        if view and alone:
            assert np.allclose(view.clip, alone.clip, rtol=1e-5, atol=1e-6)
            assert np.allclose([*view.origin, view.near, view.far], [*alone.origin, alone.near, alone.far])


@pytest.mark.parametrize("index", [0, 3])
def test_shadow_maps_fit_the_head_tightly(index: int) -> None:
    view = light_shadow_views(scene_of(BALL, *LIGHTS), BALL.mesh.outline, 64)[index]
    assert view
    corners = np.c_[BALL.mesh.positions, np.ones(len(BALL.mesh.positions))] @ view.clip.T
    x, y, depth = (corners[:, :3] / corners[:, 3:]).T
    assert 0.97 < max(np.abs(x).max(), np.abs(y).max()) < 1.0
    assert depth.min() > 0.0 and depth.max() < 1.0


@pytest.mark.parametrize("inside", [(0, 0, 5), (0, 0, 30.4)])
def test_light_inside_the_head_is_named_in_the_refusal(inside: tuple[float, ...]) -> None:
    """A light inside the bounds, or so near that no map can cover the head, is refused by name."""
    lamp = PointLight(position=place(BALL, inside), target=(100.0, 0.0, 0.0))
    with pytest.raises(DermisError, match=r"light 2.*a position outside the head"):
        light_shadow_views(scene_of(BALL, LIGHTS[0], lamp), BALL.mesh.outline, 64)


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6])
def test_up_vector_counts_at_any_length(length: float) -> None:
    """The up vector counts at any allowed length; only one along the view is replaced."""
    tilted = view_axes((0.0, 0.6, -0.8), (0.0, 0.9 * length, 0.2 * length))
    assert np.allclose(tilted, [(1.0, 0.0, 0.0), (0.0, 0.8, 0.6), (0.0, 0.6, -0.8)])
    assert np.allclose(view_axes((0.0, 1.0, 0.0), (0.0, length, 0.0))[2], (0.0, 1.0, 0.0))
