"""Report of `dermis profile`, as text, JSON, a profile file and a plot."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dermis.base.atomic_write import atomic_file
from dermis.base.extras import import_extra
from dermis.images.skin_tone import SKIN_CLASS_DISCLAIMER, SkinTone, skin_tone
from dermis.optics.diffusion.models import gaussian_transmittance
from dermis.optics.fits.burley import BurleyFit, fit_burley, unity_parameters, unreal_parameters
from dermis.optics.fits.gaussian import GaussianFit, fit_gaussians
from dermis.optics.fits.separable import SeparableFit, fit_separable
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dermis.optics.diffusion.models import ModelDeviation
    from dermis.optics.gaussians import GaussianSum
    from dermis.optics.media import Floats
    from dermis.optics.radial import RadialProfile
    from dermis.optics.tissue import Tissue


def _format_row(channel_values: Floats) -> str:
    """Return three numbers, for red, green and blue, as aligned text."""
    return " ".join(f"{value:7.4f}" for value in channel_values)


def _to_lists(nested_arrays: object) -> object:
    """Convert nested arrays to lists for JSON, and drop dictionary entries that are None."""
    if isinstance(nested_arrays, np.ndarray):
        return nested_arrays.tolist()
    if isinstance(nested_arrays, dict):
        return {key: _to_lists(item) for key, item in nested_arrays.items() if item is not None}
    if isinstance(nested_arrays, list | tuple):
        return [_to_lists(item) for item in nested_arrays]
    return nested_arrays


def gaussian_fit(
    radial_profile: RadialProfile,
    published_gaussians: GaussianSum | None,
    gaussian_count: int,
    *,
    shared_variances: bool,
    keep_energy: bool,
) -> GaussianFit:
    """Return the Gaussians fitted to a diffusion profile; if there are published Gaussians, return these.

    published_gaussians : Gaussians to return unchanged; None to fit the profile
    gaussian_count : number of Gaussians to fit
    shared_variances : whether all colour channels have the same variances
    keep_energy : whether the weights must sum to the total reflectance
    """
    if published_gaussians is not None:
        return GaussianFit(published_gaussians, np.zeros(3), np.zeros(3), "pointwise", shared=True)
    target = (
        radial_profile.point_target() if radial_profile.finite_at_centre else radial_profile.ring_target()
    )
    return fit_gaussians(
        target,
        gaussian_count,
        shared=shared_variances,
        keep_energy=keep_energy,
        profile_name=radial_profile.name,
    )


def additional_fit(radial_profile: RadialProfile, fit_kind: str) -> BurleyFit | SeparableFit | None:
    """Return the fit that --fit-kind requests in addition to Gaussians; None for "gaussian".

    fit_kind : "burley", "separable" or "gaussian"
    """
    if fit_kind == "burley":
        return fit_burley(radial_profile.ring_target())
    return fit_separable(radial_profile.ring_target()) if fit_kind == "separable" else None


@dataclass(frozen=True)
class ProfileReport:
    """Diffusion profile with its fits and their errors, as `dermis profile` prints them.

    radial : diffusion profile
    tissue : tissue that the profile describes; None for a table of Gaussians
    fit : fitted Gaussians and their error
    additional_fit : Burley or separable fit; None if not requested
    transmission_thicknesses_mm : thicknesses at which the transmitted colour is reported [mm]
    model_error : error of the diffusion model relative to Monte Carlo; None if this error is unknown
    spectrum : (31,) total reflectance at each wavelength; None for tissue given by RGB coefficients [-]
    """

    radial: RadialProfile
    tissue: Tissue | None
    fit: GaussianFit
    additional_fit: BurleyFit | SeparableFit | None
    transmission_thicknesses_mm: tuple[float, ...]
    model_error: ModelDeviation | None = None
    spectrum: Floats | None = None

    @property
    def ring_error(self) -> Floats:
        """Return the relative error (3,) of the fitted Gaussians for each colour channel [-].

        The fit and the profile are compared by the light that emerges in concentric rings around the point of
        entry.
        """
        return self.radial.ring_target().error(self.fit.profile.variance_mm2, self.fit.profile.weight)

    @property
    def tone(self) -> SkinTone | None:
        """Return the description of the colour of a skin given by its pigments; None for other media."""
        return None if self.spectrum is None else skin_tone(rgb_weights(WAVELENGTHS_NM) @ self.spectrum)

    def as_json(self) -> object:
        """Return the report as nested dictionaries and lists for JSON."""
        radial, gaussians, error = self.radial, self.fit.profile, self.model_error
        transmitted = self._transmitted_colours()
        return _to_lists(
            {
                "name": radial.name,
                "model": radial.model,
                **self._tissue_json(),
                "per": self._normalisation_text(),
                "radius_mm": radial.radius_mm,
                "reflectance_per_mm2": radial.reflectance,
                "standard_error_per_mm2": radial.standard_error,
                "total": radial.total,
                "total_standard_error": radial.total_error,
                "skin_tone": self.tone and self.tone.as_json(),
                "gaussians": {
                    "variances_mm2": gaussians.variance_mm2,
                    "weights": gaussians.weight,
                    "error": self.fit.error,
                    "error_kind": self.fit.kind,
                    "ring_error": self.ring_error,
                    "energy_error": self.fit.energy_error,
                    "shared": self.fit.shared,
                },
                "model_error": error
                and {"least": error.smallest, "most": error.largest, "tissues": error.tissues},
                **self._additional_fit_json(),
                "transmission": {"thickness_mm": self.transmission_thicknesses_mm, **transmitted}
                if transmitted
                else None,
                "warnings": radial.warnings,
                "notes": self.tissue.medium.notes if self.tissue else (),
                "sources": radial.sources,
            }
        )

    def lines(self) -> list[str]:
        """Return the report as lines of text."""
        radial, fit = self.radial, self.fit
        total = f"total      {_format_row(radial.total)}  {self._normalisation_text()}"
        lines = [f"{radial.name}, model {radial.model}", total]
        if self.tone is not None:
            lines += [f"tone       {self.tone.as_text()}", f"           ({SKIN_CLASS_DISCLAIMER})"]
        if self.tissue is not None and self.tissue.rgb is None:
            for layer in self.tissue.medium.layers:
                path = _format_row(layer.mean_free_path_mm)
                lines.append(f"path       {path}  mm, reduced mean free path in {layer.name}")
        lines += ["", "variance mm2     red   green    blue"]
        for variance, weight in zip(fit.profile.variance_mm2, fit.profile.weight, strict=True):
            lines.append(f"{variance:12.5g} {_format_row(weight)}")
        kind = "R(r)" if fit.kind == "pointwise" else "rings"
        lines.append(f"error      {_format_row(fit.error)}  of {kind}, relative")
        lines.append(f"energy     {_format_row(fit.energy_error)}  relative error of the total")
        lines += self._model_error_lines() + self._additional_fit_lines()
        for method, colours in self._transmitted_colours().items():
            for thickness, colour in zip(self.transmission_thicknesses_mm, colours, strict=True):
                lines.append(f"through    {_format_row(colour)}  {thickness:g} mm, by {method}")
        lines += [f"note: {note}" for note in (self.tissue.medium.notes if self.tissue else ())]
        return lines

    def _model_error_lines(self) -> list[str]:
        """Return lines with the error of the diffusion model relative to Monte Carlo; empty if unknown."""
        error = self.model_error
        if error is None:
            return []
        condition = "error against photons in rings, largest within a mean free path of r = 0"
        if len(error.tissues) == 1:
            return [f"model      {_format_row(error.largest)}  {condition}"]
        lines = [f"model      {_format_row(error.smallest)}  at least, {condition},"]
        return [*lines, f"           {_format_row(error.largest)}  at most, on {', '.join(error.tissues)}"]

    def _additional_fit_lines(self) -> list[str]:
        if self.additional_fit is None:
            return []
        if isinstance(self.additional_fit, BurleyFit):
            lines = [f"Burley     {_format_row(self.additional_fit.profile.shape)}  s [1/mm]"]
        else:
            kernel = self.additional_fit.kernel
            pairs = zip(kernel.variance_mm2, kernel.weight, strict=True)
            lines = [f"separable  {_format_row(v)}  mm2, weights {_format_row(w)}" for v, w in pairs]
        fit_error = (
            f"rings      {_format_row(self.additional_fit.error)}  its error in the light through rings"
        )
        return [*lines, fit_error, f"rings      {_format_row(self.ring_error)}  error of the Gaussians"]

    def save(self, path: Path) -> None:
        """Write the fitted Gaussians to a TOML file for `dermis render --profile`."""
        from dermis.optics.profiles import write_profile

        remarks: dict[str, object] = {"name": self.radial.name, "model": self.radial.model}
        if self.tissue is not None:
            medium = self.tissue.medium
            remarks |= {"eta": medium.eta, "layers": [layer.name for layer in medium.layers]}
            if self.tissue.parameters is not None:
                remarks |= asdict(self.tissue.parameters)
        remarks |= {"total": self.radial.total, "per": self._normalisation_text(), "error": self.fit.error}
        remarks |= {"error_kind": self.fit.kind, "energy_error": self.fit.energy_error}
        write_profile(path, self.fit.profile, remarks)

    def _normalisation_text(self) -> str:
        if self.radial.model == "table":
            return "as the table has it"
        is_incident = self.radial.incident
        return "of incident light, surface reflection apart" if is_incident else "of light that enters"

    def _tissue_json(self) -> dict[str, object]:
        if self.tissue is None:
            return {}
        medium, parameters = self.tissue.medium, self.tissue.parameters
        values: dict[str, object] = {
            "eta": medium.eta,
            "layers": [layer.name for layer in medium.layers],
            "thickness_mm": [layer.thickness_mm for layer in medium.layers],
            "mean_free_path_mm": [layer.mean_free_path_mm for layer in medium.layers],
            "absorption_per_mm": [layer.sigma_a for layer in medium.layers],
            "scattering_per_mm": [layer.sigma_s_prime for layer in medium.layers],
        }
        if parameters is not None:
            values |= {"skin": asdict(parameters), "wavelength_nm": WAVELENGTHS_NM}
            values["reflectance"] = self.spectrum
        return values

    def _additional_fit_json(self) -> dict[str, object]:
        if self.additional_fit is None:
            return {}
        values = asdict(self.additional_fit)
        if not isinstance(self.additional_fit, BurleyFit):
            return {"separable": values}
        engines = {
            f.__name__: asdict(f(self.additional_fit.profile)) for f in (unity_parameters, unreal_parameters)
        }
        return {"burley": values | engines}

    def _transmitted_colours(self) -> dict[str, Floats]:
        """Return a dictionary from the name of a method to the transmittances (n, 3) of n slabs [-].

        The slabs have the thicknesses `transmission_thicknesses_mm`. The methods are "gaussians" (computed
        from the fitted Gaussians) and "slab" (computed from the tissue, and absent if the tissue is not
        known).
        """
        if not self.transmission_thicknesses_mm:
            return {}
        gaussians = {"gaussians": gaussian_transmittance(self.fit.profile, self.transmission_thicknesses_mm)}
        tissue = self.tissue
        return gaussians | (
            {"slab": tissue.transmittance(self.transmission_thicknesses_mm)} if tissue else {}
        )


_CHANNEL_COLOURS = ("#c0392b", "#2e8b57", "#2a62b0")
_LEGEND_SETTINGS: dict[str, Any] = {"frameon": False, "loc": "lower left", "bbox_to_anchor": (0, 1)}
_LAYER_COLOURS = ("#b8860b", "#8e44ad", "#16808a", "#7f8c8d")
_MODEL_DASH_PATTERN = (0, (4, 3))
_CHANNEL_NAMES = ("red", "green", "blue")
_MIN_PLOTTED_FRACTION = 1e-5  # lowest plotted value, relative to the peak of r R(r); smaller values are noise
_DATELESS_METADATA: dict[str, dict[str, str | None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Metadata without dates, so that equal plots are equal files."""
_MAX_PLOTTED_RELATIVE_ERROR = 0.3  # relative standard error above which a point is not plotted


def draw_plot(path: Path, report: ProfileReport, monte_carlo_profile: RadialProfile | None) -> None:
    """Plot r R(r) of each colour channel: the model, its fits, and Monte Carlo results with error bars.

    path : file to write, .png, .svg or .pdf
    monte_carlo_profile : profile traced for comparison; None for no comparison
    """
    rc_context = import_extra("matplotlib", "plots").rc_context
    spectral = report.spectrum is not None
    size = (7.2, 7.8 if spectral else 5.2)
    figure = import_extra("matplotlib.figure", "plots").Figure(figsize=size, dpi=160, layout="constrained")
    axes, *lower = figure.subplots(1 + spectral, squeeze=False, height_ratios=[2, 1][: 1 + spectral])[:, 0]
    for panel in lower:
        _plot_spectra(panel, report)
    peak = _plot_curves(axes, report)
    if monte_carlo_profile is not None:
        peak = max(peak, _plot_photons(axes, monte_carlo_profile))
    axes.set(xscale="log", yscale="log", xlabel="r [mm]", ylabel="r R(r) [1/mm]")
    axes.set(xlim=(1e-3, 30.0), ylim=(_MIN_PLOTTED_FRACTION * peak, 2.0 * peak))
    axes.set_title(_plot_title(report), fontsize=10, loc="left")
    axes.grid(which="major", alpha=0.25, linewidth=0.6)
    _add_legend(figure, axes)
    buffer, file_format = BytesIO(), path.suffix.lower()[1:]
    with rc_context({"svg.hashsalt": "dermis"}):
        figure.savefig(buffer, format=file_format, metadata=_DATELESS_METADATA.get(file_format))
    with atomic_file(path) as temporary:  # matplotlib itself does not end cleanly on a full disk
        temporary.write_bytes(buffer.getvalue())


def _plot_spectra(axes: Axes, report: ProfileReport) -> None:
    """Plot total reflectance against wavelength, and the coefficients of the layers on a second axis."""
    assert report.tissue is not None and report.spectrum is not None
    axes.plot(WAVELENGTHS_NM, report.spectrum, color="black", linewidth=1.6, label="R")
    axes.set(xlim=(400, 700), ylim=(0, 1), xlabel="wavelength [nm]", ylabel="R, of incident light")
    right = axes.twinx()
    right.set(yscale="log", ylabel="µa, µs′ [1/mm]")
    for layer, colour in zip(report.tissue.medium.layers, _LAYER_COLOURS, strict=False):
        right.plot(WAVELENGTHS_NM, layer.sigma_a, color=colour, linewidth=1.0, label=f"µa, {layer.name}")
        dashed: dict[str, Any] = {"linestyle": _MODEL_DASH_PATTERN, "label": f"µs′, {layer.name}"}
        right.plot(WAVELENGTHS_NM, layer.sigma_s_prime, color=colour, linewidth=1.0, **dashed)
    lines = [*axes.get_lines(), *right.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines], ncols=5, fontsize=7, **_LEGEND_SETTINGS)


def _add_legend(figure: Figure, axes: Axes) -> None:
    """Add a legend below the plot, with one column per colour channel."""
    entries = zip(*axes.get_legend_handles_labels(), strict=True)
    by_channel = sorted(entries, key=lambda entry: _CHANNEL_NAMES.index(entry[1].partition(",")[0]))
    style: dict[str, Any] = {"loc": "outside lower center", "ncols": 3, "frameon": False, "fontsize": 8}
    figure.legend(*zip(*by_channel, strict=True), **style)


def _plot_curves(axes: Axes, report: ProfileReport) -> float:
    """Plot r R(r) of a diffusion profile and its fits for each colour channel; return the maximum [1/mm]."""
    radial, fit = report.radial, report.fit.profile
    r = radial.radius_mm
    fitted = fit.radiant_exitance(r)
    peak = float((r[:, None] * fitted).max())
    if radial.standard_error is not None:
        peak = max(peak, _plot_photons(axes, radial))
    for channel, (colour, name) in enumerate(zip(_CHANNEL_COLOURS, _CHANNEL_NAMES, strict=True)):
        if radial.standard_error is None:
            label = f"{name}, {radial.model}"
            axes.plot(r, r * radial.reflectance[:, channel], color=colour, linewidth=1.4, label=label)
            peak = max(peak, float((r * radial.reflectance[:, channel]).max()))
        terms = len(fit.weight) if report.fit.shared else np.count_nonzero(fit.weight[:, channel])
        label = f"{name}, {terms} Gaussians, error {report.fit.error[channel]:.2%}"
        axes.plot(
            r, r * fitted[:, channel], color=colour, linewidth=1.1, linestyle=_MODEL_DASH_PATTERN, label=label
        )
        if isinstance(report.additional_fit, BurleyFit):
            other = r * report.additional_fit.profile.radiant_exitance(r)[:, channel]
            label = f"{name}, Burley, error {report.additional_fit.error[channel]:.1%} of rings"
            axes.plot(r, other, color=colour, linewidth=1.0, linestyle=":", label=label)
    return peak


def _plot_photons(axes: Axes, monte_carlo_profile: RadialProfile) -> float:
    """Plot r R(r) of a Monte Carlo profile as points with error bars; return the maximum [1/mm]."""
    r, peak = monte_carlo_profile.radius_mm, 0.0
    error: Floats = (
        monte_carlo_profile.standard_error
        if monte_carlo_profile.standard_error is not None
        else np.zeros((len(r), 3))
    )
    for channel, colour in enumerate(_CHANNEL_COLOURS):
        R, se = monte_carlo_profile.reflectance[:, channel], error[:, channel]
        precise = (R > 0.0) & (se < _MAX_PLOTTED_RELATIVE_ERROR * np.abs(R)) & (r > 1e-3)
        peak = max(peak, float((r * R)[precise].max(initial=0.0)))
        label = f"{_CHANNEL_NAMES[channel]}, Monte Carlo"
        bars: dict[str, Any] = {"markersize": 2.2, "elinewidth": 0.8, "color": colour, "alpha": 0.7}
        axes.errorbar(r[precise], (r * R)[precise], (r * se)[precise], fmt="o", label=label, **bars)
    return peak


def _plot_title(report: ProfileReport) -> str:
    radial = report.radial
    total = ", ".join(f"{value:.3f}" for value in radial.total)
    eta = f", index {report.tissue.medium.eta:g}" if report.tissue is not None else ""
    return f"{radial.name}{eta}: total reflectance {total}"
