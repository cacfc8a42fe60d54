"""The face's direction is found for heads, and never guessed for other meshes."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from eyed_head import EYE_MM, MIRROR, ball, skin
from small_figure import arm, figure, patch

from dermis.human.person import Human
from dermis.mesh.face_direction import face_direction
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere

DIRECTIONS = ("z", "x", "-z", "-x")
NONE = np.empty((0, 3))
TURNS = pytest.mark.parametrize("quarters", range(4), ids=DIRECTIONS)
SMOOTH = {"ball": uv_sphere(100.0, 24, 12), "arm": arm(), "figure": figure(), "patch": patch()}


def turned(positions: np.ndarray, quarters: int) -> np.ndarray:
    """Return positions after quarters of a turn about the vertical, which take +Z to +X."""
    turn = np.linalg.matrix_power(np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]]), quarters)
    return positions.astype(float) @ turn


@cache
def person(seed: int) -> Mesh:
    return Human.sampled(seed).head(subdivide=1).mesh


@TURNS
@pytest.mark.parametrize("seed", [0, 12, 31])
def test_the_face_of_a_person_is_found_by_its_shape(seed: int, quarters: int) -> None:
    mesh = person(seed)
    assert face_direction(turned(mesh.positions, quarters), mesh.triangles, NONE) == DIRECTIONS[quarters]


@TURNS
def test_size_and_position_have_no_effect(quarters: int) -> None:
    mesh = person(0)
    for moved in (1e-3 * mesh.positions, mesh.positions + np.array([1000, 500, 2000])):
        assert face_direction(turned(moved, quarters), mesh.triangles, NONE) == DIRECTIONS[quarters]


@TURNS
@pytest.mark.parametrize("name", SMOOTH)
def test_a_mesh_without_a_face_has_no_direction(name: str, quarters: int) -> None:
    mesh = SMOOTH[name]
    assert face_direction(turned(mesh.positions, quarters), mesh.triangles, NONE) is None


@pytest.mark.parametrize("part", ["below", "behind", "left"])
def test_partial_head_is_not_turned(part: str) -> None:
    mesh = person(0)
    x, y, z = mesh.positions[mesh.triangles].mean(axis=1).T
    kept = {"below": y < y.max() - 240, "behind": z < z.mean(), "left": x > 5}[part]
    assert face_direction(mesh.positions.astype(float), mesh.triangles[kept], NONE) in (None, "z")


def test_a_face_between_two_axes_has_no_direction() -> None:
    mesh, angle = person(0), np.radians(30)
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    assert face_direction(mesh.positions @ turn, mesh.triangles, NONE) is None


@TURNS
@pytest.mark.parametrize("kind", ["balls", "joints"])
def test_eyes_show_the_direction_of_a_smooth_head(kind: str, quarters: int) -> None:
    points, triangles = skin()
    around = ball()[0] if kind == "balls" else np.zeros((1, 3))
    eyes = np.vstack([around + EYE_MM, around + EYE_MM * MIRROR])
    assert face_direction(turned(points, quarters), triangles, NONE) is None
    assert face_direction(turned(points, quarters), triangles, turned(eyes, quarters)) == DIRECTIONS[quarters]


@pytest.mark.parametrize(
    "eyes",
    [
        ball()[0] + EYE_MM,
        np.array([[-30.0, 10, 0], [30, 10, 0]]),
        np.array([[-30.0, 10, 70], [30, 80, 70]]),
        np.array([[-30.0, 10, 70], [0, 10, 170], [30, 10, 70]]),
        np.array([[30.0, 10, 70], [70, 10, 70]]),
        np.array([[-30.0, 900, 70], [30, 900, 70]]),
    ],
    ids=["one", "in the middle", "oblique", "with a target", "beside", "elsewhere"],
)
def test_eyes_at_implausible_positions_give_no_direction(eyes: np.ndarray) -> None:
    assert face_direction(*skin(), eyes) is None


def test_empty_and_flat_meshes_have_no_direction() -> None:
    points = np.zeros((3, 3))
    for triangles in (np.empty((0, 3), int), np.array([[0, 1, 2]])):
        assert face_direction(points, triangles, NONE) is None
    assert face_direction(np.array([[0.0, y, 0] for y in range(3)]), np.array([[0, 1, 2]]), NONE) is None
