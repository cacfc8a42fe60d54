"""Surface integral of a diffusion profile over irradiance: the reference for subsurface scattering."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.irradiance_samples import IrradianceSamples
from dermis.apps.truths.octree import Octree, build_octree
from dermis.apps.truths.radial_table import Profile, tabulate_profile
from dermis.base.errors import refuse

Floats = NDArray[np.float64]

_POINTS_PER_CALL = 1024  # between two checks for Ctrl-C
_OBSERVED_ERROR_PER_BOUND = 1e-3
"""Actual error of the integral where the error bound is 1, measured on waves, spheres, bumps and a scan. The
error of replacing a patch by three points is of third order in the size of the patch; its bound is of second
order."""
_CHANNEL_ERROR_WEIGHT = 50.0
"""Largest bound of errors due to different light in the channels, divided by the integral's relative error.
These errors are of second order, and cancel less than other errors."""


def integrate_exitance(
    points: ArrayLike, samples: IrradianceSamples, profile: Profile, relative_error: float = 1e-3
) -> Floats:
    """Return the radiant exitance (n, 3) at points x: the integral of R(|x - y|) E(y) dA over the surface.

    Irradiance is gathered from an octree. A node or triangle is replaced by three points if the error that
    this causes is below a limit, and is divided otherwise. The error is bounded by the remainder of Taylor's
    theorem. Because the errors of different nodes mostly cancel in the sum, the limit is not `relative_error`
    itself; it is computed from it by an empirical formula.

    points : (n, 3) positions x on the surface [mm]
    samples : irradiance E, linear on triangles that must be small enough for shadows and other details
    profile : profile R, a function of the Euclidean distance, so light also passes through ears
    relative_error : expected root mean square error of the integral divided by its mean, 1e-5 to 0.05 [-]

    Source: [JensenBuhler2002], but with Taylor's remainder as criterion in place of the solid angle.
    """
    positions = np.ascontiguousarray(points, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] != 3 or not np.isfinite(positions).all():
        refuse("points", "finite positions (n, 3) in mm", f"got {positions.shape}", "Correct them")
    if not 1e-5 <= relative_error <= 0.05:
        refuse(
            "error", "a relative error from 1e-5 to 0.05", f"got {relative_error}", "Take 0.001 for pictures"
        )
    from numba import config

    from dermis.apps.truths.octree_gather import gather_exitance

    bound = (relative_error / _OBSERVED_ERROR_PER_BOUND) ** (2 / 3)
    tree = _weight_error_bounds(build_octree(samples), bound / (_CHANNEL_ERROR_WEIGHT * relative_error))
    table = tabulate_profile(profile)
    exitance = np.zeros_like(positions)
    slices = [slice(i, i + _POINTS_PER_CALL) for i in range(0, len(positions), _POINTS_PER_CALL)]

    def gather_rows(rows: slice) -> None:
        gather_exitance(positions[rows], tree, table, bound, exitance[rows])

    # The compiled function releases the GIL, so threads run in parallel.
    pool = ThreadPoolExecutor(config.NUMBA_NUM_THREADS)
    try:
        for _ in pool.map(gather_rows, slices):
            pass
    finally:
        pool.shutdown(cancel_futures=True)
    return exitance


def _weight_error_bounds(octree: Octree, error_weight: float) -> Octree:
    """Return the octree with changed error bounds, in which errors that hardly cancel have more weight.

    In each channel, the centroid and the second moments of the light of a node differ from those of the three
    points that replace it. The errors due to these differences hardly cancel in the sum over nodes. Therefore
    the bound `centroid_error` is multiplied by a weight, and the bound `second_moment` is increased by
    `moment_error` times this weight.

    error_weight : weight of the differences of centroids and of second moments
    """
    second_moment = octree.second_moment + error_weight * octree.moment_error
    return octree._replace(second_moment=second_moment, centroid_error=error_weight * octree.centroid_error)
