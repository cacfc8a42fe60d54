"""Form factors between patches: rooms and balls from inside, and a convex body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dermis.atlas.interreflection import CELLS_PER_SIDE, SAMPLES_PER_PATCH, FormFactors, compute_form_factors
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, uv_sphere

pytestmark = pytest.mark.usefixtures("many_form_factor_lines")

OPPOSITE, BESIDE = 0.199825, 0.200044  # form factors of a cube's faces, in closed form
CLOSE = 0.01


def inside_out(mesh: Mesh) -> Mesh:
    """Return the same surface seen from inside."""
    return replace(mesh, normals=-mesh.normals, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))


def room() -> Mesh:
    """Return a cube of side 2 seen from inside, with faces in sixths of the uv square.

    Their order is -x, +x, -y, +y, -z, +z.
    """
    points, uv, triangles = [], [], []
    for face in range(6):
        axis, sign = face // 2, 2.0 * (face % 2) - 1.0
        square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
        at = np.insert(square, axis, sign, axis=1)
        turned = sign * (1 if axis != 1 else -1) > 0
        points.append(at)
        uv.append((0.5 + 0.5 * square) * [1 / 4, 1 / 2] + [(face % 4) / 4, face // 4 / 2])
        pair = np.array([[0, 1, 2], [0, 2, 3]])
        triangles.append(4 * face + (pair[:, ::-1] if turned else pair))
    made = np.concatenate(points), np.concatenate(uv), np.concatenate(triangles)
    return build_mesh(*made, np.zeros(12, int), SKIN_MATERIALS)


def found(mesh: Mesh) -> FormFactors:
    place = mesh.uv[mesh.triangles].astype(np.float32)
    return compute_form_factors(mesh, place, np.ones(len(mesh.triangles), bool))


def face_of(x: np.ndarray, y: np.ndarray, side: int) -> np.ndarray:
    return 4 * x // side + 4 * (2 * y // side)


def test_form_factors_between_faces_of_a_room() -> None:
    form_factors = found(room())
    given = np.zeros((6, 6))
    y, x = np.divmod(np.arange(CELLS_PER_SIDE * CELLS_PER_SIDE), CELLS_PER_SIDE)
    face = face_of(x, y, CELLS_PER_SIDE)
    held = face < 6
    patch = face[(y % 2 == 0) & (x % 2 == 0) & held]  # in the order of patches
    assert len(patch) == form_factors.patch_count
    row = np.repeat(
        np.arange(CELLS_PER_SIDE * CELLS_PER_SIDE), np.diff(form_factors.cell_first.astype(np.int64))
    )
    np.add.at(given, (face[row], patch[form_factors.cell_target]), form_factors.cell_factor)
    given /= np.bincount(face[held])[:, None]
    opposite = np.array([1, 0, 3, 2, 5, 4])
    expected = np.full((6, 6), BESIDE)
    expected[np.arange(6), np.arange(6)], expected[np.arange(6), opposite] = 0.0, OPPOSITE
    assert np.abs(given - expected).max() < CLOSE
    assert np.abs(given.sum(axis=1) - 1.0).max() < CLOSE


def test_parts_that_are_cut_out_do_not_block_light() -> None:
    mesh = room()
    card = Material("hair", "opaque", has_maps=True, opacity_cutoff=0.5)
    x, y, z = np.eye(3)
    corners = mesh.positions[mesh.triangles]
    across = np.stack([0.9 * (one - x) for one in (y + z, y - z, -y - z)])
    extended = build_mesh(
        np.concatenate([mesh.positions, across + x]),
        np.concatenate([mesh.uv, np.zeros((3, 2))]),
        np.concatenate([mesh.triangles, [[24, 25, 26]]]),
        np.append(np.zeros(len(corners), int), 1),
        (*SKIN_MATERIALS, card),
    )
    without, with_card = found(mesh), found(extended)
    solid = replace(extended, materials=(*SKIN_MATERIALS, replace(card, opacity_cutoff=0.0)))
    np.testing.assert_array_equal(without.cell_factor, with_card.cell_factor)
    assert len(found(solid).cell_factor) != len(without.cell_factor)


def test_sample_points_are_on_their_patch() -> None:
    mesh = room()
    form_factors = found(mesh)
    w = np.stack([form_factors.sample_weights & 0xFFFF, form_factors.sample_weights >> 16], axis=1) / 65535.0
    w = np.column_stack([1.0 - w.sum(axis=1), w])
    uv = np.einsum("nk,nkc->nc", w, mesh.uv[mesh.triangles[form_factors.sample_triangle]])
    patch = np.floor(
        CELLS_PER_SIDE // 2 * uv.reshape(-1, SAMPLES_PER_PATCH, 2)
        - 1e-4 * (uv.reshape(-1, SAMPLES_PER_PATCH, 2) == 1.0)
    )
    apart = np.abs(patch - np.median(patch, axis=1, keepdims=True))
    assert (apart.max(axis=(1, 2)) < 1.0).mean() > 0.99  # weights are rounded at a patch's edge


@pytest.mark.parametrize("outside", [True, False])
def test_only_the_inside_of_a_ball_faces_itself(outside: bool) -> None:
    ball = uv_sphere(10.0, 24, 12)
    form_factors = found(ball if outside else inside_out(ball))
    if outside:
        assert not len(form_factors.cell_factor)
    else:
        seen = np.bincount(
            np.repeat(
                np.arange(form_factors.patch_count), np.diff(form_factors.patch_first.astype(np.int64))
            ),
            form_factors.patch_factor,
            form_factors.patch_count,
        )
        assert np.abs(seen - 1.0).mean() < 1e-3 and np.abs(seen - 1.0).max() < 0.05  # lines through edges
