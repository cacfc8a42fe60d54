"""Hair strands on a mesh: roots in quads, subdivision and movement."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.mesh.geometry import split_quads
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.strands import Roots, Strands, refine_roots, root_frames, to_root_frames
from dermis.mesh.subdivide import subdivide_head

Floats = NDArray[np.float64]


def _sheet(bent: float = 0.0) -> Mesh:
    """Return a sheet of 3 x 3 quads with sides of 60 mm."""
    row, column = (axis.ravel() for axis in np.mgrid[:4, :4])
    number = np.arange(16).reshape(4, 4)
    around = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    quads = np.stack([part.ravel() for part in around], 1)
    places = np.column_stack((20.0 * column, -20.0 * row, bent * np.sin(column) * np.cos(row)))
    uv, pairs = np.column_stack((column / 3, row / 3)), np.arange(18).reshape(-1, 2)
    flat = np.zeros(18, np.int32)
    return build_mesh(places, uv, split_quads(quads), flat, (Material("skin"),), quads=pairs)


def _roots(mesh: Mesh, count: int = 40) -> Roots:
    rng = np.random.default_rng(0)
    quad = rng.integers(0, len(mesh.quads), count)
    return Roots(quad.astype(np.int32), rng.random((count, 2)).astype(np.float32))


def _strands(mesh: Mesh) -> Strands:
    roots = _roots(mesh)
    count = len(roots.quad)
    ways = np.random.default_rng(1).normal(0, 3, (count, 5, 3))
    ways[:, 0] = 0.0
    return Strands(
        roots,
        to_root_frames(mesh, roots, ways),
        np.full((count, 5), 0.04, np.float32),
        np.zeros((count, 3), np.float32),
    )


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_roots_keep_positions_on_a_finer_mesh(levels: int) -> None:
    """Check roots in the middle of a flat sheet, where subdivision moves nothing."""
    mesh = _sheet()
    inside = np.flatnonzero(_roots(mesh, 400).quad == 4)
    roots = Roots(*(part[inside] for part in _roots(mesh, 400)))
    finer = subdivide_head(Head("sheet", mesh, Maps()), levels).mesh
    before, _ = root_frames(mesh, roots, mesh.points_mm)
    after, _ = root_frames(finer, refine_roots(mesh, roots, levels), finer.points_mm)
    assert np.abs(before - after).max() < 0.6
    if levels == 3:  # borders are smoothed, and bring the rest along by a little
        assert np.abs(before - after).mean() < 0.3


def test_a_subdivided_head_keeps_its_hairs() -> None:
    """Check that strands keep their directions in space after subdivision."""
    mesh = _sheet(bent=6.0)
    head = Head("sheet", mesh, Maps(), strands=_strands(mesh))
    finer = subdivide_head(head, 2)
    assert head.strands is not None and finer.strands is not None
    before = head.strands.knot_positions_mm(mesh, mesh.points_mm)
    after = finer.strands.knot_positions_mm(finer.mesh, finer.mesh.points_mm)
    assert np.abs((after - after[:, :1]) - (before - before[:, :1])).max() < 1e-4


def test_hairs_turn_with_their_quad() -> None:
    mesh = _sheet(bent=6.0)
    strands, points = _strands(mesh), mesh.points_mm
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    still = strands.knot_positions_mm(mesh, points)
    moved = strands.knot_positions_mm(mesh, points @ turn.T + 5.0)
    assert np.abs(moved - (still @ turn.T + 5.0)).max() < 1e-6


def test_frames_are_orthonormal() -> None:
    mesh = _sheet(bent=9.0)
    _, frame = root_frames(mesh, _roots(mesh), mesh.points_mm)
    assert np.abs(np.einsum("nic,njc->nij", frame, frame) - np.eye(3)).max() < 1e-12
    assert np.allclose(np.linalg.det(frame), 1.0)
