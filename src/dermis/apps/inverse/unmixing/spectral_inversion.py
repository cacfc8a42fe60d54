"""Inversion of spectral models of skin: from reflectance spectra, or their colours, to skin parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dermis.images.colour import delta_e_2000, lab
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.pigments.spectra import rgb_weights
from dermis.optics.skin_spectra import skin_reflectance

Criterion = Literal["spectrum", "colour"]
"""What a fit minimises: the RMS difference of the spectra, or the colour difference under D65."""
ParameterValues = Mapping[str, Floats]
SpectralModel = Callable[[ParameterValues], Floats]
"""Function from the parameters (n,) by name to diffuse reflectances (n, 31) at `WAVELENGTHS_NM`."""
SPECULAR_INCLUDED_REFLECTANCE = 0.0278
"""Reflectance of the smooth surface of skin, which spectrophotometers include [-]."""
_DERIVATIVE_STEP = 1e-4  # of finite differences
_MAX_STEPS = 30
_MIN_RELATIVE_DECREASE, _MIN_ABSOLUTE_DECREASE = (
    1e-3,
    1e-10,
)  # least decrease of the sum of squares: relative, and absolute
_MIN_CURVATURE = 1e-10


@dataclass(frozen=True)
class SpectralUnknown:
    """Parameter of a spectral model that a fit varies.

    name : name of the parameter
    low, high : smallest and largest value
    start : value from which a fit starts
    scale : function of the parameter that the fit varies, here called the scaled value: the square root
        ("root"), the logarithm ("log"), or the value itself ("linear")
    """

    name: str
    low: float
    high: float
    start: float
    scale: Literal["root", "log", "linear"] = "linear"

    def scaled_values(self, parameter_values: Floats | np.float64) -> Floats:
        """Convert parameter values to scaled values: square roots, logarithms, or the values themselves.

        The field `scale` decides which of the three.
        """
        if self.scale == "log":
            return np.asarray(np.log(parameter_values))
        return np.asarray(np.sqrt(parameter_values) if self.scale == "root" else parameter_values)

    def scaled_value(self, parameter_value: float) -> float:
        """Convert one parameter value to its scaled value, which is what a fit varies, see `scale`."""
        return float(self.scaled_values(np.float64(parameter_value)))

    def parameter_values(self, scaled_values: Floats) -> Floats:
        """Convert scaled values (n,), see `scale`, back to parameter values (n,)."""
        if self.scale == "log":
            return np.exp(scaled_values)
        return np.asarray(scaled_values**2 if self.scale == "root" else scaled_values)


UNKNOWNS = {
    one.name: one
    for one in (
        SpectralUnknown("melanin", 0.0, 1.0, 0.05, "root"),
        SpectralUnknown("blood", 0.0, 0.4, 0.01, "root"),
        SpectralUnknown("oxygen", 0.0, 1.0, 0.75),
        SpectralUnknown("scattering", 0.1, 6.0, 1.0, "log"),
        SpectralUnknown("epidermis_mm", 0.015, 0.5, 0.06, "log"),
        SpectralUnknown("eumelanin", 0.0, 1.0, 0.7),
    )
}
"""Parameters of the package's skin that a fit may vary; scattering is relative to [DonnerJensen2006]."""
PIGMENT_UNKNOWNS = ("melanin", "blood")
PIGMENT_AND_OXYGEN_UNKNOWNS = (*PIGMENT_UNKNOWNS, "oxygen")
TISSUE_UNKNOWNS = (*PIGMENT_AND_OXYGEN_UNKNOWNS, "scattering", "epidermis_mm")


@dataclass(frozen=True, eq=False)
class SpectralFit:
    """Parameters of n skins, fitted to their spectra or colours.

    values : dictionary from parameter name to fitted values (n,)
    measured : (n, 31) measured diffuse reflectance, without surface reflection [-]
    model : (n, 31) diffuse reflectance of the model for the fitted values [-]
    """

    values: dict[str, Floats]
    measured: Floats
    model: Floats

    @property
    def residual(self) -> Floats:
        """Return the measured reflectance minus that of the model, (n, 31) [-]."""
        return self.measured - self.model

    @property
    def rms_residual(self) -> Floats:
        """Return for each skin the root mean square (n,) of the residual over all wavelengths [-]."""
        return np.asarray(np.sqrt((self.residual**2).mean(axis=1)))

    def weighted_residual(self, criterion: Criterion) -> Floats:
        """Return the residuals for a criterion: differences of reflectance (n, 31) or CIEDE2000 (n, 1)."""
        return self.residual if criterion == "spectrum" else self.delta_e()[:, None]

    def delta_e(self, colour_weights: Floats | None = None) -> Floats:
        """Return the CIEDE2000 difference (n,) between the model's colour and the measured colour.

        colour_weights : (3, 31) weights that convert spectra to linear Rec. 709; by default, the weights for
            the illuminant D65
        """
        w = rgb_weights() if colour_weights is None else colour_weights
        return delta_e_2000(self.model @ w.T, self.measured @ w.T)


def skin_model_spectra(skin: SkinParameters = DEFAULT_SKIN) -> SpectralModel:
    """Return the package's spectral model of skin: a function from parameters to reflectance spectra.

    skin : parameters that are used where a call of the model omits them
    """

    def reflectance(parameter_values: ParameterValues) -> Floats:
        def parameter_value(parameter_name: str) -> Floats:
            return np.asarray(parameter_values.get(parameter_name, getattr(skin, parameter_name)))

        return skin_reflectance(
            parameter_value("melanin"),
            parameter_value("blood"),
            oxygen=parameter_value("oxygen"),
            eumelanin_fraction=parameter_value("eumelanin"),
            epidermis_mm=parameter_value("epidermis_mm"),
            baseline=parameter_value("baseline"),
            scattering=parameter_values.get("scattering", np.float64(1.0)),
        )

    return reflectance


def invert_spectra(
    spectra: Floats,
    model: SpectralModel,
    unknowns: Sequence[SpectralUnknown],
    criterion: Criterion = "spectrum",
    start: ParameterValues | None = None,
    max_steps: int = _MAX_STEPS,
) -> SpectralFit:
    """Fit the unknowns of a model to each of n spectra by damped least squares.

    spectra : (n, 31) diffuse reflectance at `WAVELENGTHS_NM`, without surface reflection [-]
    model : function from parameters to spectra
    unknowns : parameters that vary; the model supplies all others
    criterion : "spectrum" minimises the RMS difference of the spectra; "colour" minimises the difference of
        their colours under D65, in a space where small distances equal CIEDE2000 differences
    start : dictionary from parameter name to the values (n,) from which the fit starts; by default, the field
        `start` of each unknown
    max_steps : largest number of steps
    """
    first = {} if start is None else start
    columns = (one.scaled_values(first.get(one.name, np.array(one.start))) for one in unknowns)
    x = np.stack([np.broadcast_to(column, len(spectra)) for column in columns], axis=-1)
    low, high = (
        np.array([one.scaled_value(getattr(one, end)) for one in unknowns]) for end in ("low", "high")
    )

    def parameter_values_at(scaled_values: Floats) -> dict[str, Floats]:
        return {one.name: one.parameter_values(scaled_values[:, i]) for i, one in enumerate(unknowns)}

    weights = rgb_weights()
    target = lab(spectra @ weights.T)
    metric = colour_metric(target)

    def residual(scaled_values: Floats) -> Floats:
        reflectance = model(parameter_values_at(scaled_values))
        if criterion == "spectrum":
            return np.asarray(reflectance - spectra)
        return np.asarray(np.einsum("nij,nj->ni", metric, lab(reflectance @ weights.T) - target))

    found = parameter_values_at(least_squares(residual, x, low, high, max_steps))
    return SpectralFit(found, spectra, model(found))


def fit_skin(
    spectra: Floats,
    unknown_names: Sequence[str] = PIGMENT_UNKNOWNS,
    criterion: Criterion = "spectrum",
    skin: SkinParameters = DEFAULT_SKIN,
) -> SpectralFit:
    """Fit parameters of the package's skin model to each of n spectra, as `invert_spectra` does.

    unknown_names : names in `UNKNOWNS` of the parameters that vary
    skin : values of the parameters that do not vary
    """
    return invert_spectra(
        spectra, skin_model_spectra(skin), [UNKNOWNS[name] for name in unknown_names], criterion
    )


def least_squares(
    residual_function: Callable[[Floats], Floats],
    start_unknowns: Floats,
    lower_limits: Floats,
    upper_limits: Floats,
    max_steps: int = _MAX_STEPS,
) -> Floats:
    """Solve n independent least-squares problems at once; return the unknowns (n, u).

    Gauss-Newton steps with Levenberg's damping are used.

    residual_function : function from the unknowns (n, u) to the residuals (n, r)
    start_unknowns : (n, u) unknowns from which the search starts
    lower_limits, upper_limits : (u,) limits of the unknowns; an unknown at a limit stays fixed if the step
        would cross the limit
    """
    count = start_unknowns.shape[1]
    damping = np.full(len(start_unknowns), 1e-2)
    r = residual_function(start_unknowns)
    cost = (r**2).sum(axis=1)
    for step_number in range(max_steps):
        J = _derivatives(residual_function, start_unknowns, r, upper_limits)
        H = np.einsum("nri,nrj->nij", J, J)
        g = -np.einsum("nri,nr->ni", J, r)
        H += (damping[:, None] * np.einsum("nii->ni", H) + _MIN_CURVATURE)[:, :, None] * np.eye(count)
        step = np.linalg.solve(H, g[..., None])[..., 0]
        fixed = ((start_unknowns <= lower_limits) & (step < 0.0)) | (
            (start_unknowns >= upper_limits) & (step > 0.0)
        )
        H = np.where(fixed[:, :, None] | fixed[:, None, :], np.eye(count), H)
        step = np.linalg.solve(H, np.where(fixed, 0.0, g)[..., None])[..., 0]
        trial = np.clip(start_unknowns + step, lower_limits, upper_limits)
        trial_r = residual_function(trial)
        trial_cost = (trial_r**2).sum(axis=1)
        better = trial_cost <= cost
        gain = np.where(better, cost - trial_cost, 0.0)
        start_unknowns, r = (
            np.where(better[:, None], trial, start_unknowns),
            np.where(better[:, None], trial_r, r),
        )
        cost = np.where(better, trial_cost, cost)
        damping = np.clip(np.where(better, 0.2 * damping, 6.0 * damping), 1e-7, 1e6)
        if step_number > 4 and (gain <= _MIN_RELATIVE_DECREASE * cost + _MIN_ABSOLUTE_DECREASE).all():
            break
    return start_unknowns


def _derivatives(
    residual_function: Callable[[Floats], Floats], unknowns: Floats, residuals: Floats, upper_limits: Floats
) -> Floats:
    """Return the derivatives (n, r, u) of the residuals of n problems with respect to their u unknowns.

    They are one-sided finite differences: an unknown is increased, or decreased if it is at its upper limit.

    residual_function : function from the unknowns (n, u) to the residuals (n, r)
    unknowns : (n, u) unknowns
    residuals : (n, r) residuals for these unknowns
    upper_limits : (u,) largest values of the unknowns
    """
    columns = []
    for i in range(unknowns.shape[1]):
        step = np.where(
            unknowns[:, i] + _DERIVATIVE_STEP > upper_limits[i], -_DERIVATIVE_STEP, _DERIVATIVE_STEP
        )
        moved = unknowns.copy()
        moved[:, i] += step
        columns.append((residual_function(moved) - residuals) / step[:, None])
    return np.stack(columns, axis=-1)


def colour_metric(lab_colours: Floats) -> Floats:
    """Return matrices (n, 3, 3) that convert small L*a*b* differences to a space with CIEDE2000 distances.

    The length of a converted difference is the CIEDE2000 difference, without the rotation term, which only
    matters for blue colours.

    lab_colours : (n, 3) L*a*b* of the colours

    Source: [Sharma2005].
    """
    L, a, b = lab_colours.T
    chroma = np.hypot(a, b) ** 7
    stretch = 1.5 - 0.5 * np.sqrt(chroma / (chroma + 25.0**7))
    C, hue = np.hypot(stretch * a, b), np.arctan2(b, stretch * a)
    terms = ((-0.17, 1.0, -30.0), (0.24, 2.0, 0.0), (0.32, 3.0, 6.0), (-0.20, 4.0, -63.0))
    weight = 1.0 + sum(k * np.cos(n * hue + np.radians(shift)) for k, n, shift in terms)
    metric = np.zeros((len(lab_colours), 3, 3))
    metric[:, 0, 0] = 1.0 / (1.0 + 0.015 * (L - 50.0) ** 2 / np.sqrt(20.0 + (L - 50.0) ** 2))
    radial, across = 1.0 / (1.0 + 0.045 * C), 1.0 / (1.0 + 0.015 * C * weight)
    metric[:, 1, 1], metric[:, 1, 2] = radial * np.cos(hue) * stretch, radial * np.sin(hue)
    metric[:, 2, 1], metric[:, 2, 2] = -across * np.sin(hue) * stretch, across * np.cos(hue)
    return metric
