"""Shadows are where geometry puts them, surfaces do not shadow themselves, and no pass runs needlessly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import AnyLight, frontal, head_of, joined, place, probe, run_frame, scene_of, settings_of
from tolerances import LIT

from dermis.atlas.build import cached_atlas
from dermis.frame.lights.records import light_shadow_views
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.mesh.primitives import plane, uv_sphere
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight

Floats = NDArray[np.float64]
SLANTED = DirectionalLight(direction=(1, 0, -1))


def seen(renderer: Renderer, head: Head, light: AnyLight, **settings: Any) -> tuple[Floats, Floats, Floats]:
    """Return the visibility, cosine and position of each texel; the cosine is 0 outside charts."""
    inputs = run_frame(renderer, scene_of(head, light), **settings)
    size = settings["atlas"]
    _, arriving = probe(
        renderer.device,
        "surface_probe",
        (size, size),
        ["relief", "arriving"],
        **inputs.bindings,
        atlas=inputs.layouts[0].atlas.resources["atlas"],
        footprint={"side": 1.0 / size},
    )
    points, _ = twins.surface(cached_atlas(head.mesh, size), head)
    return arriving[..., 0], arriving[..., 1], points


def crossing(x: Floats, visibility: Floats) -> float:
    """Return where a profile of visibility passes one half for the first time."""
    k = int(np.argmax((visibility[:-1] - 0.5) * (visibility[1:] - 0.5) <= 0))
    share = (0.5 - visibility[k]) / (visibility[k + 1] - visibility[k])
    return float(x[k] + share * (x[k + 1] - x[k]))


PLATE = head_of(
    joined((plane(100.0, 4), (0, 0, 0), (0, 0, 0.7)), (plane(30.0, 2), (-15, 0, 20), (0.75, 0.75, 0.2)))
)
OVERHEAD = {"position": place(PLATE, (-15, 0, 220)), "target": place(PLATE, (-15, 0, 0))}


@pytest.mark.parametrize("softness", [0.5, 1.5, 6.0])
@pytest.mark.parametrize("shadow_size", [256, 1024])
def test_shadow_edges_of_a_plate_are_exact(renderer: Renderer, shadow_size: int, softness: float) -> None:
    """A plate at x from -30 to 0, 20 mm high, in light at 45 degrees along +x."""
    light = SLANTED.model_copy(update={"softness_mm": softness})
    visibility, _, points = seen(renderer, PLATE, light, atlas=512, shadow_size=shadow_size)
    row = int(np.argmin(np.abs(points[:300, 100, 1])))
    x, profile = points[row, :350, 0], visibility[row, :350]
    (view,) = light_shadow_views(scene_of(PLATE, light), PLATE.mesh.outline, shadow_size)
    assert view is not None
    allowed = view.texel * np.sqrt(2) + softness
    near = (x > -40) & (x < 5)
    assert crossing(x[near], profile[near]) == pytest.approx(-10.0, abs=allowed)
    assert crossing(x[~near & (x > 0)], profile[~near & (x > 0)]) == pytest.approx(20.0, abs=allowed)
    assert profile[(x > -10 + 2 * allowed) & (x < 20 - 2 * allowed)].max() < LIT
    assert profile[(x < -10 - 2 * allowed) | (x > 20 + 2 * allowed)].min() > 1 - LIT


@pytest.mark.parametrize("light", [PointLight(**OVERHEAD), SpotLight(**OVERHEAD)], ids=["point", "spot"])
def test_point_light_shadow_is_larger_than_the_plate(renderer: Renderer, light: AnyLight) -> None:
    """From 220 mm, a plate of 30 mm at 20 mm casts a shadow of 33 mm."""
    visibility, _, points = seen(renderer, PLATE, light, atlas=512, shadow_size=512)
    row = int(np.argmin(np.abs(points[:300, 100, 1])))
    x, profile = points[row, :350, 0], visibility[row, :350]
    left, right = (x < -15), (x > -15)
    assert crossing(x[left], profile[left]) == pytest.approx(-31.5, abs=1.5 + 0.6)
    assert crossing(x[right], profile[right]) == pytest.approx(1.5, abs=1.5 + 0.6)


def test_soft_edges_fade_over_their_width(renderer: Renderer) -> None:
    """Under a tent, 2 to 98 % take 0.8 of the width; steps of a shadow texel limit the accuracy."""
    light = frontal(shadows=True).model_copy(update={"softness_mm": 2.0})
    visibility, _, points = seen(renderer, PLATE, light, atlas=512, shadow_size=512)
    row = int(np.argmin(np.abs(points[:300, 100, 1])))
    x, profile = points[row, :350, 0], visibility[row, :350]
    fading = (profile > 0.02) & (profile < 0.98) & (x > -15)
    assert 0.6 * 2.0 < np.ptp(x[fading]) < 1.0 * 2.0
    assert (np.diff(profile[fading]) >= -1e-6).all()


BALLS = {
    "fine": uv_sphere(80.0, 96, 48),
    "coarse": uv_sphere(80.0, 24, 12),
    "small": uv_sphere(8.0, 48, 24),
}


@pytest.mark.parametrize(("shadow_size", "lost"), [(128, 0.05), (2048, LIT)])  # 2048 is the default
@pytest.mark.parametrize("kind", ["directional", "point", "spot"])
@pytest.mark.parametrize("name", BALLS)
def test_a_lone_ball_does_not_shade_itself(
    renderer: Renderer, name: str, kind: str, shadow_size: int, lost: float
) -> None:
    head = head_of(BALLS[name])
    aim = {"position": place(head, (200, 250, 400)), "target": place(head, (0, 0, 0))}
    light = {
        "directional": DirectionalLight(direction=(-2, -2.5, -4)),
        "point": PointLight(**aim),
        "spot": SpotLight(**aim),
    }[kind]
    visibility, cosine, _ = seen(renderer, head, light, atlas=128, shadow_size=shadow_size)
    assert visibility[cosine > 0.15].min() > 1 - lost


def step(height: float) -> Head:
    """Return a floor at x > 0 beside a block of the given height, in a scene of the size of a bust."""
    wall = plane(20.0, 1)
    side = wall.positions[:, [2, 1, 0]] * [1, 1, -height / 20.0] + [0, 0, height / 2]
    upright = type(wall)(**{**vars(wall), "positions": side.astype(np.float32)})
    parts = [
        (plane(20.0, 4), (10, 0, 0), (0.0, 0.0, 0.6)),
        (plane(20.0, 4), (-10, 0, height), (0.65, 0.0, 0.3)),
        (upright, (0, 0, 0), (0.65, 0.35, 0.1)),
        (plane(10.0), (210, 210, 0), (0.8, 0.8, 0.1)),
        (plane(10.0), (-210, -210, 0), (0.65, 0.8, 0.1)),
    ]
    return head_of(joined(*parts))


@pytest.mark.parametrize(("height", "dark"), [(2.0, 1.0), (4.0, 3.0)])
def test_a_small_step_keeps_its_shadow(renderer: Renderer, height: float, dark: float) -> None:
    """At 45 degrees the shadow is as long as the step is high; nostrils and lips are of that size."""
    visibility, _, points = seen(renderer, step(height), SLANTED, atlas=256, shadow_size=2048)
    floor = (
        (points[..., 2] == 0) & (np.abs(points[..., 1]) < 5) & (points[..., 0] > 0) & (points[..., 0] < 20)
    )
    x = points[floor][:, 0]
    shaded = x[visibility[floor] < 0.5]
    assert shaded.size
    assert np.ptp(shaded) >= dark
    assert shaded.max() < height + 1.5
    assert visibility[floor][x > height + 2.0].min() > 1 - LIT


def stages_of(renderer: Renderer, *lights: AnyLight, **draw: Any) -> bool:
    """Return whether a frame under these lights draws shadow maps."""
    renderer.draw(scene_of(PLATE, *lights), settings_of(), **draw)
    return "shadows" in renderer.graph.executed_stages


def test_only_moved_lights_are_redrawn(renderer: Renderer) -> None:
    turned = DirectionalLight(direction=(1, 0.1, -1))
    brighter = SLANTED.model_copy(update={"irradiance": (9.0, 9.0, 9.0)})
    assert stages_of(renderer, turned)
    assert stages_of(renderer, SLANTED)
    assert not stages_of(renderer, SLANTED)
    assert not stages_of(renderer, brighter)  # the same depth, seen from the same place
    assert not stages_of(renderer, SLANTED, frontal())  # the second casts no shadow
    assert stages_of(renderer, SLANTED, frontal(shadows=True))
    assert stages_of(renderer, turned)
    assert stages_of(renderer, turned, run_all_passes=True)
    assert not stages_of(renderer, turned)


def test_no_shadow_maps_without_shadows(renderer: Renderer) -> None:
    assert not stages_of(renderer, frontal())
