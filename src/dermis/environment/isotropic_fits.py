"""Least-squares fits of sums of isotropic lobes to specular lobes.

A table has an entry for each of several roughnesses and view angles. In each entry, five isotropic lobes
approximate the specular lobe. Each isotropic lobe has four parameters, which are fitted relative to the mean
direction and the standard deviations of the specular lobe.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dermis.environment.lobe_harmonics import (
    IsotropicLobes,
    LobeTarget,
    harmonic_terms,
    isotropic_sum_harmonics,
    lobe_target,
)
from dermis.environment.prefilter import MAX_LAYER_ROUGHNESS, MIN_LAYER_ROUGHNESS
from dermis.optics.fits.variable_projection import qr_factor
from dermis.specular.models import Lobe

Floats = NDArray[np.float64]
TableIndices = tuple[int, int]
ROUGHNESS_COUNT, VIEW_COUNT, LOBE_COUNT = 12, 16, 5
LOBE_TABLE_ROUGHNESSES = np.geomspace(0.05, 1.0, ROUGHNESS_COUNT)
"""Roughnesses of the rows of the table."""
LOBE_TABLE_COSINES = np.maximum(np.linspace(0.0, 1.0, VIEW_COUNT) ** 2, 0.02)
"""Cosines of the view angles, one for each column of the table, raised to at least 0.02."""
_IN_PLANE_LOBE_COUNTS = (3,) * 10 + (2,) * 3 + (1,) * 3
"""Number of lobes of the fit, not counting the pair of lobes, for each view angle.

These lobes are in the plane of incidence; see `fit_isotropic_lobes` for the pair.
"""
_MIN_LOBE_ELONGATION = 1.8  # ratio of length to width above which the pair lies in the plane
_FIT_PASS_COUNT = 2
_REGULARISATION_WEIGHT = 0.01  # strength of the pull of undetermined parameters to the mean of the neighbours
_MAX_FIT_EVALUATIONS = 30
_MAX_LOBE_OFFSET_SIGMAS = 5.0  # bound of positions [widths of the lobe] and of logarithms of weights
_PAIR_SEPARATION_SIGMAS = 0.4  # initial separation of a pair
_IN_PLANE_POSITION, _OUT_OF_PLANE_POSITION, _LOG_WIDTH, _LOG_WEIGHT = range(4)
_INITIAL_LOBES = np.array(
    [
        [-1.0, 1.0, -0.3, 0.3, 0.3],
        [0.0, 0.0, 0.0, 0.8, -0.8],
        [-0.3, -1.0, -0.5, -0.7, -0.7],
        [0.0] * LOBE_COUNT,
    ]
)


def fit_isotropic_lobes(lobe: Lobe) -> Floats:
    """Return a table (12, 16, 5, 4) of the five isotropic lobes that approximate a specular lobe.

    The axes of the table are roughness (LOBE_TABLE_ROUGHNESSES), view (LOBE_TABLE_COSINES), lobe, and
    parameter: angle from the normal away from the viewer [rad], angle from the plane of incidence [rad],
    roughness, weight.

    Three lobes are in the plane of incidence; for views near the normal, only one or two of these lobes have
    weight. The other two lobes form a pair. Where the specular lobe is elongated, both lobes of the pair are
    in the plane of incidence; elsewhere, they are mirror images on opposite sides of this plane.

    The fit minimises the expected difference between two reflections of a random environment: by the specular
    lobe, and by the sum of the isotropic lobes. Table entries are fitted one after another, from rough
    surfaces and grazing views to smooth surfaces and views along the normal. Each fit starts at the mean
    parameters of the adjacent entries that are already fitted. Lobes thus vary smoothly over the table.
    """
    found: dict[TableIndices, Floats] = {}
    cosines, roughnesses = LOBE_TABLE_COSINES.tolist(), LOBE_TABLE_ROUGHNESSES.tolist()
    targets = {(i, j): lobe_target(lobe, cosines[j], roughnesses[i]) for i, j in _table_entries()}
    for _ in range(_FIT_PASS_COUNT):
        for i, j in _table_entries():
            adjacent = (i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j)
            neighbours = [found[node] for node in adjacent if node in found]
            mean = np.mean(neighbours, axis=0) if neighbours else _INITIAL_LOBES
            found[i, j] = _fit_parameters(targets[i, j], j, found.get((i, j), mean), mean)
    table = np.empty((ROUGHNESS_COUNT, VIEW_COUNT, LOBE_COUNT, 4))
    for i, j in _table_entries():
        lobes = _to_isotropic_lobes(found[i, j], targets[i, j], _active_lobes(j))
        columns = [lobes.angle, lobes.out_of_plane, np.exp(lobes.log_roughness), lobes.weight]
        table[i, j] = np.stack(columns, axis=-1)
    return table


def _table_entries() -> Iterator[TableIndices]:
    return ((i, j) for i in reversed(range(ROUGHNESS_COUNT)) for j in range(VIEW_COUNT))


def _active_lobes(view_index: int) -> NDArray[np.bool_]:
    """Return the mask (5,) of the lobes whose weight is not 0 for a view.

    view_index : index of the view in LOBE_TABLE_COSINES
    """
    return np.array([k < _IN_PLANE_LOBE_COUNTS[view_index] or k >= LOBE_COUNT - 2 for k in range(LOBE_COUNT)])


def _parameter_direction(parameter_kind: int, *lobe_amounts: tuple[int, float]) -> Floats:
    """Return the direction (20,) in lobe parameter space that changes one parameter of one or more lobes.

    parameter_kind : index of the parameter that changes, such as `_IN_PLANE_POSITION`
    lobe_amounts : index of each lobe that changes, and the amount by which its parameter changes
    """
    change = np.zeros((4, LOBE_COUNT))
    for lobe, amount in lobe_amounts:
        change[parameter_kind, lobe] = amount
    return change.ravel()


def _free_directions(target_lobe: LobeTarget, view_index: int) -> Floats:
    """Return the k directions (20, k) in the space of all lobe parameters along which a fit may move.

    Directions for the lobes in the plane of incidence come first, then directions for the pair of lobes (see
    `fit_isotropic_lobes`). The two lobes of the pair either both stay in the plane, or remain mirror images
    of each other.

    target_lobe : specular lobe to which isotropic lobes are fitted
    view_index : index of the view in LOBE_TABLE_COSINES
    """
    left, right = (LOBE_COUNT - 2, 1.0), (LOBE_COUNT - 1, 1.0)
    if view_index == VIEW_COUNT - 1:  # at normal incidence the lobe is isotropic, and so is the fit
        groups, sizes = ([(0, 1.0)], [left, right]), (_LOG_WIDTH, _LOG_WEIGHT)
        return np.stack([_parameter_direction(kind, *group) for group in groups for kind in sizes], 1)
    kinds = _IN_PLANE_POSITION, _LOG_WIDTH, _LOG_WEIGHT
    in_plane = [
        _parameter_direction(kind, (k, 1.0))
        for k in range(_IN_PLANE_LOBE_COUNTS[view_index])
        for kind in kinds
    ]
    if _is_elongated(target_lobe):
        pair = [_parameter_direction(kind, one) for one in (left, right) for kind in kinds]
    else:
        pair = [_parameter_direction(kind, left, right) for kind in kinds]
        pair += [_parameter_direction(_OUT_OF_PLANE_POSITION, left, (LOBE_COUNT - 1, -1.0))]
    return np.stack([*in_plane, *pair], axis=1)


def _is_elongated(target_lobe: LobeTarget) -> bool:
    return target_lobe.along_deviation > _MIN_LOBE_ELONGATION * target_lobe.across_deviation


def _arrange_lobe_pair(initial_parameters: Floats, target_lobe: LobeTarget, view_index: int) -> Floats:
    """Return initial parameters (4, 5) of a fit, with the last two lobes ("the pair") placed as follows.

    If the specular lobe is elongated, both lobes of the pair are placed in the plane of incidence. Otherwise
    they are placed on opposite sides of this plane.

    initial_parameters : (4, 5) initial parameters; axes: kind of parameter, lobe
    target_lobe : specular lobe to which isotropic lobes are fitted
    view_index : index of the view in LOBE_TABLE_COSINES
    """
    lobes = initial_parameters.copy()
    separation = lobes[_IN_PLANE_POSITION, -1] - lobes[_IN_PLANE_POSITION, -2]
    if _is_elongated(target_lobe) and abs(separation) < _PAIR_SEPARATION_SIGMAS:
        lobes[_IN_PLANE_POSITION, -2:] = (
            lobes[_IN_PLANE_POSITION, -2:].mean() + np.array([-0.5, 0.5]) * _PAIR_SEPARATION_SIGMAS
        )
    if not _is_elongated(target_lobe) and abs(lobes[_OUT_OF_PLANE_POSITION, -2]) < _PAIR_SEPARATION_SIGMAS:
        lobes[_OUT_OF_PLANE_POSITION, -2:] = _PAIR_SEPARATION_SIGMAS, -_PAIR_SEPARATION_SIGMAS
    lobes[_OUT_OF_PLANE_POSITION, :-2] = 0.0
    if _is_elongated(target_lobe) or view_index == VIEW_COUNT - 1:
        lobes[_OUT_OF_PLANE_POSITION] = 0.0
    if view_index == VIEW_COUNT - 1:
        lobes[_IN_PLANE_POSITION] = 0.0
    return lobes


def _fit_parameters(
    target_lobe: LobeTarget, view_index: int, initial_parameters: Floats, neighbour_mean: Floats
) -> Floats:
    """Fit five isotropic lobes to a specular lobe and return their parameters (4, 5).

    The four parameters of a lobe are its position along the plane of incidence, its distance from this plane,
    the logarithm of its width, and the logarithm of its weight. The unit of lengths is the standard deviation
    of the specular lobe.

    target_lobe : specular lobe
    view_index : index of the view in LOBE_TABLE_COSINES
    initial_parameters : initial parameters (4, 5)
    neighbour_mean : mean parameters (4, 5) of adjacent table entries; regularisation pulls the fit towards
        this mean
    """
    from scipy.optimize import least_squares

    scale, active = harmonic_terms(target_lobe.degree)[2], _active_lobes(view_index)
    free = _free_directions(target_lobe, view_index)
    lengths = (free**2).sum(axis=0)
    initial_parameters, neighbour_mean = (
        _arrange_lobe_pair(one, target_lobe, view_index).ravel()
        for one in (initial_parameters, neighbour_mean)
    )
    first, mean = (free.T @ one / lengths for one in (initial_parameters, neighbour_mean))
    fixed = np.where(free.any(axis=1), 0.0, initial_parameters)
    kinds = np.abs(free).argmax(axis=0) // LOBE_COUNT
    low, high = _parameter_bounds(target_lobe, kinds)
    regularisation = _REGULARISATION_WEIGHT * np.where(kinds == _LOG_WEIGHT, 0.5, 1.0)

    @lru_cache(maxsize=2)
    def reduced_jacobian_and_residuals(parameter_bytes: bytes) -> Floats:
        """Return Jacobian and residuals of the fit side by side, reduced to as many rows as columns.

        A QR factorisation reduces the rows. The residuals are the last column.

        parameter_bytes : unknowns of the fit, as the bytes of a float64 array, because the cache cannot use
            an array as its key. There is one unknown for each direction that `_free_directions` returns
        """
        x = np.frombuffer(parameter_bytes)
        parameters = (fixed + free @ x).reshape(4, LOBE_COUNT)
        total, slopes = isotropic_sum_harmonics(
            _to_isotropic_lobes(parameters, target_lobe, active), target_lobe.degree
        )
        slopes[:, _IN_PLANE_POSITION] *= target_lobe.along_deviation
        slopes[:, _OUT_OF_PLANE_POSITION] *= target_lobe.across_deviation
        residuals = np.append((total - target_lobe.coefficients) * scale, regularisation * (x - mean))
        jacobian = np.einsum("nk,kj->nj", slopes.reshape(len(slopes), -1), free) * scale[:, None]
        system = np.column_stack([np.vstack([jacobian, np.diag(regularisation)]), residuals])
        return qr_factor(np.vstack([system.real, system.imag]))

    def residuals_at(free_parameters: Floats) -> Floats:
        return reduced_jacobian_and_residuals(free_parameters.tobytes())[:, -1]

    def jacobian_at(free_parameters: Floats) -> Floats:
        return reduced_jacobian_and_residuals(free_parameters.tobytes())[:, :-1]

    inside = np.clip(first, low + 1e-4, high - 1e-4)
    solution = least_squares(
        residuals_at, inside, jacobian_at, (low, high), ftol=1e-4, xtol=1e-5, max_nfev=_MAX_FIT_EVALUATIONS
    )
    return np.asarray(fixed + free @ solution.x).reshape(4, LOBE_COUNT)


def _parameter_bounds(target_lobe: LobeTarget, parameter_kinds: NDArray[np.intp]) -> tuple[Floats, Floats]:
    smoothest, roughest = np.log([MIN_LAYER_ROUGHNESS, MAX_LAYER_ROUGHNESS]) - np.log(
        target_lobe.across_deviation
    )
    low, high = (np.full(4, side * _MAX_LOBE_OFFSET_SIGMAS) for side in (-1.0, 1.0))
    low[_OUT_OF_PLANE_POSITION], high[_OUT_OF_PLANE_POSITION] = (
        0.0,
        min(_MAX_LOBE_OFFSET_SIGMAS, 0.45 * np.pi / target_lobe.across_deviation),
    )
    low[_LOG_WIDTH], high[_LOG_WIDTH] = smoothest, max(roughest, smoothest + 0.1)
    return low[parameter_kinds], high[parameter_kinds]


def _to_isotropic_lobes(
    parameters: Floats, target_lobe: LobeTarget, active_lobes: NDArray[np.bool_]
) -> IsotropicLobes:
    position, out_of_plane, log_width, log_weight = parameters
    weight = np.where(active_lobes, np.exp(log_weight - log_weight[active_lobes].max()), 0.0)
    return IsotropicLobes(
        target_lobe.mean_angle + position * target_lobe.along_deviation,
        out_of_plane * target_lobe.across_deviation,
        np.log(target_lobe.across_deviation) + log_width,
        weight / weight.sum(),
    )
