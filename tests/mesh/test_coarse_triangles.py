"""Removal of subdivision levels where the surface is flat."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.base.arrays import Floats, Ints
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import plane, uv_sphere
from dermis.mesh.subdivide import coarse_triangles, subdivide_head


def area(places: Floats, triangles: Ints) -> float:
    a, b, c = (places[corner].astype(float) for corner in triangles.T)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


@pytest.mark.parametrize("levels", [1, 2])
def test_sphere_is_merged_to_its_control_triangles(levels: int) -> None:
    coarse = Head("sphere", uv_sphere(50, 32, 16), Maps())
    finer, count = subdivide_head(coarse, levels), len(coarse.mesh.triangles)
    found = coarse_triangles(finer, 1, 5.0)
    assert len(found) == count and found.max() < len(coarse.mesh.positions)
    assert len(coarse_triangles(finer, 1, 0.0)) == len(finer.mesh.triangles)
    assert len(coarse_triangles(finer, count + 1, 5.0)) == count * (4 if levels == 2 else 4**levels)


def test_flat_plane_is_merged() -> None:
    finer = subdivide_head(Head("sheet", plane(100.0, 4), Maps()), 2)
    found = coarse_triangles(finer, 1, 20.0)
    assert len(found) < len(finer.mesh.triangles) / 8
    assert area(finer.mesh.positions, found) == pytest.approx(
        area(finer.mesh.positions, finer.mesh.triangles), rel=0.02
    )


def test_person_is_merged_where_the_surface_is_flat() -> None:
    head = Human().head(subdivide=1)
    found = coarse_triangles(head, 5_000, 0.4)
    assert 0.25 < len(found) / len(head.mesh.triangles) < 0.5
    whole = area(head.mesh.positions, head.mesh.triangles)
    assert area(head.mesh.positions, found) == pytest.approx(whole, rel=1e-3)
    assert len(coarse_triangles(head, 5_000, 1e3)) == len(head.mesh.triangles) / 4
