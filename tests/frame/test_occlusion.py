"""Sky visibility compared with closed forms, and its use in the frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hinged import corner, open_beside
from numpy.typing import NDArray
from setups import front_camera, head_of, run_frame, scene_of, settings_of
from tolerances import LIT, OCCLUSION
from twins import surface

from dermis.atlas.build import build_atlas, cached_atlas
from dermis.frame.features.occlusion.baked import bake_occlusion, fill_occlusion_gaps
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.mesh.geometry import fibonacci_sphere
from dermis.mesh.head import Head
from dermis.mesh.primitives import uv_sphere
from dermis.scene.environment import Environment
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
SIDE = 64


def baked(renderer: Renderer, head: Head, side: int = SIDE, **options: Any) -> NDArray[np.float32]:
    """Return the rows of a bake: the atlas and the vertices."""
    inputs = renderer.prepare(scene_of(head), settings_of(atlas=side))
    texels = inputs.layouts[0].atlas.resources["atlas"]
    return bake_occlusion(
        renderer.device, head, build_atlas(head.mesh, side), inputs.bindings, texels, side, **options
    )


def test_directions_are_distributed_uniformly_on_the_sphere() -> None:
    towards = fibonacci_sphere(128)
    assert np.allclose(np.linalg.norm(towards, axis=1), 1)
    assert np.abs(towards.mean(axis=0)).max() < 0.01
    for normal in np.random.default_rng(0).normal(size=(20, 3)):
        unit = normal / np.linalg.norm(normal)
        assert np.maximum(towards @ unit, 0).mean() == pytest.approx(0.25, rel=0.02)


def test_ball_is_unoccluded(renderer: Renderer) -> None:
    made = baked(renderer, head_of(uv_sphere(60.0, 48, 24)))
    assert np.nanmin(made) > 1 - 10 * LIT and np.nanmax(made) <= 1


def test_floor_beside_a_wall_matches_the_closed_form(renderer: Renderer) -> None:
    """A long wall of height h at distance d hides (1 - d / sqrt(d^2 + h^2)) / 2."""
    head = corner()
    made = baked(renderer, head)[:SIDE]
    points, normals = surface(cached_atlas(head.mesh, SIDE), head)
    middle = (normals[..., 2] > 0.9) & (np.abs(points[..., 1]) < 20) & (points[..., 0] < 20)
    d = points[..., 0][middle] + 100.0
    exact = open_beside(d)
    near = (d > 5) & (d < 80)  # so that 200 mm is long
    assert near.sum() > 10
    assert np.abs(made[middle] - exact)[near].max() < OCCLUSION
    assert np.abs(made[middle] - exact)[near].mean() < OCCLUSION / 3


def test_vertex_occlusion_agrees_with_the_atlas(renderer: Renderer) -> None:
    """All vertices follow the texels, row by row."""
    head = corner()
    made = baked(renderer, head)
    count = len(head.mesh.positions)
    vertices = made[SIDE:].ravel()
    assert np.isfinite(vertices[:count]).all() and np.isnan(vertices[count:]).all()
    floor = (head.mesh.normals[:, 2] > 0.9) & (np.abs(head.mesh.positions[:, 1]) < 30)
    x = head.mesh.positions[:, 0]
    assert vertices[:count][floor & (x == -90)].mean() < vertices[:count][floor & (x == 0)].mean() - 0.15


def test_the_map_has_no_gaps() -> None:
    rows = np.full((5, 4), np.nan, np.float32)
    rows[1, 1], rows[2, 3], rows[4] = 0.25, 0.75, [0.1, 0.2, 0.3, np.nan]
    made = fill_occlusion_gaps(rows, 4)
    assert made.shape == (6, 4) and np.isfinite(made).all()
    assert made[0, 0] == made[1, 1] == np.float32(0.25) and made[3, 3] == np.float32(0.75)
    assert np.array_equal(made[3], made[4]) and np.allclose(made[5], [0.1, 0.2, 0.3, 1.0])


def seen(renderer: Renderer, scene: Scene, **settings: Any) -> Floats:
    inputs = run_frame(renderer, scene, **({"size": (64, 64), "atlas": SIDE} | settings))
    return download(renderer.device, inputs.resources.post.picture.exposed)[..., :3].astype(float)


def test_corners_are_darker_and_can_be_left_bright(renderer: Renderer) -> None:
    head = corner()
    scene = replace(
        scene_of(head, camera=front_camera(head, frame_mm=180.0), rho_s=0.0),
        environment=Environment(name="uniform"),
    )
    dark, bright = (seen(renderer, scene, occlusion=which) for which in ("baked", "none"))
    assert np.allclose(bright[20:44, 10:60], bright[32, 32], rtol=0.01)
    x = (np.arange(64) + 0.5 - 32) / 64 * 180.0
    open_ = open_beside(x + 100.0)
    # light between the walls makes the shade brighter than the open share alone [Jimenez2016]
    a, b, c = 2.0404 * 0.8 - 0.3324, -4.7951 * 0.8 + 0.6417, 2.7552 * 0.8 + 0.6903
    exact = ((open_ * a + b) * open_ + c) * open_
    assert np.abs(dark[32] / bright[32, 32] - exact[:, None])[4:56].max() < OCCLUSION


def test_opaque_parts_are_occluded_by_their_vertices(renderer: Renderer) -> None:
    """An opaque floor owns no texels and uses the values of its vertices."""
    mesh = corner().mesh
    kinds = tuple(replace(part, kind="opaque") for part in mesh.materials[:1]) + mesh.materials[1:]
    head = head_of(replace(mesh, materials=kinds))
    scene = replace(
        scene_of(head, camera=front_camera(head, frame_mm=180.0)), environment=Environment(name="uniform")
    )
    dark, bright = (seen(renderer, scene, occlusion=which) for which in ("baked", "none"))
    assert dark[32, 3, 0] < 0.95 * bright[32, 3, 0]
    assert dark[32, 60, 0] > 0.97 * bright[32, 60, 0]


def test_occlusion_is_baked_once(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second bake is read from disk, by a key of mesh, atlas and directions."""
    head = corner()
    scene = replace(scene_of(head, rho_s=0.0), environment=Environment(name="uniform"))
    first = seen(renderer, scene)
    renderer.clear_cache()
    monkeypatch.setattr("dermis.frame.features.occlusion.baked.bake_occlusion", None)
    assert np.array_equal(seen(renderer, scene), first)
