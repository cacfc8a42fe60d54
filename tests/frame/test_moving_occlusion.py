"""Occlusion of a moving head: closed forms, bakes of the moved mesh, and the passes that run."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from hinged import FOOT_MM, corner, hinged, open_beside
from numpy.typing import NDArray
from setups import front_camera, run_frame, scene_of, settings_of
from tolerances import FOLLOWED, OCCLUSION, STILL
from twins import surface

from dermis.atlas.build import cached_atlas
from dermis.frame.features.occlusion import moving as moving_occlusion
from dermis.frame.features.occlusion.baked import bake_occlusion
from dermis.frame.features.occlusion.moving import DEPTH_MAP_SIDE as MAP_SIDE
from dermis.frame.features.occlusion.moving import head_rotation, make_head_rotation_points, sky_views
from dermis.frame.features.visibility.layers import make_layers
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.mesh import build_mesh
from dermis.mesh.outline import Outline
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import angles_matrix
from dermis.scene.environment import Environment
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
SIDE = 64
SKY = Environment(name="uniform")
TURN = np.array(angles_matrix((20.0, 60.0, -10.0)))


@pytest.fixture(scope="module")
def head() -> Head:
    return corner()


def posed(head: Head, points: NDArray[np.floating] | None = None, **given: Any) -> Scene:
    """Return a scene of the head in uniform light with its points moved."""
    pose = Pose(positions_mm=points, **given) if points is not None or given else None
    scene = scene_of(head, camera=front_camera(head, frame_mm=180.0), rho_s=0.0)
    return replace(scene, environment=SKY, pose=pose)


def open_maps(renderer: Renderer, scene: Scene, **settings: Any) -> list[Floats]:
    """Return the occlusion map of each layout as the shading reads it."""
    layouts = run_frame(renderer, scene, **({"atlas": SIDE} | settings)).layouts
    return [download(renderer.device, layout.bindings["occlusion_map"]).astype(float) for layout in layouts]


def on_floor(head: Head) -> tuple[NDArray[np.bool_], Floats]:
    """Return the mask of texels in the middle of the floor, and their distance from the wall."""
    points, normals = surface(cached_atlas(head.mesh, SIDE), head)
    d = points[..., 0] - FOOT_MM
    middle = (normals[..., 2] > 0.9) & (np.abs(points[..., 1]) < 20) & (d > 15) & (d < 80)
    return middle, d[middle]


@pytest.mark.parametrize("seams", ["alpha", "stitch", "multi-uv"])
def test_static_head_keeps_its_occlusion(renderer: Renderer, head: Head, seams: str) -> None:
    rest = open_maps(renderer, posed(head), seams=seams)
    moved = open_maps(renderer, posed(head, head.positions_mm.copy()), seams=seams)
    assert len(rest) == len(moved) == 1 + (seams == "multi-uv")
    for before, after in zip(rest, moved, strict=True):
        assert np.abs(after - before).max() < STILL


@pytest.mark.parametrize("degrees", [30.0, 60.0, 135.0, 179.0])
def test_rotated_wall_changes_occlusion_as_computed(renderer: Renderer, head: Head, degrees: float) -> None:
    middle, d = on_floor(head)
    (made,) = open_maps(renderer, posed(head, hinged(head, degrees)))
    error = np.abs(made[:SIDE][middle] - open_beside(d, degrees))
    assert error.max() < 1.5 * OCCLUSION and error.mean() < OCCLUSION / 2  # directions count twice
    (left,) = open_maps(renderer, posed(head, hinged(head, degrees)), occlusion="rest")
    assert np.abs(left[:SIDE][middle] - open_beside(d)).max() < OCCLUSION


def baked_anew(renderer: Renderer, head: Head, points: Floats, side: int) -> NDArray[np.float32]:
    """Return the rows of a bake for the moved mesh: the atlas and the vertices."""
    mesh = head.mesh
    places = points[mesh.point].astype(np.float32)
    moved = build_mesh(places, mesh.uv, mesh.triangles, mesh.material, mesh.materials, point=mesh.point)
    anew = replace(head, mesh=moved, rig=None, strands=None, hair=None)
    inputs = renderer.prepare(scene_of(anew), settings_of(atlas=side))
    texels, atlas = inputs.layouts[0].atlas.resources["atlas"], cached_atlas(anew.mesh, side)
    return bake_occlusion(renderer.device, anew, atlas, inputs.bindings, texels, side)


def errors(renderer: Renderer, head: Head, scene: Scene, points: Floats, side: int, away: Any) -> Any:
    """Return the RMS error against a bake of the moved mesh for each setting, over chosen texels."""
    anew = baked_anew(renderer, head, points, side)[:side]
    own, found = np.isfinite(anew) & away, {}
    for which in ("baked", "rest"):
        (made,) = open_maps(renderer, scene, atlas=side, occlusion=which, strands=False)
        found[which] = float(np.sqrt(np.mean((made[:side][own] - anew[own]) ** 2)))
    return found


def test_moved_wall_occludes_like_a_newly_baked_one(renderer: Renderer, head: Head) -> None:
    """Compare all triangles but those with a corner in the crease, which sees both sides of the wall."""
    points, (places, _) = hinged(head, 45.0), surface(cached_atlas(head.mesh, SIDE), head)
    away = (places[..., 0] > FOOT_MM + 10) | (places[..., 2] > 4)
    found = errors(renderer, head, posed(head, points), points.astype(float), SIDE, away)
    assert found["baked"] < FOLLOWED < found["rest"] / 2


def test_open_mouth_occludes_like_a_newly_baked_one(renderer: Renderer) -> None:
    human = Human().head(subdivide=0)
    scene = replace(scene_of(human), environment=SKY, pose=Pose(weights={"jawOpen": 1.0}))
    assert scene.pose_arrays is not None
    points = human.control_rig.pose(
        scene.pose_arrays.weights.astype(float), scene.pose_arrays.matrices.astype(float)
    )
    found = errors(renderer, human, scene, points, 256, away=True)
    assert found["baked"] < FOLLOWED < found["rest"]  # which is the mean person's


def test_vertex_occlusion_follows_the_motion(renderer: Renderer, head: Head) -> None:
    """The rows of vertices are updated too, for surfaces without texels."""
    points = hinged(head, 45.0)
    anew, (made,) = (
        baked_anew(renderer, head, points.astype(float), SIDE),
        open_maps(renderer, posed(head, points)),
    )
    count = len(head.mesh.positions)
    made_at, anew_at = made[SIDE + 1 :].ravel()[:count], anew[SIDE:].ravel()[:count]
    floor = (head.mesh.normals[:, 2] > 0.9) & (head.mesh.positions[:, 0] > FOOT_MM)
    assert np.sqrt(np.mean((made_at - anew_at)[floor] ** 2)) < FOLLOWED


def test_rigidly_rotated_head_keeps_its_occlusion(renderer: Renderer, head: Head) -> None:
    (rest,) = open_maps(renderer, posed(head))
    (turned,) = open_maps(renderer, posed(head, head.positions_mm @ TURN.T))
    assert np.sqrt(np.mean((turned - rest) ** 2)) < STILL and np.abs(turned - rest).max() < OCCLUSION / 2


def test_both_depth_map_methods_agree(
    renderer: Renderer, head: Head, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = posed(head, hinged(head, 60.0))
    (usual,) = open_maps(renderer, scene)
    renderer.clear_cache()
    monkeypatch.setattr(moving_occlusion, "make_layers", partial(make_layers, use_compute_pass=True))
    (computed,) = open_maps(renderer, scene)
    renderer.clear_cache()
    assert np.sqrt(np.mean((computed - usual) ** 2)) < 2 * STILL


def test_occlusion_runs_only_when_the_shape_changes(renderer: Renderer, head: Head) -> None:
    settings, first = settings_of(), hinged(head, 60.0)
    scene = posed(head, first)

    def ran(scene: Scene, **changed: Any) -> bool:
        renderer.draw(scene, settings.model_copy(update=changed))
        return "occlusion" in renderer.graph.executed_stages

    renderer.draw(posed(head), settings)
    assert ran(scene) and not ran(scene) and not ran(posed(head, first.copy()))
    assert not ran(replace(scene, camera=front_camera(head, frame_mm=150.0)))
    assert not ran(replace(scene, environment=Environment(name="uniform", exposure=2.0)))
    assert ran(posed(head, hinged(head, 70.0)))
    assert not ran(posed(head)) and not ran(scene, occlusion="rest") and not ran(scene, occlusion="none")
    assert not ran(replace(scene, environment=None))


def test_rotation_is_derived_from_points_and_bones() -> None:
    human = Human().head(subdivide=0)
    anchors, rig = make_head_rotation_points(human), human.control_rig
    assert np.abs(head_rotation(anchors, rig.rest) - np.eye(3)).max() < 1e-6
    given = Pose(positions_mm=rig.positions_mm @ TURN.T).to_arrays(rig)
    assert np.abs(head_rotation(anchors, given) - TURN).max() < 1e-5
    spine = Pose(bones={"spine": (20.0, 60.0, -10.0)}, weights={"jawOpen": 1.0}).to_arrays(rig)
    assert np.abs(head_rotation(anchors, spine) - TURN).max() < 1e-5
    neck = head_rotation(anchors, Pose(bones={"neck01": (0.0, 50.0, 0.0)}).to_arrays(rig))
    assert 30.0 < np.degrees(np.arccos((np.trace(neck) - 1) / 2)) < 50.0


def test_views_cover_the_deformed_shape(head: Head) -> None:
    points = np.random.default_rng(3).normal(scale=(80.0, 120.0, 60.0), size=(500, 3))
    look = sky_views(Outline(points), TURN)
    whole = np.concatenate([points, np.ones((500, 1))], axis=1)
    column, row, depth = np.einsum("kij,nj->ikn", look.to_map, whole)
    for place in (column, row):
        assert place.min() > 0.5 and place.max() < MAP_SIDE - 1.5
        assert (np.ptp(place, axis=1) > 0.9 * MAP_SIDE).all()
    assert depth.min() > 0 and depth.max() < 1
    seen = np.einsum("kij,nj->ikn", look.views.clips, whole)
    assert np.allclose(0.5 * MAP_SIDE * (1 + seen[0]) - 0.5, column) and np.allclose(seen[2], depth)
    assert np.allclose(0.5 * MAP_SIDE * (1 - seen[1]) - 0.5, row)
    step = look.steps_mm[:, 0]  # one texel to the right
    assert np.allclose(np.einsum("kj,kj->k", look.to_map[:, 0, :3], step), 1)
    assert np.allclose(np.einsum("kj,kj->k", look.to_map[:, 1, :3], look.steps_mm[:, 1]), -1)
    assert (np.einsum("kj,kj->k", look.to_map[:, 2, :3], look.to_sky) > 0).all()
