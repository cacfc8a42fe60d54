"""What a uv map does to a blur: blurred texels against heat on the surface that they lie on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.errors import refuse
from dermis.mesh.mesh import Mesh
from dermis.reference.refine import Floats, Index, Patch, refine_patch
from dermis.reference.surface_diffusion import STEPS, diffuse_on_surface, edge_for, margin_for, welded


@dataclass(frozen=True)
class MapError:
    """How far blurred texels lie from heat, for each level.

    relative_rmse : (k,) root mean square of the difference, in that of the heat [-]
    energy_ratio : (k,) light of the texels in that of the heat on the same texels [-]
    worst : (k,) largest difference, in the largest value of the heat [-]
    judged : (m,) texels that lie within the patch's radius
    heat : (k, j, c) the truth at these
    """

    relative_rmse: Floats
    energy_ratio: Floats
    worst: Floats
    judged: NDArray[np.bool_]
    heat: Floats


def patch_of(
    mesh: Mesh, centre_mm: ArrayLike, radius_mm: float, variances_mm2: Sequence[float] | Floats
) -> Patch:
    """The patch of a mesh, uv seams welded, on which levels of these variances can be judged.

    centre_mm, radius_mm : the ball to judge in; infinite for the whole mesh [mm]
    variances_mm2 : (k,) rising; the least that one adds sets the edges, the widest the margin [mm2]

    Short edges over a wide margin are costly: narrow and wide levels are cheaper on a patch for each.
    """
    edge_mm, margin_mm = edge_for(variances_mm2), margin_for(variances_mm2)
    return refine_patch(*welded(mesh), centre_mm, radius_mm, edge_mm, margin_mm)


def map_error(
    patch: Patch,
    irradiance: ArrayLike,
    variances_mm2: Sequence[float] | Floats,
    triangle: ArrayLike,
    barycentric: ArrayLike,
    blurred: ArrayLike,
    areas_mm2: ArrayLike | None = None,
    steps: int = STEPS,
) -> MapError:
    """The error of blurred texels; those beyond the patch's radius are left out.

    patch : fine enough for the variances, as `patch_of` makes it
    irradiance : (n, c) unblurred at the patch's vertices; `Patch.vertex_places` tells where to read a map
    variances_mm2 : (k,) rising [mm2]
    triangle, barycentric : (m,) and (m, 3) where each texel lies on the coarse surface
    blurred : (k, m, c) what the map's blur gives there, in the unit of `irradiance`
    areas_mm2 : (m,) surface that each texel stands for; all alike when None [mm2]
    steps : of time for each level

    Raises DermisError when the arrays do not fit each other, or no texel can be judged.
    """
    texels = np.asarray(triangle, np.int64), np.asarray(barycentric, np.float64)
    seen = np.asarray(blurred, np.float64)
    areas = np.ones(len(texels[0])) if areas_mm2 is None else np.asarray(areas_mm2, np.float64)
    _check_texels(*texels, seen, areas, len(variances_mm2))
    fine, weights = patch.find(*texels)
    judged = fine >= 0
    places = patch.interpolate(patch.positions, fine[judged], weights[judged])
    judged[judged] = patch.holds(places)
    if not judged.any():
        came = f"none of {len(judged)} lies within {patch.radius_mm:g} mm of {patch.centre_mm.tolist()}"
        refuse("map error", "texels on the patch", came, "Move the patch or give other texels")
    levels = diffuse_on_surface(patch.positions, patch.triangles, irradiance, variances_mm2, steps)
    heat = patch.interpolate(levels, fine[judged], weights[judged])
    return _compare(seen[:, judged], heat, areas[judged], judged)


def _check_texels(triangle: Index, barycentric: Floats, blurred: Floats, areas: Floats, levels: int) -> None:
    count = len(triangle)
    shapes = triangle.shape, barycentric.shape, blurred.shape[:2], areas.shape
    if shapes != ((count,), (count, 3), (levels, count), (count,)) or blurred.ndim != 3:
        came = f"triangles {shapes[0]}, weights {shapes[1]}, values {blurred.shape}, areas {shapes[3]} came"
        refuse("map error", f"texels (m,), (m, 3), ({levels}, m, c) and (m,)", came, "Correct the arrays")


def _compare(blurred: Floats, heat: Floats, areas: Floats, judged: NDArray[np.bool_]) -> MapError:
    difference = blurred - heat
    surface = areas[:, None]

    def over_surface(values: Floats) -> Floats:
        """Sum over texels and channels, each texel by its area, (k,)."""
        summed: Floats = (values * surface).sum(axis=(1, 2))
        return summed

    return MapError(
        relative_rmse=np.sqrt(over_surface(difference**2) / over_surface(heat**2)),
        energy_ratio=over_surface(blurred) / over_surface(heat),
        worst=np.abs(difference).max(axis=(1, 2)) / np.abs(heat).max(axis=(1, 2)),
        judged=judged,
        heat=heat,
    )
