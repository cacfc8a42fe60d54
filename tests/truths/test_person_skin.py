"""Painted skin for path tracing: the medium has its colour, and the coat reflects like a dielectric."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from painted_ball import ball, scene

from dermis.apps.truths.half_space import diffuse_albedo, directional_albedo
from dermis.apps.truths.mitsuba_scene import load_mitsuba, mesh_shape, mitsuba_scene, mitsuba_variant
from dermis.apps.truths.person import medium
from dermis.apps.truths.person import shapes as skin
from dermis.apps.truths.person.medium import (
    COAT_TRANSMITTANCE,
    colour_grid,
    mean_free_paths,
    single_scattering_albedo,
)
from dermis.apps.truths.person.path_traced import person_scene
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.scene.lights import RectangleLight

pytest.importorskip("mitsuba")
COLOUR = (0.5, 0.3, 0.2)
SHORT = np.full(3, 0.02)
"""Mean free paths for which a ball is nearly flat [mm]."""


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use a coarse colour grid, which is enough for balls of one colour."""
    monkeypatch.setattr(medium, "GRID_VOXELS", 8)


def middle(person: Any, paths: NDArray[np.float64] = SHORT, samples: int = 256, **given: Any) -> Any:
    """Return the mean radiance at the middle of the ball."""
    mi = load_mitsuba()
    with mitsuba_variant(mi, "scalar_rgb"):
        built, _ = person_scene(mi, scene(**given), person, paths, (16, 16))
        return np.array(mi.render(built, spp=samples))[6:10, 6:10].mean(axis=(0, 1))


def test_half_space_of_the_single_scattering_albedo_has_the_colour() -> None:
    for colour in (0.02, 0.2, 0.5, 0.8):
        assert diffuse_albedo(float(single_scattering_albedo(colour))) * COAT_TRANSMITTANCE == pytest.approx(
            colour, abs=1e-3
        )


def test_light_spreads_by_the_given_distance() -> None:
    wanted = np.array([1.1, 0.26, 0.17])
    paths = mean_free_paths(COLOUR, wanted)
    edges = np.concatenate([[0.0], np.geomspace(1e-3, 200.0, 150)])
    for path, albedo, distance in zip(paths, single_scattering_albedo(COLOUR), wanted, strict=True):
        layer = ScatteringLayer((1.0 - albedo) / path, albedo / path, eta=1.0)
        ring = trace_slab([layer], 60_000, 3, edges).reflectance * np.diff(edges**2)
        assert (ring * 0.5 * (edges[1:] + edges[:-1])).sum() / ring.sum() == pytest.approx(distance, rel=0.04)


def test_medium_looks_like_the_half_spaces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seen at normal incidence the ball is a little darker than its colour, the mean over all directions."""
    monkeypatch.setattr(skin, "COAT_INDEX", 1.0)  # no surface reflection
    expected = [
        COAT_TRANSMITTANCE * directional_albedo(1.0, float(albedo))
        for albedo in single_scattering_albedo(COLOUR)
    ]
    np.testing.assert_allclose(middle(ball(colour=COLOUR)), expected, rtol=0.03)


def test_the_coat_reflects_as_a_rough_dielectric() -> None:
    """A softbox beside the camera lights skin of the lowest albedo."""
    light = RectangleLight(position=(60.0, 0.0, 300.0), width_mm=400.0, height_mm=400.0)
    black, mi = ball(colour=(0.0, 0.0, 0.0), roughness=0.4), load_mitsuba()
    found = middle(black, lights=(light,))
    rough = {
        "type": "roughconductor",
        "distribution": "beckmann",
        "alpha": 0.4,
        "eta": skin.COAT_INDEX,
        "k": 0.0,
    }
    with mitsuba_variant(mi, "scalar_rgb"):
        mesh = black.mesh
        alone = mesh_shape(mi, mesh.positions, mesh.triangles, mesh.normals, bsdf=mi.load_dict(rough))
        path = {"type": "path", "hide_emitters": True}
        built = mitsuba_scene(mi, scene(lights=(light,)), path, {"ball": alone}, (16, 16))
        expected = np.array(mi.render(built, spp=256))[6:10, 6:10].mean(axis=(0, 1))
    assert expected[0] > 0.01
    np.testing.assert_allclose(found, expected, rtol=0.03)


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
    grid = colour_grid(person, -box, box, voxels=22)
    above, below = grid[11, 20, 11], grid[11, 1, 11]
    assert above[0] > above[2] and below[2] > below[0]
    np.testing.assert_allclose(grid[11, 11, 11], grid.reshape(-1, 3).mean(axis=0), atol=0.1)
