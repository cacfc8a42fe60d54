"""Oblique light leaves beside its entry point: on a ball, past the terminator."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import AnyLight, entered_light, head_of, place, run_frame, scene_of

from dermis.atlas.build import cached_atlas
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import plane, uv_sphere
from dermis.optics.angular_response import DIRECTION_ROWS, angular_response
from dermis.optics.equivalent_medium import equivalent_medium, oblique_offset_mm
from dermis.optics.profiles import load_profile
from dermis.scene.lights import DirectionalLight, StripeLight

Floats = NDArray[np.float64]
SIZE, RADIUS = 128, 4.0
BALL, FLAT = uv_sphere(RADIUS, 96, 48), plane(40.0)
LIGHT = DirectionalLight(direction=(-1.0, 0.0, 0.0), irradiance=(3.0, 2.0, 1.0), shadows=False)
DRY = {"specular": "none", "energy": "none", "albedo": "profile", "profile": "skin1"}
STEEP = 0.8  # cosine of the latitude from which texels lie beside their triangles


def entered(renderer: Renderer, head: Any, light: AnyLight, **skin: Any) -> Floats:
    scene = scene_of(head, light, **(DRY | {"direction": "half-space"} | skin))
    return entered_light(renderer, run_frame(renderer, scene, atlas=SIZE))[..., :3]


def aside() -> float:
    profile = load_profile("skin1")
    return oblique_offset_mm(equivalent_medium(profile, profile.albedo, 1.0))


def expected(normals: Floats, radius: float) -> Floats:
    """Return the exitance of a ball whose surface is lit as at an offset towards the light."""
    cosine = -normals @ np.array(LIGHT.direction)
    turn = aside() / radius * (-np.array(LIGHT.direction) - cosine[..., None] * normals)
    turned = (normals + turn) / np.linalg.norm(normals + turn, axis=-1, keepdims=True)
    cosine = np.maximum(-turned @ np.array(LIGHT.direction), 0.0)
    told, rows = angular_response(load_profile("skin1").albedo, 1.0), np.linspace(0.0, 1.0, DIRECTION_ROWS)
    back = np.stack(
        [np.interp(np.sqrt(cosine), rows, told.relative_reflectance[:, c]) for c in range(3)], axis=-1
    )
    return np.asarray(np.array(LIGHT.irradiance) * cosine[..., None] * back)


def test_a_ball_is_lit_past_its_terminator(renderer: Renderer) -> None:
    made = entered(renderer, head_of(BALL), LIGHT)
    atlas = cached_atlas(BALL, SIZE)
    _, normals = twins.surface(atlas, head_of(BALL))
    told = atlas.lit_mask & (np.hypot(normals[..., 0], normals[..., 2]) > STEEP)
    wanted = expected(normals, RADIUS)
    past = told & (normals[..., 0] < 0.0) & (wanted[..., 1] > 0.05 * wanted.max())
    assert past.sum() > 0.05 * told.sum()  # a good part of what the light does not face
    assert np.abs(made - wanted)[told].max() < 0.03 * wanted.max()
    assert made[past].mean() == pytest.approx(wanted[past].mean(), rel=0.05)


def test_lambertian_skin_is_dark_past_the_terminator(renderer: Renderer) -> None:
    made = entered(renderer, head_of(BALL), LIGHT, direction="lambertian")
    atlas = cached_atlas(BALL, SIZE)
    _, normals = twins.surface(atlas, head_of(BALL))
    assert not made[atlas.lit_mask & (normals[..., 0] < -0.05)].any()


def test_uniform_light_on_a_plane_is_unchanged(renderer: Renderer) -> None:
    head = head_of(FLAT)
    light = DirectionalLight(direction=(-1.0, 0.0, -0.5), irradiance=(1.0, 1.0, 1.0), shadows=False)
    made = entered(renderer, head, light)
    lit = made[made.any(axis=-1)]
    assert len(lit) > 0.5 * SIZE**2 and np.ptp(lit, axis=0).max() < 1e-5 * lit.max()
    cosine = 0.5 / np.hypot(1.0, 0.5)
    told, rows = angular_response(load_profile("skin1").albedo, 1.0), np.linspace(0.0, 1.0, DIRECTION_ROWS)
    back = [np.interp(np.sqrt(cosine), rows, told.relative_reflectance[:, c]) for c in range(3)]
    assert lit.mean(axis=0) == pytest.approx(cosine * np.array(back), rel=1e-3)


def test_a_chart_of_few_texels_is_lit(renderer: Renderer) -> None:
    """A chart of two texels and its gutter has corners at which the bend of the surface is unknown."""
    head = head_of(replace(FLAT, uv=0.5 + 2.0 / SIZE * FLAT.uv))
    light = DirectionalLight(direction=(-1.0, 0.0, -0.5), irradiance=(1.0, 1.0, 1.0), shadows=False)
    made = entered(renderer, head, light)
    lit = made.any(axis=-1)
    assert np.isfinite(made).all() and 0 < lit.sum() < 100
    assert made[lit].min() > 0.3


def test_stripe_is_not_displaced(renderer: Renderer) -> None:
    """Most of the light of a narrow stripe leaves where it enters."""
    head = head_of(FLAT)
    light = StripeLight(direction=(-1.0, 0.0, -1.0), position=place(head, (0, 0, 0)), shadows=False)
    made = entered(renderer, head, light)[..., 1]
    columns = made.sum(axis=0)
    middle = (columns * (np.arange(SIZE) + 0.5)).sum() / columns.sum()
    assert middle == pytest.approx(SIZE / 2, abs=0.5)
