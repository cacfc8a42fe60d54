"""Stencils of subdivided meshes, and heads that move with them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dermis.mesh import subdivide as module
from dermis.mesh.geometry import split_quads
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import plane, uv_sphere
from dermis.mesh.rig import MorphTargets, Rig
from dermis.mesh.subdivide import subdivide, subdivide_head
from dermis.scene.heads import load_head


def _quads() -> Mesh:
    """Return an open, bent sheet of quads."""
    row, column = (axis.ravel() for axis in np.mgrid[:6, :5])
    number = np.arange(30).reshape(6, 5)
    quads = np.stack(
        [part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])], 1
    )
    positions = np.column_stack((20 * column, -20 * row, 30 * np.sin(column) * np.cos(row)))
    uv = np.column_stack((column / 4, row / 5))
    pairs = np.arange(2 * len(quads)).reshape(-1, 2)
    return build_mesh(
        positions, uv, split_quads(quads), np.zeros(2 * len(quads)), (Material("skin"),), quads=pairs
    )


def _control(mesh: Mesh) -> np.ndarray:
    return Head("control", mesh, Maps()).positions_mm.astype(float)


@pytest.mark.parametrize("levels", [1, 2, 3])
@pytest.mark.parametrize(
    "mesh", [uv_sphere(50, 12, 6), plane(90, 3), _quads()], ids=["sphere", "plane", "quads"]
)
def test_stencils_reproduce_refined_points(mesh: Mesh, levels: int) -> None:
    finer, stencils = subdivide(mesh, levels)
    assert stencils is not None
    assert len(stencils.first) == int(finer.point.max()) + 2
    np.testing.assert_allclose(stencils.points(_control(mesh))[finer.point], finer.positions, atol=2e-5)
    sums = np.add.reduceat(stencils.weight.astype(float), stencils.first[:-1])
    np.testing.assert_allclose(sums, 1, atol=3e-7)
    assert stencils.weight.min() > 0
    owner = np.repeat(np.arange(len(stencils.first) - 1), np.diff(stencils.first))
    pairs = owner.astype(np.int64) * len(mesh.positions) + stencils.point
    assert (np.diff(pairs) > 0).all()  # no point twice, all in order
    assert (stencils.first.dtype, stencils.point.dtype, stencils.weight.dtype) == (
        np.int32,
        np.int32,
        np.float32,
    )


@pytest.mark.parametrize("mesh", [uv_sphere(100, 12, 6), _quads()], ids=["triangles", "quads"])
def test_a_moved_control_mesh_moves_the_finer_one(mesh: Mesh) -> None:
    delta = np.array([[0, 5, 0], [3, 0, 0]], np.float32)
    targets = MorphTargets(("up",), np.array([0, 2], np.int32), np.array([3, 7], np.int32), delta)
    head = Head("head", mesh, Maps(), rig=Rig(_control(mesh).astype(np.float32), targets))
    finer = subdivide_head(head, 2)
    assert finer.targets == ("up",) and finer.rig is not None and finer.rig.stencils is not None
    np.testing.assert_array_equal(finer.positions_mm, head.positions_mm)
    posed = finer.rig.pose(np.array([0.5]))
    loaded_anew = replace(mesh, positions=posed[mesh.point].astype(np.float32))
    expected = subdivide(loaded_anew, 2).mesh
    np.testing.assert_allclose(
        finer.rig.stencils.points(posed)[expected.point], expected.positions, atol=2e-5
    )
    assert subdivide_head(head, 0) is head


def test_a_loaded_head_has_its_stencils(tmp_path: Path) -> None:
    mesh = uv_sphere(100, 12, 6)
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.positions]
    lines += [f"vt {u} {1 - v}" for u, v in mesh.uv]
    lines += [" ".join(["f", *(f"{k + 1}/{k + 1}" for k in row)]) for row in mesh.triangles]
    path = tmp_path / "ball.obj"
    path.write_text("\n".join(lines))
    plain, head = (load_head(path, subdivide=levels) for levels in (0, 1))
    assert plain.rig is None
    assert head.rig is not None and head.rig.stencils is not None
    np.testing.assert_array_equal(head.positions_mm, plain.positions_mm)
    points = head.rig.stencils.points(head.positions_mm.astype(float))
    np.testing.assert_allclose(points[head.mesh.point], head.mesh.positions, atol=2e-5)


def test_weights_of_large_meshes_are_cached_by_topology(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = _quads()
    expected = subdivide(mesh, 2)
    monkeypatch.setattr(module, "_MIN_CACHED_TRIANGLES", 0)
    made = subdivide(mesh, 2)
    monkeypatch.setattr(
        module, "_compute_refinement", None
    )  # another shape of the same topology computes no weights
    wider = subdivide(replace(mesh, positions=2 * mesh.positions), 2)
    for one, scale in ((made, 1), (wider, 2)):
        np.testing.assert_array_equal(one.mesh.positions, scale * expected.mesh.positions)
        np.testing.assert_array_equal(one.mesh.triangles, expected.mesh.triangles)
        assert one.stencils is not None and expected.stencils is not None
        np.testing.assert_array_equal(one.stencils.weight, expected.stencils.weight)
