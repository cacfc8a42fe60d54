"""Packed surface at the texels of an atlas: precision and lifetime."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import entered_light, frontal, head_of, probe, run_frame, scene_of

from dermis.frame.features.surface.texels import SURFACE_TEXEL_BYTES
from dermis.frame.renderer import Renderer
from dermis.gpu.textures import texture_from_array
from dermis.mesh.primitives import uv_sphere
from dermis.scene.model import Scene

SIZE = 64
HEAD = head_of(uv_sphere(40.0, 24, 12))
SCENE = scene_of(HEAD, frontal())
Floats = NDArray[np.float64]


@pytest.fixture(scope="module")
def packed(renderer: Renderer) -> tuple[Floats, Floats, list[Floats]]:
    """Return directions and colours with heights, and the results of packing and unpacking them."""
    random = np.random.default_rng(3)
    directions = random.normal(size=(SIZE, SIZE, 4))
    directions[0, :6, :3] = np.concatenate([np.eye(3), -np.eye(3)])
    directions /= np.linalg.norm(directions[..., :3], axis=-1, keepdims=True)
    colours = 10.0 ** random.uniform(-6, 3, (SIZE, SIZE, 1)) * random.uniform(0.2, 1, (SIZE, SIZE, 4))
    colours[0, 0, :3], colours[0, 1, :3], colours[..., 3] = 0.0, 1.0, random.uniform(0, 2, (SIZE, SIZE))
    textures = {
        name: texture_from_array(renderer.device, values.astype(np.float32), "rgba32float")
        for name, values in (("directions", directions), ("colours", colours))
    }
    lit = run_frame(renderer, SCENE, atlas=SIZE).bindings
    names = ["normal", "bent", "colour", "places"]
    made = probe(renderer.device, "packed_probe", (SIZE, SIZE), names, **lit, **textures)
    return directions[..., :3], colours, made


def test_packed_directions_are_decoded(packed: tuple[Floats, Floats, list[Floats]]) -> None:
    """Directions have 16 bits along each side of the octahedron."""
    directions, _, (normal, bent, _, places) = packed
    assert np.abs(normal[..., :3] - directions).max() < 6e-5
    assert np.abs(bent[..., :3] + directions).max() < 6e-5
    assert np.abs(places[..., :3] - 100.0 * directions[..., [1, 2, 0]]).max() < 1e-4


def test_packed_colours_and_heights_are_decoded(packed: tuple[Floats, Floats, list[Floats]]) -> None:
    directions, colours, (normal, bent, colour, places) = packed
    most = colours[..., :3].max(axis=-1, keepdims=True)
    assert (np.abs(colour[..., :3] - colours[..., :3]) <= 1.01 / 65535 * most).all()
    assert (np.abs(places[..., 3] - colours[..., 3]) <= colours[..., 3] / 32 + 1e-4).all()
    for made, direction in ((normal, directions[..., 0]), (bent, directions[..., 1])):
        assert np.allclose(made[..., 3], 0.5 + 0.4 * direction, rtol=1e-3)


def drawn(renderer: Renderer, *scenes: Scene, atlas: int = SIZE) -> list[int]:
    """Return how often the surface pass runs in each of some frames."""
    found = []
    for scene in scenes:
        run_frame(renderer, scene, atlas=atlas)
        assert "irradiance" in renderer.graph.executed_stages or scene is SCENE
        found.append(renderer.graph.executed_stages.count("surface"))
    return found


def test_surface_texels_are_drawn_only_on_change(renderer: Renderer) -> None:
    renderer.clear_cache()
    assert drawn(renderer, SCENE, SCENE) == [1, 0]
    multiplied = scene_of(HEAD, frontal(2.0), mix=0.2), scene_of(HEAD, energy="none")
    assert drawn(renderer, *multiplied) == [0, 0]  # neither lights nor what the frame multiplies with
    others = scene_of(HEAD, frontal(), roughness=0.4), scene_of(HEAD, frontal(), rho_s=0.3)
    assert drawn(renderer, *others, SCENE) == [1, 1, 1]
    assert drawn(renderer, SCENE, atlas=2 * SIZE) == [1]


def test_changed_surface_texels_are_redrawn(renderer: Renderer) -> None:
    """A head rendered again after others looks as it did at first."""
    coloured = head_of(HEAD.mesh, colour=np.full((4, 4, 3), 0.25))
    changed = [scene_of(coloured, frontal(), mix=1.0), scene_of(HEAD, frontal(), mix=1.0, rho_s=0.9)]
    first, *_, last = found = [
        entered_light(renderer, run_frame(renderer, scene, atlas=SIZE))
        for scene in (scene_of(HEAD, frontal(), mix=1.0), *changed, scene_of(HEAD, frontal(), mix=1.0))
    ]
    assert np.array_equal(first, last)
    assert not any(np.array_equal(first, other) for other in found[1:-1])


def test_surface_texels_are_freed_with_the_atlas(renderer: Renderer) -> None:
    inputs = run_frame(renderer, SCENE, atlas=SIZE)
    texture = inputs.layouts[0].surfaces
    assert texture.size == (SIZE, SIZE, 2) and SURFACE_TEXEL_BYTES == 2 * 16
    gone = weakref.ref(texture)
    del texture, inputs
    renderer.clear_cache()
    gc.collect()
    run_frame(renderer, scene_of(head_of(uv_sphere(30.0, 12, 6)), frontal()), atlas=SIZE)
    gc.collect()
    assert gone() is None
