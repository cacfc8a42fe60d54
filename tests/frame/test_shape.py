"""Shape on the device: float64 references, and meshes rebuilt from the same positions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cut_meshes import cut_sphere
from numpy.typing import NDArray
from setups import head_of
from tolerances import SHAPE, SHAPE_NORMAL, STRETCHED, WALKED

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.frame.features.atlas import gutters
from dermis.frame.features.atlas.gutters import make_gutter_tracing, with_separate_gutters
from dermis.frame.features.atlas.passes import draw_stretch
from dermis.frame.features.atlas.textures import AtlasMip, halve_mip, upload_atlas
from dermis.frame.features.shape import shape
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import PoseBytes, Shape, make_shape, shape_tables
from dermis.gpu import CommandList, Device, download
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.rig import MorphTargets, Rig, Skeleton, Stencils

Floats = NDArray[np.float64]
RNG = np.random.default_rng(5)


def bent(points: Floats) -> Floats:
    """Return the points of a ball of 30 mm as a bean: stretched, twisted and bent."""
    x, y, z = points.T
    turn = 0.02 * y
    x, z = np.cos(turn) * x - np.sin(turn) * z, np.sin(turn) * x + np.cos(turn) * z
    return np.stack([1.3 * x + 0.004 * y**2, 0.8 * y, z - 0.006 * x * y], axis=-1)


def rebuilt(mesh: Mesh, points: Floats) -> Mesh:
    """Return the mesh with other point positions, as if loaded from a file."""
    places = points[mesh.point].astype(np.float32)
    return build_mesh(places, mesh.uv, mesh.triangles, mesh.material, mesh.materials, point=mesh.point)


def evaluated(device: Device, head: Head, pose_bytes: PoseBytes) -> tuple[Shape, NDArray[np.float32]]:
    """Return the shape in motion, and its (v, 16) vertices."""
    made, frame = make_shape(device, shape_tables(device, head)), CommandList(device)
    shape.draw(frame, made, pose_bytes)
    frame.submit()
    table = download(device, made.surface["vertex_table"]).reshape(-1, 16)
    return made, table[: len(head.mesh.positions)]


def points_of(device: Device, buffer: object) -> Floats:
    return np.frombuffer(device.handle.queue.read_buffer(buffer), np.float32).reshape(-1, 3).astype(float)


def words(array: NDArray[np.floating]) -> bytes:
    return np.ascontiguousarray(array, np.float32).tobytes()


@pytest.fixture(scope="module")
def head() -> Head:
    return head_of(cut_sphere(30.0, 20))


def test_vertices_equal_those_of_a_rebuilt_mesh(device: Device, head: Head) -> None:
    """Normals and tangents follow the surface."""
    moved = bent(head.positions_mm.astype(float))
    _, table = evaluated(device, head, PoseBytes(words(moved)))
    mesh = rebuilt(head.mesh, moved.astype(np.float32).astype(float))
    assert np.array_equal(table[:, :3], mesh.positions) and np.array_equal(table[:, 3], mesh.uv[:, 0])
    assert np.abs(table[:, 4:7] - mesh.normals).max() < SHAPE_NORMAL
    for first, tangent in ((8, mesh.dpdu), (12, mesh.dpdv)):
        assert np.abs(table[:, first : first + 3] - tangent).max() < SHAPE * np.abs(tangent).max()


def test_normals_of_a_file_are_kept_and_rotate_with_the_surface(device: Device, head: Head) -> None:
    tilted = head.mesh.normals + RNG.uniform(-0.4, 0.4, head.mesh.normals.shape)
    tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
    own = replace(head, mesh=replace(head.mesh, normals=tilted.astype(np.float32)))
    _, table = evaluated(device, own, PoseBytes(words(own.positions_mm)))
    assert np.abs(table[:, 4:7] - tilted).max() < SHAPE_NORMAL
    turn = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], float)
    _, table = evaluated(device, own, PoseBytes(words(own.positions_mm @ turn.T)))
    assert np.abs(table[:, 4:7] - tilted @ turn.T).max() < SHAPE_NORMAL


def rigged(head: Head) -> Head:
    """Return a head with two targets that share points, three bones in a row, and subdivided points."""
    count = len(head.positions_mm)
    chosen = [np.sort(RNG.choice(count, size, replace=False)) for size in (count // 2, count // 3)]
    point = np.concatenate(chosen).astype(np.int32)
    first = np.cumsum([0, *(len(one) for one in chosen)]).astype(np.int32)
    targets = MorphTargets(("one", "two"), first, point, RNG.normal(0, 3, (len(point), 3)).astype(np.float32))
    weight = RNG.random((count, 4))
    weight /= weight.sum(axis=1, keepdims=True)
    local = np.tile(np.eye(4), (3, 1, 1))
    local[1:, 1, 3] = 10.0
    inverse = np.linalg.inv([local[0], local[0] @ local[1], local[0] @ local[1] @ local[2]])
    bone = RNG.integers(0, 3, (count, 4)).astype(np.int32)
    parent = np.array([-1, 0, 1], np.int32)
    skeleton = Skeleton(("a", "b", "c"), parent, local, inverse, np.eye(4), bone, weight.astype(np.float32))
    terms = np.concatenate([np.arange(count)[:, None], RNG.integers(0, count, (count, 1))], axis=1)
    shares = np.tile(np.array([0.75, 0.25], np.float32), count)
    stencils = Stencils(
        np.arange(0, 2 * count + 1, 2, dtype=np.int32), terms.ravel().astype(np.int32), shares
    )
    return replace(head, rig=Rig(head.positions_mm, targets, skeleton, stencils))


def test_targets_bones_and_stencils_match_the_rig(device: Device, head: Head) -> None:
    moving, weights = rigged(head), np.array([0.6, -0.3])
    rig = moving.control_rig
    assert rig.skeleton is not None and rig.stencils is not None
    local = rig.skeleton.local.copy()
    local[1, :3, :3] = [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]
    matrices = rig.skeleton.matrices(local)
    made, table = evaluated(
        device, moving, PoseBytes(words(rig.positions_mm), words(weights), words(matrices))
    )
    posed = rig.pose(weights, matrices)
    assert np.abs(points_of(device, made.stencils["control"]) - posed).max() < SHAPE * 30
    refined = rig.stencils.points(posed)
    assert np.abs(points_of(device, made.surface["points"]) - refined).max() < SHAPE * 30
    assert np.abs(table[:, :3] - refined[moving.mesh.point]).max() < SHAPE * 30


def stretched(device: Device, head: Head, atlas: Atlas, points: Floats) -> NDArray[np.float16]:
    textures, frame = upload_atlas(device, atlas), CommandList(device)
    made = make_shape(device, shape_tables(device, head))
    shape.draw(frame, made, PoseBytes(words(points)))
    draw_stretch(frame, upload_geometry(device, head.mesh, atlas, made), textures)
    frame.submit()
    return download(device, textures.resources["stretch_map"])


@pytest.mark.parametrize("layout", ["mesh", "stitched"])
def test_stretch_at_rest_equals_the_atlas(device: Device, head: Head, layout: str) -> None:
    atlas = build_atlas(head.mesh, 256, layout)
    made = stretched(device, head, atlas, head.positions_mm)
    for k, expected in enumerate((atlas.stretch[..., 0], atlas.stretch[..., 1], atlas.shear)):
        error = np.abs(made[..., k].astype(float) - expected)[atlas.coverage]
        assert error.max() < STRETCHED * max(1.0, float(np.abs(expected).max()))
    assert not made[~atlas.coverage].any()


def test_stretch_equals_that_of_an_atlas_of_the_moved_surface(device: Device, head: Head) -> None:
    moved = bent(head.positions_mm.astype(float))
    made = stretched(device, head, build_atlas(head.mesh, 256), moved)
    atlas = build_atlas(rebuilt(head.mesh, moved), 256)
    expected = np.dstack([atlas.stretch, atlas.shear]).astype(float)[atlas.coverage]
    error = np.abs(made[..., :3][atlas.coverage] - expected)
    assert error.max() < STRETCHED * expected.max()


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_a_scaled_ball_has_the_density_of_its_size(device: Device, head: Head, scale: float) -> None:
    atlas = build_atlas(head.mesh, 256, "stitched")
    made = stretched(device, head, atlas, scale * head.positions_mm).astype(float)
    expected = atlas.stretch.astype(float) / scale
    assert np.abs(made[..., :2] - expected)[atlas.coverage].max() < STRETCHED * expected.max()


def sources(device: Device, head: Head, atlas: Atlas, points: Floats) -> list[Floats]:
    """Return the (a, 2) sources of gutter texels at each resolution, traced on the device."""
    textures, frame = upload_atlas(device, atlas), CommandList(device)
    made = make_shape(device, shape_tables(device, head))
    walks, walked = (
        make_gutter_tracing(device, head.mesh, atlas, textures),
        with_separate_gutters(device, textures),
    )
    shape.draw(frame, made, PoseBytes(words(points)))
    gutters.draw(frame, walked, walks, upload_geometry(device, head.mesh, atlas, made))
    frame.submit()
    lists = [one for one in (walked, *walked.coarser) if one.gutter]
    found = [np.frombuffer(device.handle.queue.read_buffer(one.gutter), np.uint32) for one in lists]
    for one, listed in zip(lists, found, strict=True):
        assert np.array_equal(listed.reshape(-1, 4)[:, 2:], one.gutter_texels)
    return [one.view(np.float32).reshape(-1, 4)[:, :2].astype(float) for one in found]


def test_gutter_sources_at_rest_equal_the_atlas(device: Device, head: Head) -> None:
    """Scale and rotation of the whole head do not change the gutters."""
    atlas = build_atlas(head.mesh, 256, "stitched")
    sheet = AtlasMip(atlas.coverage, atlas.lit_mask, atlas.edge_distance, atlas.gutter, atlas.source)
    turn = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], float)
    for points in (head.positions_mm, head.positions_mm @ turn.T):
        fine, coarse, *_ = sources(device, head, atlas, points)
        away = np.linalg.norm(fine - atlas.source, axis=1)
        assert np.percentile(away, 98) < WALKED and np.median(away) < WALKED / 20
        away = np.linalg.norm(coarse - halve_mip(sheet).source, axis=1)
        assert np.percentile(away, 97) < WALKED


def test_gutter_distances_match_the_deformed_surface(device: Device, head: Head) -> None:
    """On a ball twice as large the texels beyond an edge are twice as many mm away: the same points."""
    atlas = build_atlas(head.mesh, 256, "stitched")
    fine, *_ = sources(device, head, atlas, 2 * head.positions_mm)
    away = np.linalg.norm(fine - atlas.source, axis=1)
    assert np.percentile(away, 98) < WALKED
    bean, *_ = sources(device, head, atlas, bent(head.positions_mm.astype(float)))
    moved = np.linalg.norm(bean - atlas.source, axis=1)
    assert np.percentile(moved, 90) > 10 * WALKED  # kept walks would be wrong by more than that
