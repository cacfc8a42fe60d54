"""Lips at rest touch: from the front, above and below, neither teeth nor tongue are visible between them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Human
from dermis.human.lips import _lip_pairs, close_lips
from dermis.human.makehuman import morphed_points_mm
from dermis.human.model import MATERIAL_OF_GROUP, build_head
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import MOUTH_PARTS
from dermis.mesh.subdivide import subdivide_head

Floats = NDArray[np.float64]
PEOPLE = [None, *range(8)]
STEP_MM, HALF_WIDTH_MM, HALF_HEIGHT_MM = 0.2, 30.0, 8.0
"""Distance between rays, and size of the window around the mouth through which they pass."""
CONTACT = 4
CORNER_ROW = 12


def person_of(seed: int | None) -> Human:
    return Human() if seed is None else Human.sampled(seed)


@cache
def head_of(seed: int | None) -> Head:
    person = person_of(seed)
    return subdivide_head(build_head(person.target_weights(), Maps(), "own", person.iris), 1)


def rays_that_meet_the_mouth(head: Head, elevation_degrees: float) -> int:
    """Return how many parallel rays of a grid around the mouth first meet teeth or tongue."""
    angle = np.radians(elevation_degrees)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    middle = head.control_rig.positions_mm[_lip_pairs().rings[0, CORNER_ROW, CONTACT]] * [0, 1, 1]
    triangles = ((head.mesh.positions - middle) @ turn.T)[head.mesh.triangles]
    window = np.array([HALF_WIDTH_MM, HALF_HEIGHT_MM])
    near = (np.abs(triangles[..., :2]).min(axis=1) < window + 5).all(axis=1) & (
        triangles[..., 2].min(axis=1) > -45
    )
    return count_nearest(triangles[near], head.mesh.material[near], window)


def count_nearest(triangles: Floats, material: NDArray[np.integer[Any]], window: Floats) -> int:
    """Return how many rays along -z of a grid in a window first meet a triangle of a part of the mouth."""
    parts = [material.part in MOUTH_PARTS for material in MATERIAL_OF_GROUP.values()]
    size = (2 * window / STEP_MM).astype(int)
    depth, found = np.full(size, -np.inf), np.full(size, -1)
    for corners, number in zip(triangles, material, strict=True):
        grid = (corners[:, :2] + window) / STEP_MM
        low = np.clip(np.ceil(grid.min(axis=0)).astype(int), 0, size)
        high = np.clip(np.floor(grid.max(axis=0)).astype(int) + 1, 0, size)
        a, b = grid[1] - grid[0], grid[2] - grid[0]
        area = a[0] * b[1] - a[1] * b[0]
        if (high <= low).any() or abs(area) < 1e-12:
            continue
        columns, rows = np.arange(low[0], high[0]), np.arange(low[1], high[1])
        x, y = np.meshgrid(columns - grid[0, 0], rows - grid[0, 1], indexing="ij")
        u, v = (x * b[1] - y * b[0]) / area, (a[0] * y - a[1] * x) / area
        z = corners[0, 2] + u * (corners[1, 2] - corners[0, 2]) + v * (corners[2, 2] - corners[0, 2])
        region = slice(low[0], high[0]), slice(low[1], high[1])
        nearer = (u >= 0) & (v >= 0) & (u + v <= 1) & (z > depth[region])
        depth[region][nearer], found[region][nearer] = z[nearer], number
    return int(np.isin(found, np.flatnonzero(parts)).sum())


@pytest.mark.parametrize("seed", PEOPLE)
def test_closed_lips_hide_teeth_and_tongue(seed: int | None) -> None:
    assert [rays_that_meet_the_mouth(head_of(seed), degrees) for degrees in (-12, 0, 12)] == [0, 0, 0]


def test_published_lips_leave_a_slit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dermis.human.model.close_lips", lambda points_mm: points_mm)
    open_head = subdivide_head(build_head(Human().target_weights(), Maps(), "own", Human().iris), 1)
    assert rays_that_meet_the_mouth(open_head, 0) > 50


@pytest.mark.parametrize("seed", PEOPLE)
def test_only_lips_move_and_by_little(seed: int | None) -> None:
    points = morphed_points_mm(person_of(seed).target_weights())
    moved = close_lips(points) - points
    rings = np.unique(_lip_pairs().rings)
    assert not np.delete(moved, rings, axis=0).any() and not moved[:, [0, 2]].any()
    assert np.abs(moved).max() < 2.5
    again = close_lips(close_lips(points)) - close_lips(points)
    assert np.abs(again).max() < 0.35  # lips that touch hardly move


def test_halves_of_the_lips_are_mirror_images() -> None:
    left, right = (morphed_points_mm({})[rings] for rings in _lip_pairs().rings)
    np.testing.assert_allclose(left * [-1, 1, 1], right, atol=0.02)
