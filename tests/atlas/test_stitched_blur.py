"""Light blurred across seams: continuous on the stitched layout, compared with the mesh's own uv."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import twins
from atlas_reading import lit_at, read, seam_points, shown
from cut_meshes import cut_cylinder, cut_sphere, folded_sheet
from numpy.typing import NDArray
from scipy.special import eval_legendre
from tolerances import SEAM

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
VARIANCES = (0.567, 1.99, 7.41)  # [mm2] those of the widely used profile that are not finer than texels here


def blurred(atlas: Atlas, light: Floats) -> list[Floats]:
    """Return the blurred levels (n, n, 1) of light (n, n), with gutters filled before each blur."""
    metric = np.dstack([atlas.stretch, atlas.shear]).astype(np.float64)
    made, before = [np.dstack([light, light, light, atlas.coverage])], 0.0
    x, y = atlas.gutter.T
    for variance in VARIANCES:
        source = made[-1].copy()
        source[y, x] = read(source, atlas.source.astype(np.float64))
        along_u = twins.spread(source, metric, atlas.edge_distance, variance - before, before, 0)
        made.append(twins.spread(along_u, metric, atlas.edge_distance, variance - before, before, 1))
        before = variance
    return [level[..., :1] for level in made[1:]]


def lit(atlas: Atlas, mesh: Mesh, light: Callable[[Floats], Floats]) -> Floats:
    return np.where(atlas.lit_mask, light(np.nan_to_num(shown(atlas, mesh))), 0.0)


def stripes(points: Floats) -> Floats:
    """Return soft bands 10 mm wide that cross seams at all angles, with a contrast of 8 to 1."""
    return np.asarray(0.9 + 0.7 * np.sin(points @ np.array([0.6, 0.5, 0.62]) * np.pi / 10.0))


def jumps(mesh: Mesh, atlas: Atlas) -> Floats:
    """Return the relative change (levels, points) of the light across each seam."""
    one, other = seam_points(mesh)
    sides = [
        np.column_stack([lit_at(level, atlas, points) for points in (one, other)])
        for level in blurred(atlas, lit(atlas, mesh, stripes))
    ]
    return np.array([np.abs(a - b) / ((a + b) / 2) for a, b in (side.T for side in sides)])


@pytest.mark.parametrize(
    ("mesh", "size"),
    [(cut_sphere(30.0, 20), 320), (cut_cylinder(25.0, 60.0, 9), 256)],
    ids=["sphere", "cylinder"],
)
def test_no_jump_across_seams(mesh: Mesh, size: int) -> None:
    stitched = jumps(mesh, build_atlas(mesh, size, "stitched"))
    plain = jumps(mesh, build_atlas(mesh, size))
    assert np.percentile(stitched, 95, axis=1).max() < SEAM
    assert np.percentile(plain[-1], 90) > 0.2


def test_folded_halves_are_one_surface() -> None:
    mesh = folded_sheet(60.0, 6)
    jump = jumps(mesh, build_atlas(mesh, 200, "stitched"))
    assert jump.max() < SEAM


def test_blurs_near_seams_match_the_sphere() -> None:
    """Check that a zonal harmonic on a sphere keeps its shape and fades by exp(-l (l + 1) v / 2 r2)."""
    radius, degree = 30.0, 8
    mesh = cut_sphere(radius, 20)
    one, _ = seam_points(mesh)
    axis = np.array([0.48, 0.6, 0.64])

    def zonal(points: Floats) -> Floats:
        length = np.maximum(np.linalg.norm(points, axis=-1), 1e-9)
        return np.asarray(eval_legendre(degree, points @ axis / length))

    errors = {}
    for layout in ("stitched", "mesh"):
        atlas = build_atlas(mesh, 256, layout)
        level = blurred(atlas, lit(atlas, mesh, lambda points: 1.0 + 0.8 * zonal(points)))[-1]
        fade = np.exp(-degree * (degree + 1) * VARIANCES[-1] / (2 * radius**2))
        truth = 1.0 + 0.8 * fade * zonal(one.on(mesh.positions[mesh.triangles]))
        errors[layout] = np.abs(lit_at(level, atlas, one)[:, 0] - truth)
    assert np.percentile(errors["stitched"], 99) < 0.01
    assert np.percentile(errors["mesh"], 90) > 0.05
