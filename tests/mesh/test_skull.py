"""The skull of heads, bodies with eyes or bones, and standing figures; pieces of skin have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_figure import CENTRE, arm, ellipsoids, figure, patch
from small_head import SIZE

from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material, Mesh
from dermis.mesh.rig import Rig, Skeleton
from dermis.mesh.skull import head_bone, is_standing_figure


def seated() -> Mesh:
    """Return a body of 1.3 m whose arm reaches above its head, of which no section shows a figure."""
    body = ((0, 300, 0), (250, 300, 300)), ((0, 1000, 0), (80, 120, 100)), ((300, 800, 0), (50, 500, 50))
    return ellipsoids(*body)


def head_of(mesh: Mesh, rig: Rig | None = None) -> Head:
    return Head("skin", mesh, Maps(), rig=rig)


def test_skull_centre_of_a_head_is_120_mm_below_the_crown() -> None:
    ball = ellipsoids(((3, 500, 7), np.array(SIZE) / 2))
    assert head_of(ball).skull_centre_mm == pytest.approx((3, 500, 7), abs=0.01)


def test_skull_of_a_standing_figure_is_at_its_top() -> None:
    mesh = figure()
    assert is_standing_figure(mesh.positions, mesh.triangles)
    assert head_of(mesh).skull_centre_mm == pytest.approx(CENTRE, abs=1.0)


@pytest.mark.parametrize("mesh", [arm(), patch(), seated()], ids=["arm", "patch", "seated"])
def test_other_meshes_use_their_centre(mesh: Mesh) -> None:
    head = head_of(mesh)
    assert head.skull_centre_mm is None
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    assert head.centre_mm == pytest.approx(0.5 * (low + high), abs=1e-3)


def test_the_skull_of_a_body_is_at_the_level_of_its_eyes() -> None:
    mesh = seated()
    ball = len(mesh.triangles) // 3
    material = np.repeat([0, 1, 0], ball).astype(np.int32)
    eyes = replace(
        mesh, material=material, materials=(Material("skin"), Material("eyes", "opaque", eye=True))
    )
    assert (head_of(eyes).skull_centre_mm or ())[1:] == pytest.approx((1000, 0), abs=0.01)


@pytest.mark.parametrize(
    "name", ["head", "Head", "mixamorig:Head", "mixamorigHead", "J_Bip_C_Head", "DEF-head"]
)
def test_the_skull_of_a_body_is_at_its_head_bone(name: str) -> None:
    mesh = seated()
    bone = np.zeros((len(mesh.points_mm), 1), np.int32)
    bone[mesh.point] = np.repeat([0, 1, 0], len(mesh.point) // 3)[:, None]
    eye = np.tile(np.eye(4), (2, 1, 1))
    parent, weight = np.array([-1, 0], np.int32), np.ones((len(bone), 1), np.float32)
    skeleton = Skeleton(("hips", name), parent, eye, eye, np.eye(4), bone, weight)
    rig = Rig(mesh.points_mm.astype(np.float32), skeleton=skeleton)
    assert head_of(mesh, rig).skull_centre_mm == pytest.approx((0, 1000, 0), abs=1e-3)


def test_bone_names_containing_head_are_not_the_head_bone() -> None:
    assert head_bone(("forehead", "HeadTop_End", "headphones")) is None


@pytest.mark.parametrize(
    "axes",
    [
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
    ],
    ids=["up", "left", "back"],
)
def test_flat_skin_patch_faces_its_front(axes: list[list[int]]) -> None:
    head = head_of(patch(np.array(axes)))
    np.testing.assert_allclose(head.front_view_axes, axes)
    assert head.front_view_positions_mm[:, 2].max() == pytest.approx(0.9, rel=0.2)
