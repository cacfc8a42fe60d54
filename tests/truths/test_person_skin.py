"""Painted skin for path tracing: the medium has its colour, and the coat reflects like a dielectric."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from painted_ball import ball, scene

from dermis.apps.truths.half_space import directional_albedo
from dermis.apps.truths.mitsuba_scene import load_mitsuba, mesh_shape, mitsuba_scene, mitsuba_variant
from dermis.apps.truths.person import medium
from dermis.apps.truths.person import shapes as skin
from dermis.apps.truths.person.medium import (
    colour_grid,
    deepest_albedo,
    pigmented_skin,
    uniform_skin,
)
from dermis.apps.truths.person.path_traced import person_scene
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_medium, trace_slab
from dermis.optics.media import SKIN_ETA, Medium
from dermis.optics.pigments.parameters import SkinParameters
from dermis.scene.lights import RectangleLight
from dermis.specular.two_lobe import NARROW_FACTOR, NARROW_WEIGHT, WIDE_FACTOR

pytest.importorskip("mitsuba")
COLOUR = (0.5, 0.3, 0.2)
SHORT_MM = np.full(3, 0.02)
"""Mean distances between entry and exit of light for which a ball is nearly flat [mm]."""


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use a coarse colour grid, which is enough for balls of one colour."""
    monkeypatch.setattr(medium, "ALBEDO_GRID_SIDE_VOXELS", 8)


def middle(person: Any, medium: Medium | None = None, samples: int = 256, **given: Any) -> Any:
    """Return the mean radiance at the middle of the ball."""
    mi = load_mitsuba()
    medium = medium or uniform_skin(COLOUR, SHORT_MM, 1.0)
    with mitsuba_variant(mi, "scalar_rgb"):
        built, _ = person_scene(mi, scene(**given), person, medium, (16, 16))
        return np.array(mi.render(built, spp=samples))[6:10, 6:10].mean(axis=(0, 1))


def test_half_space_of_the_albedo_has_the_colour() -> None:
    for colour in (0.05, 0.2, 0.5, 0.8):
        albedo = deepest_albedo(uniform_skin(COLOUR, SHORT_MM, 1.0), np.full(3, colour))
        assert directional_albedo(1.0, float(albedo[0])) == pytest.approx(colour, rel=0.01)


@pytest.mark.parametrize("eta", [1.0, SKIN_ETA])
def test_epidermis_over_dermis_has_the_colour(eta: float) -> None:
    skin = pigmented_skin(SkinParameters(), COLOUR, eta)
    assert len(skin.layers) == 2 and skin.layers[0].sigma_a[2] > skin.layers[0].sigma_a[0] > 0.0
    totals = [one.relative_to_entering.total_reflectance for one in trace_medium(skin, 100_000, 5)]
    np.testing.assert_allclose(totals, COLOUR, rtol=0.03)


@pytest.mark.parametrize("eta", [1.0, SKIN_ETA])
def test_light_spreads_by_the_given_distance(eta: float) -> None:
    wanted = np.array([1.1, 0.26, 0.17])
    layer = uniform_skin(COLOUR, wanted, eta).layers[0]
    edges = np.concatenate([[0.0], np.geomspace(1e-3, 200.0, 150)])
    for a, s, distance in zip(layer.sigma_a, layer.sigma_s_prime, wanted, strict=True):
        slab = ScatteringLayer(float(a), float(s), eta=eta)
        ring = trace_slab([slab], 60_000, 3, edges).reflectance * np.diff(edges**2)
        assert (ring * 0.5 * (edges[1:] + edges[:-1])).sum() / ring.sum() == pytest.approx(distance, rel=0.04)


def test_medium_looks_like_the_half_spaces() -> None:
    """Under a uniform sky, skin seen at normal incidence reflects as much as light at normal incidence."""
    np.testing.assert_allclose(middle(ball(colour=COLOUR, strength=0.0)), COLOUR, rtol=0.04)


def test_refracting_skin_adds_the_reflection_of_its_surface() -> None:
    fresnel = ((SKIN_ETA - 1.0) / (SKIN_ETA + 1.0)) ** 2
    found = middle(ball(colour=COLOUR), uniform_skin(COLOUR, SHORT_MM, SKIN_ETA), samples=1024)
    np.testing.assert_allclose(found, fresnel + (1.0 - fresnel) * np.array(COLOUR), rtol=0.05)


def test_lambertian_skin_has_the_colour() -> None:
    mi = load_mitsuba()
    with mitsuba_variant(mi, "scalar_rgb"):
        built, _ = person_scene(mi, scene(), ball(colour=COLOUR, strength=0.0), None, (16, 16))
        found = np.array(mi.render(built, spp=64))[6:10, 6:10].mean(axis=(0, 1))
    np.testing.assert_allclose(found, COLOUR, rtol=0.01)


def test_the_coat_reflects_by_both_lobes() -> None:
    """A softbox beside the camera lights skin of the lowest albedo."""
    light = RectangleLight(position=(60.0, 0.0, 300.0), width_mm=400.0, height_mm=400.0)
    black, mi = ball(colour=(0.0, 0.0, 0.0), roughness=0.4, strength=0.5), load_mitsuba()
    matte = ball(colour=(0.0, 0.0, 0.0), strength=0.0)
    found = middle(black, lights=(light,), samples=512) - middle(matte, lights=(light,))
    lobe = {"type": "roughconductor", "distribution": "beckmann", "eta": skin.COAT_IOR, "k": 0.0}
    lobes = [
        lobe | {"alpha": factor * 0.4, "specular_reflectance": 0.5} for factor in (NARROW_FACTOR, WIDE_FACTOR)
    ]
    rough = {"type": "blendbsdf", "weight": 1.0 - NARROW_WEIGHT, "narrow": lobes[0], "wide": lobes[1]}
    with mitsuba_variant(mi, "scalar_rgb"):
        mesh = black.mesh
        alone = mesh_shape(mi, mesh.positions, mesh.triangles, mesh.normals, bsdf=mi.load_dict(rough))
        path = {"type": "path", "hide_emitters": True}
        built = mitsuba_scene(mi, scene(lights=(light,)), path, {"ball": alone}, (16, 16))
        expected = np.array(mi.render(built, spp=256))[6:10, 6:10].mean(axis=(0, 1))
    assert expected[0] > 0.01
    np.testing.assert_allclose(found, expected, rtol=0.05)


def test_relief_bends_the_coat() -> None:
    """A ramp of height moves the highlight away from the middle."""
    light = RectangleLight(position=(0.0, 0.0, 300.0), width_mm=60.0, height_mm=60.0)
    flat = ball(colour=(0.0, 0.0, 0.0), roughness=0.1)
    ramp = np.tile(np.linspace(0.0, 40.0, 16, dtype=np.float32), (16, 1))
    leaning = replace(flat, textures=replace(flat.textures, height_mm=ramp))
    found = middle(leaning, lights=(light,), samples=64)
    assert found[0] < 0.5 * middle(flat, lights=(light,), samples=64)[0]


def test_the_grid_has_the_colour_of_the_nearest_skin() -> None:
    side = 64
    halves = np.zeros((side, side, 3), np.float32)
    halves[: side // 2] = (0.6, 0.1, 0.1)  # rows of the ball's upper half
    halves[side // 2 :] = (0.1, 0.1, 0.6)
    person = ball()
    person = replace(person, textures=replace(person.textures, colour=halves))
    box = np.full(3, 22.0)
    grid = colour_grid(person, -box, box, voxels_per_side=22)
    above, below = grid[11, 20, 11], grid[11, 1, 11]
    assert above[0] > above[2] and below[2] > below[0]
    np.testing.assert_allclose(grid[11, 11, 11], grid.reshape(-1, 3).mean(axis=0), atol=0.1)
