"""The light that a diffusion profile brings to points, integrated over the surface: a profile's truth."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.irradiance_samples import IrradianceSamples, MeshPoints, sample_irradiance
from dermis.apps.truths.octree import Octree, build_octree
from dermis.apps.truths.radial_table import GaussianSum, Profile, RadialTable, tabulate_profile
from dermis.base.errors import refuse

__all__ = ["GaussianSum", "IrradianceSamples", "SurfacePoints", "RadialTable", "integrate_exitance", "sample_irradiance"]

Floats = NDArray[np.float64]

_POINTS_PER_CALL = 1024  # points between two checks for Ctrl-C
_ERROR_AT_UNIT_BOUND = 1e-3
"""Error at a bound of 1, by quadrature of waves, spheres, bumps and the scan. The remainders that three
points leave are of third order in the size of a patch, their bound of second."""
_UNCANCELLED_FACTOR = 50.0
"""Where channels are lit differently, the remainders are of second order and cancel less well."""


def integrate_exitance(points: ArrayLike, samples: IrradianceSamples, profile: Profile, error: float = 1e-3) -> Floats:
    """Return radiant exitance (n, 3), the integral of R(|x - y|) E(y) dA over the surface.

    points : (n, 3) x, on the surface [mm]
    samples : E, linear on small triangles; whether they are fine enough for the light is up to the caller
    profile : R, by straight-line distance, through thin parts too
    error : expected root mean square error of the integral, relative to its mean; 1e-5 to 0.05 [-]

    A node of the octree, a triangle or a part of one is replaced by three points if Taylor's remainder stays
    under its share of a bound, and is opened or cut otherwise, so the profile's steep middle is integrated as
    finely as it needs. The bound would be exact if no errors cancelled; nearly all do, so the bound that goes
    with `error` comes from measurement.

    Source: [JensenBuhler2002], with the remainder in place of the solid angle.
    """
    places = np.ascontiguousarray(points, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        refuse("points", "finite positions (n, 3) in mm", f"{places.shape} came", "Correct them")
    if not 1e-5 <= error <= 0.05:
        refuse("error", "a share from 1e-5 to 0.05", f"{error} came", "0.001 is enough for pictures")
    return _gather_in_threads(places, samples, profile, error)


def _gather_in_threads(places: Floats, samples: IrradianceSamples, profile: Profile, error: float) -> Floats:
    from numba import config

    from dermis.apps.truths.octree_gather import gather_exitance

    bound = (error / _ERROR_AT_UNIT_BOUND) ** (2 / 3)
    tree, table = _weighted_bounds(build_octree(samples), bound / (_UNCANCELLED_FACTOR * error)), tabulate_profile(profile)
    exitance = np.zeros_like(places)
    parts = [slice(i, i + _POINTS_PER_CALL) for i in range(0, len(places), _POINTS_PER_CALL)]

    def fill(part: slice) -> None:
        gather_exitance(places[part], tree, table, bound, exitance[part])

    # The compiled loop releases the GIL, so threads share the work.
    pool = ThreadPoolExecutor(config.NUMBA_NUM_THREADS)
    try:
        for _ in pool.map(fill, parts):
            pass
    finally:
        pool.shutdown(cancel_futures=True)
    return exitance


def _weighted_bounds(tree: Octree, strictness: float) -> Octree:
    """Return the tree with the errors that do not cancel multiplied by `strictness`."""
    return tree._replace(spread=tree.spread + strictness * tree.mismatch, offset=strictness * tree.offset)
