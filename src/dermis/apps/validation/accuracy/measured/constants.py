"""Fits of the skin model's constants to measured spectra, and a skin model with additional constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dermis.apps.inverse.unmixing.spectral_inversion import (
    UNKNOWNS,
    Criterion,
    ParameterValues,
    SpectralFit,
    SpectralUnknown,
    invert_spectra,
)
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import (
    WAVELENGTHS_NM,
    baseline_absorption,
    blood_absorption,
    melanosome_absorption,
)
from dermis.optics.skin_spectra import two_layer_reflectance

FITTABLE_CONSTANTS = UNKNOWNS | {
    one.name: one
    for one in (
        SpectralUnknown("oxygen", -1.0, 2.0, 0.8),
        SpectralUnknown("baseline", 0.02, 4.0, 0.5, "log"),
        SpectralUnknown("dermis", 0.1, 2.0, 0.5, "log"),
        SpectralUnknown("small_fibres", 0.05, 4.0, 1.0, "log"),
        SpectralUnknown("vessel_mm", 1e-4, 0.2, 0.005, "log"),
        SpectralUnknown("bandwidth_nm", 0.0, 20.0, 5.0),
        SpectralUnknown("bilirubin", -0.2, 1.0, 0.0),
        SpectralUnknown("carotene", -0.2, 1.0, 0.0),
        SpectralUnknown("methaemoglobin", -0.2, 1.0, 0.0),
        SpectralUnknown("eumelanin", -0.5, 3.0, 0.7),
    )
}
"""Constants that may be fitted, and additions to the package's model.

dermis : scattering of the dermis, divided by the scattering of the epidermis
small_fibres : Rayleigh scattering, divided by the Rayleigh scattering in [DonnerJensen2006]
vessel_mm : mean path through a vessel; light does not reach its inside if blood absorbs strongly
bandwidth_nm : half width of the instrument's triangular band
bilirubin, carotene, methaemoglobin : absorption of the dermis at the peak of bands at 460, 480 and 630 nm
    [1/mm]
"""
_ABSORPTION_BANDS_NM = {
    "bilirubin": (460.0, 28.0),
    "carotene": (480.0, 20.0),
    "methaemoglobin": (630.0, 18.0),
}
_OUTER_ITERATION_COUNT = 6  # of the constants
_INNER_ITERATION_COUNT = 4  # of the unknowns of spectra, in each outer step
_DERIVATIVE_STEP = 0.02
_MIN_ERROR_REDUCTION = 1e-4
_NOTABLE_CORRELATION = 0.85


def extended_model(constants: Mapping[str, float]) -> ExtendedModel:
    """Return an extended model of skin with given values of some of `FITTABLE_CONSTANTS`, keyed by name."""
    return ExtendedModel(dict(constants))


@dataclass(frozen=True)
class ExtendedModel:
    """Spectral model of skin with more pigments and constants than the package's model.

    constants : values of some of `FITTABLE_CONSTANTS`; the others have default values
    """

    constants: dict[str, float]

    def __call__(self, parameter_values: ParameterValues) -> Floats:
        """Return the diffuse reflectances (n, 31) of skins.

        parameter_values : parameters of the skins by name
        """
        defaults = {"vessel_mm": 0.0, "bandwidth_nm": 0.0, "scattering": 1.0}

        def parameter_column(name: str) -> Floats:
            fallback = self.constants.get(name, defaults.get(name, FITTABLE_CONSTANTS[name].start))
            return np.asarray(parameter_values.get(name, np.float64(fallback)))[..., None]

        wavelength = WAVELENGTHS_NM
        bloodless = parameter_column("baseline") * baseline_absorption(wavelength)
        eu, oxygen = parameter_column("eumelanin"), parameter_column("oxygen")
        pigment = eu * melanosome_absorption(wavelength, 1.0) + (1.0 - eu) * melanosome_absorption(
            wavelength, 0.0
        )
        half_width = float(self.constants.get("bandwidth_nm", 0.0))
        vessels = oxygen * _blood_absorption_by_band(1.0, half_width) + (
            1.0 - oxygen
        ) * _blood_absorption_by_band(0.0, half_width)
        depth = np.maximum(vessels * parameter_column("vessel_mm"), 1e-9)
        vessels = vessels * -np.expm1(-depth) / depth
        m, b = parameter_column("melanin"), parameter_column("blood")
        dermis = b * vessels + (1.0 - b) * bloodless
        for name, (centre, width) in _ABSORPTION_BANDS_NM.items():
            dermis = dermis + self.constants.get(name, 0.0) * np.exp(
                -0.5 * ((wavelength - centre) / width) ** 2
            )
        fibres = self.constants.get("small_fibres", 1.0)
        scattering = parameter_column("scattering") * (
            14.74 * wavelength**-0.22 + fibres * 2.2e11 * wavelength**-4.0
        )
        return two_layer_reflectance(
            m * pigment + (1.0 - m) * bloodless,
            np.maximum(dermis, 1e-6),
            scattering,
            parameter_column("epidermis_mm"),
            self.constants.get("dermis", 0.5),
        )


def _blood_absorption_by_band(oxygen: float, half_width_nm: float) -> Floats:
    """Return the absorption (31,) of blood, averaged over triangular wavelength bands [1/mm].

    oxygen : fraction of haemoglobin that carries oxygen [-]
    half_width_nm : half of the width of each band
    """
    if half_width_nm < 0.5:
        return blood_absorption(WAVELENGTHS_NM, oxygen)
    offsets = np.linspace(-half_width_nm, half_width_nm, 21)
    weights = 1.0 - np.abs(offsets) / half_width_nm
    bands = blood_absorption(np.clip(WAVELENGTHS_NM[:, None] + offsets, 380.0, 780.0), oxygen)
    return np.asarray(bands @ (weights / weights.sum()))


@dataclass(frozen=True, eq=False)
class SharedConstantsFit:
    """Result of a fit of a skin model to spectra: shared constants, and values for each spectrum.

    constants : values of the constants that all spectra share, by name
    fit : fitted values of the unknowns, separate for each spectrum
    confounded : for each pair of constants with strongly correlated errors, both names and the correlation
    """

    constants: dict[str, float]
    fit: SpectralFit
    confounded: tuple[tuple[str, str, float], ...]


def fit_constants(
    spectra: Floats,
    unknowns: Sequence[str],
    free_constants: Sequence[str],
    criterion: Criterion = "spectrum",
    fixed_constants: Mapping[str, float] | None = None,
) -> SharedConstantsFit:
    """Fit constants shared by all spectra, and unknowns of each spectrum, by least squares.

    spectra : (n, 31) measured reflectance [-]
    unknowns : names of the parameters that are fitted to each spectrum separately
    free_constants : names of the `FITTABLE_CONSTANTS` that are fitted to all spectra together
    criterion : what the fit minimises: differences of the spectra ("spectrum") or of their colours ("colour")
    fixed_constants : values of constants that are not fitted, by name
    """
    separate = [UNKNOWNS[name] for name in unknowns]
    shared = [FITTABLE_CONSTANTS[name] for name in free_constants]
    z = np.array([one.scaled_value(dict(fixed_constants or {}).get(one.name, one.start)) for one in shared])

    def constants_from(scaled_values: Floats) -> dict[str, float]:
        values = {
            one.name: float(one.parameter_values(scaled_values[i : i + 1])[0]) for i, one in enumerate(shared)
        }
        return dict(fixed_constants or {}) | values

    def fit_unknowns(
        scaled_values: Floats, start_fit: SpectralFit | None, iteration_count: int
    ) -> tuple[SpectralFit, Floats]:
        model = extended_model(constants_from(scaled_values))
        first = None if start_fit is None else start_fit.values
        found = invert_spectra(spectra, model, separate, criterion, first, iteration_count)
        return found, found.weighted_residual(criterion).ravel()

    fit, r = fit_unknowns(z, None, 25)
    damping = 1e-2
    for _ in range(_OUTER_ITERATION_COUNT):
        columns = []
        for i in range(len(z)):
            moved = z.copy()
            moved[i] += _DERIVATIVE_STEP
            columns.append((fit_unknowns(moved, fit, _INNER_ITERATION_COUNT)[1] - r) / _DERIVATIVE_STEP)
        J = np.stack(columns, axis=-1)
        H, g = J.T @ J, -J.T @ r
        for _ in range(5):
            step = np.clip(np.linalg.solve(H + damping * np.diag(np.diag(H) + 1e-12), g), -0.7, 0.7)
            trial = np.clip(
                z + step,
                [one.scaled_value(one.low) for one in shared],
                [one.scaled_value(one.high) for one in shared],
            )
            trial_fit, trial_r = fit_unknowns(trial, fit, 2 * _INNER_ITERATION_COUNT)
            if trial_r @ trial_r < r @ r:
                break
            damping *= 8.0
        else:
            break
        gain = 1.0 - float(trial_r @ trial_r) / float(r @ r)
        z, fit, r, damping = trial, trial_fit, trial_r, 0.3 * damping
        if gain < _MIN_ERROR_REDUCTION:
            break
    return SharedConstantsFit(constants_from(z), fit, _confounded_pairs(free_constants, H))


def _confounded_pairs(
    constant_names: Sequence[str], normal_matrix: Floats
) -> tuple[tuple[str, str, float], ...]:
    covariance = np.linalg.inv(normal_matrix + 1e-12 * np.eye(len(normal_matrix)))
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    return tuple(
        (constant_names[a], constant_names[b], float(correlation[a, b]))
        for a in range(len(constant_names))
        for b in range(a)
        if abs(correlation[a, b]) > _NOTABLE_CORRELATION
    )
