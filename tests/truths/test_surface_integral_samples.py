"""Irradiance samples on a mesh, and the octree over the samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.apps.truths.irradiance_samples import IrradianceSamples, MeshPoints, sample_irradiance
from dermis.apps.truths.octree import Octree, build_octree
from dermis.base.errors import DermisError
from dermis.mesh.geometry import edges, triangle_areas
from dermis.mesh.mesh import Material
from dermis.mesh.primitives import plane, uv_sphere

Floats = NDArray[np.float64]


def even(mesh_points: MeshPoints) -> Floats:
    return np.ones_like(mesh_points.positions)


def sides_mm(samples: IrradianceSamples) -> Floats:
    ends, _, _ = edges(samples.triangles)
    return np.linalg.norm(samples.positions[ends[:, 0]] - samples.positions[ends[:, 1]], axis=1)


def test_sample_edges_are_short_and_shared() -> None:
    mesh = uv_sphere(10.0, 24, 12)
    samples = sample_irradiance(mesh, even, 0.7)
    assert sides_mm(samples).max() <= 0.7
    area = triangle_areas(mesh.positions[mesh.triangles]).sum()
    assert triangle_areas(samples.positions[samples.triangles]).sum() == pytest.approx(area, rel=1e-6)
    _, _, counts = edges(samples.triangles)
    border = sides_mm(samples)[counts == 1].sum()
    ends, _, mesh_counts = edges(mesh.triangles)
    along = np.linalg.norm(np.diff(mesh.positions[ends], axis=1)[:, 0], axis=1)[mesh_counts == 1].sum()
    assert counts.max() == 2 and border == pytest.approx(along, rel=1e-6)


def test_points_interpolate_values_of_the_mesh() -> None:
    mesh = plane(20.0, 3)
    seen: list[MeshPoints] = []

    def light(mesh_points: MeshPoints) -> Floats:
        seen.append(mesh_points)
        return even(mesh_points)

    samples = sample_irradiance(mesh, light, 1.1)
    uv = seen[0].interpolate(mesh, mesh.uv)
    np.testing.assert_allclose(uv[:, 0], samples.positions[:, 0] / 20.0 + 0.5, atol=1e-6)
    np.testing.assert_allclose(uv[:, 1], 0.5 - samples.positions[:, 1] / 20.0, atol=1e-6)


def test_samples_are_denser_where_light_changes() -> None:
    """The light is evaluated for new samples only, and all keep the light of their positions."""
    asked: list[int] = []

    def disc(mesh_points: MeshPoints) -> Floats:
        asked.append(len(mesh_points.positions))
        inside = np.hypot(mesh_points.positions[:, 0], mesh_points.positions[:, 1]) < 3.0
        return np.repeat(inside[:, None].astype(np.float64), 3, axis=1)

    samples = sample_irradiance(plane(20.0), disc, 2.0, min_spacing_mm=0.1)
    assert sum(asked) == len(samples.positions) and len(asked) > 3
    r = np.linalg.norm(samples.positions, axis=1)
    np.testing.assert_array_equal(samples.irradiance[:, 0], r < 3.0)
    corners = samples.irradiance[samples.triangles][..., 0]
    crossed = corners.min(axis=1) != corners.max(axis=1)
    area = triangle_areas(samples.positions[samples.triangles])
    flux = (area * corners.mean(axis=1)).sum()
    assert area[crossed].max() < 0.05 and area[~crossed].max() > 0.5
    assert flux == pytest.approx(np.pi * 9.0, rel=0.01)


def test_refinement_ends_at_a_single_bright_corner() -> None:
    """Sides that meet in a corner would remain long for ever if only they were split."""

    def corner(mesh_points: MeshPoints) -> Floats:
        at = np.linalg.norm(mesh_points.positions - np.array([5.0, 5.0, 0.0]), axis=1) < 1e-6
        return np.repeat(at[:, None].astype(np.float64), 3, axis=1)

    samples = sample_irradiance(plane(10.0), corner, 10.0, min_spacing_mm=0.05)
    corners = samples.positions[samples.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert len(samples.triangles) < 200
    assert (triangle_areas(corners) > 0.05 * sides.max(axis=1) ** 2).all()


def test_only_skin_is_sampled() -> None:
    mesh = plane(10.0)
    mesh = replace(
        mesh, material=np.array([0, 1], np.int32), materials=(Material("skin"), Material("eye", "opaque"))
    )
    samples = sample_irradiance(mesh, even, 1.0)
    assert triangle_areas(samples.positions[samples.triangles]).sum() == pytest.approx(50.0)
    with pytest.raises(DermisError, match="opaque"):
        sample_irradiance(replace(mesh, materials=(Material("a", "opaque"),) * 2), even, 1.0)
    with pytest.raises(DermisError, match="spacing"):
        sample_irradiance(mesh, even, 0.0)


@pytest.fixture(scope="module")
def tree() -> Octree:
    def light(mesh_points: MeshPoints) -> Floats:
        x = mesh_points.positions
        return np.column_stack((np.maximum(x[:, 0], 0.0), np.ones(len(x)), np.maximum(5.0 - x[:, 1], 0.0)))

    return build_octree(sample_irradiance(uv_sphere(8.0, 32, 16), light, 0.8))


def test_each_triangle_is_in_one_octree_node(tree: Octree) -> None:
    """A traversal that opens every node visits every triangle exactly once."""
    met = np.zeros(len(tree.area), np.int64)
    for node in range(len(tree.first)):
        if tree.next_node[node] == node + 1:
            met[tree.first[node] : tree.end[node]] += 1
        else:
            assert tree.first[node + 1] == tree.first[node]
    assert (met == 1).all()
    leaves = tree.next_node == np.arange(len(tree.next_node)) + 1
    assert (tree.end - tree.first)[leaves].max() <= 16 < (tree.end - tree.first)[~leaves].min()


@pytest.mark.parametrize("part", [0.0, 0.003, 0.5, 1.0])
def test_points_represent_a_node(tree: Octree, part: float) -> None:
    """Flux, centroids, second moments and bounds are compared with sums over many points of the triangles."""
    node = round(part * (len(tree.first) - 1))
    inside = slice(tree.first[node], tree.end[node])
    weights = np.random.default_rng(2).dirichlet((1.0, 1.0, 1.0), 150 if part == 0.0 else 4000)
    error_density = tree.area[inside][:, None, None] / len(weights)
    light = (weights @ tree.irradiance[inside] * error_density).reshape(-1, 3)
    away = (weights @ tree.corners[inside]).reshape(-1, 3) - tree.centre[node]
    arms, size, power = tree.points[node] - tree.centre[node], tree.radius[node], light.sum(axis=0)
    np.testing.assert_allclose(tree.flux[node].sum(axis=0), power, rtol=0.02, atol=1e-9)
    np.testing.assert_allclose(light.sum(axis=1) @ away, 0.0, atol=0.02 * size * light.sum())
    assert max(np.linalg.norm(values, axis=1).max() for values in (away, arms)) <= size * (1.0 + 1e-9)
    np.testing.assert_allclose(arms.mean(axis=0), 0.0, atol=1e-9)
    lit = power > 0.0
    centroid_error = np.linalg.norm(light.T @ away - tree.flux[node].T @ arms, axis=1)
    assert tree.centroid_error[node] == pytest.approx(
        (centroid_error[lit] / power[lit]).max(), abs=0.03 * size
    )
    true, points = second_moments(away, light), second_moments(arms, tree.flux[node])
    moment_error = np.linalg.norm(true - points, axis=(1, 2))[lit] / power[lit]
    assert tree.moment_error[node] == pytest.approx(moment_error.max(), abs=0.03 * size**2)
    both = second_moments(away, light) + second_moments(arms, np.abs(tree.flux[node]))
    second_moment = np.trace(both, axis1=1, axis2=2)[lit] / power[lit]
    assert tree.second_moment[node] == pytest.approx(second_moment.max(), rel=0.05)


def second_moments(mesh_points: Floats, flux: Floats) -> Floats:
    return np.einsum("nc,na,nb->cab", flux, mesh_points, mesh_points)


def test_flat_nodes_of_white_light_keep_second_moments() -> None:
    tree = build_octree(sample_irradiance(plane(12.0), even, 0.5))
    mesh_points = tree.points[0] - tree.centre[0]
    np.testing.assert_allclose(mesh_points.T @ mesh_points / 3.0, np.diag([12.0, 12.0, 0.0]), atol=1e-5)
    assert tree.moment_error.max() < 1e-6 and tree.centroid_error.max() < 1e-6


def test_dark_nodes_give_finite_results() -> None:
    tree = build_octree(sample_irradiance(plane(12.0), lambda p: 0.0 * p.positions, 0.5))
    assert (tree.flux == 0.0).all() and np.isfinite(tree.points).all() and np.isfinite(tree.centre).all()
    assert (tree.second_moment == 0.0).all() and (tree.centroid_error == 0.0).all()
