"""Report of `dermis profile`: as lines, as JSON, as a file for the renderer, and as a figure."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dermis.base.atomic_write import replacing
from dermis.base.extras import needed
from dermis.optics.diffusion.models import through_gaussians
from dermis.optics.fits.burley import BurleyFit, fit_burley, unity_parameters, unreal_parameters
from dermis.optics.fits.gaussian import GaussianFit, fit_gaussians
from dermis.optics.fits.separable import SeparableFit, fit_separable
from dermis.optics.pigments.spectra import WAVELENGTHS_NM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dermis.optics.diffusion.models import ModelError
    from dermis.optics.gaussians import GaussianSum
    from dermis.optics.media import Floats
    from dermis.optics.radial import RadialProfile
    from dermis.optics.tissue import Tissue


def _row(values: Floats) -> str:
    """Return three numbers of a report as text."""
    return " ".join(f"{value:7.4f}" for value in values)


def _to_lists(value: object) -> object:
    """Return arrays as lists, and tables without what is None."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _to_lists(one) for key, one in value.items() if one is not None}
    if isinstance(value, list | tuple):
        return [_to_lists(one) for one in value]
    return value


def gaussian_fit(
    radial: RadialProfile, table: GaussianSum | None, terms: int, *, shared: bool, keep_energy: bool
) -> GaussianFit:
    """Return the Gaussians of a profile; a table is its own fit."""
    if table is not None:
        return GaussianFit(table, np.zeros(3), np.zeros(3), "pointwise", shared=True)
    target = radial.points() if radial.finite else radial.rings()
    return fit_gaussians(target, terms, shared=shared, keep_energy=keep_energy, name=radial.name)


def other_fit(radial: RadialProfile, kind: str) -> BurleyFit | SeparableFit | None:
    """Return a fit of another kind than Gaussians, "burley" or "separable"."""
    if kind == "burley":
        return fit_burley(radial.rings())
    return fit_separable(radial.rings()) if kind == "separable" else None


@dataclass(frozen=True)
class Report:
    """A profile with its fits.

    radial : the profile
    tissue : what it belongs to, None for a table of Gaussians
    fit : Gaussians and their error
    other : a fit of another kind
    through_mm : thicknesses that light is to come through [mm]
    model_error : of the model against photons, None where it is not known
    spectrum : (31,) total reflectance by wavelength, None for colours [-]
    """

    radial: RadialProfile
    tissue: Tissue | None
    fit: GaussianFit
    other: BurleyFit | SeparableFit | None
    through_mm: tuple[float, ...]
    model_error: ModelError | None = None
    spectrum: Floats | None = None

    @property
    def ring_error(self) -> Floats:
        """Error of the Gaussians in the light through rings, (3,), to compare all kinds of fit by [-]."""
        return self.radial.rings().error(self.fit.profile.variance_mm2, self.fit.profile.weight)

    def as_json(self) -> object:
        """Return everything, in plain lists."""
        radial, sum_, ways = self.radial, self.fit.profile, self._through()
        return _to_lists(
            {
                "name": radial.name,
                "model": radial.model,
                **self._tissue_json(),
                "per": self._per(),
                "radius_mm": radial.radius_mm,
                "reflectance_per_mm2": radial.reflectance,
                "standard_error_per_mm2": radial.standard_error,
                "total": radial.total,
                "total_standard_error": radial.total_error,
                "gaussians": {
                    "variances_mm2": sum_.variance_mm2,
                    "weights": sum_.weight,
                    "error": self.fit.error,
                    "error_kind": self.fit.kind,
                    "ring_error": self.ring_error,
                    "energy_error": self.fit.energy_error,
                    "shared": self.fit.shared,
                },
                "model_error": asdict(self.model_error) if self.model_error else None,
                **self._other_json(),
                "transmission": {"thickness_mm": self.through_mm, **ways} if ways else None,
                "warnings": radial.warnings,
                "notes": self.tissue.medium.notes if self.tissue else (),
                "sources": radial.sources,
            }
        )

    def lines(self) -> list[str]:
        """Return the report to read."""
        radial, fit = self.radial, self.fit
        lines = [f"{radial.name}, model {radial.model}", f"total      {_row(radial.total)}  {self._per()}"]
        if self.tissue is not None and self.tissue.rgb is None:
            for layer in self.tissue.medium.layers:
                path = _row(layer.mean_free_path_mm)
                lines.append(f"path       {path}  mm, reduced mean free path in {layer.name}")
        lines += ["", "variance mm2     red   green    blue"]
        for variance, weight in zip(fit.profile.variance_mm2, fit.profile.weight, strict=True):
            lines.append(f"{variance:12.5g} {_row(weight)}")
        kind = "R(r)" if fit.kind == "pointwise" else "rings"
        lines.append(f"error      {_row(fit.error)}  of {kind}, relative")
        lines.append(f"energy     {_row(fit.energy_error)}  too much or too little, relative")
        lines += self._model_lines() + self._other_lines()
        for way, colours in self._through().items():
            for thickness, colour in zip(self.through_mm, colours, strict=True):
                lines.append(f"through    {_row(colour)}  {thickness:g} mm, by its {way}")
        lines += [f"note: {note}" for note in (self.tissue.medium.notes if self.tissue else ())]
        return lines

    def _model_lines(self) -> list[str]:
        """Return the error of the model itself, which no fit corrects."""
        error = self.model_error
        if error is None:
            return []
        where = "against photons, in rings, most within a mean free path of r = 0"
        if len(error.tissues) == 1:
            return [f"model      {_row(error.most)}  {where}"]
        lines = [f"model      {_row(error.least)}  at least, {where},"]
        return [*lines, f"           {_row(error.most)}  at most, on {', '.join(error.tissues)}"]

    def _other_lines(self) -> list[str]:
        if self.other is None:
            return []
        if isinstance(self.other, BurleyFit):
            lines = [f"Burley     {_row(self.other.profile.shape)}  s [1/mm]"]
        else:
            kernel = self.other.kernel
            pairs = zip(kernel.variance_mm2, kernel.weight, strict=True)
            lines = [f"separable  {_row(v)}  mm2, weights {_row(w)}" for v, w in pairs]
        mine = f"rings      {_row(self.other.error)}  its error in the light through rings"
        return [*lines, mine, f"rings      {_row(self.ring_error)}  the Gaussians'"]

    def save(self, path: Path) -> None:
        """Write the Gaussians for the renderer."""
        from dermis.optics.profiles import write_profile

        remarks: dict[str, object] = {"name": self.radial.name, "model": self.radial.model}
        if self.tissue is not None:
            medium = self.tissue.medium
            remarks |= {"eta": medium.eta, "layers": [layer.name for layer in medium.layers]}
            if self.tissue.parameters is not None:
                remarks |= asdict(self.tissue.parameters)
        remarks |= {"total": self.radial.total, "per": self._per(), "error": self.fit.error}
        remarks |= {"error_kind": self.fit.kind, "energy_error": self.fit.energy_error}
        write_profile(path, self.fit.profile, remarks)

    def _per(self) -> str:
        if self.radial.model == "table":
            return "as the table has it"
        return (
            "of incident light, surface reflection apart" if self.radial.incident else "of light that enters"
        )

    def _tissue_json(self) -> dict[str, object]:
        if self.tissue is None:
            return {}
        medium, parameters = self.tissue.medium, self.tissue.parameters
        found: dict[str, object] = {
            "eta": medium.eta,
            "layers": [layer.name for layer in medium.layers],
            "thickness_mm": [layer.thickness_mm for layer in medium.layers],
            "mean_free_path_mm": [layer.mean_free_path_mm for layer in medium.layers],
            "absorption_per_mm": [layer.sigma_a for layer in medium.layers],
            "scattering_per_mm": [layer.sigma_s_prime for layer in medium.layers],
        }
        if parameters is not None:
            found |= {"skin": asdict(parameters), "wavelength_nm": WAVELENGTHS_NM}
            found["reflectance"] = self.spectrum
        return found

    def _other_json(self) -> dict[str, object]:
        if self.other is None:
            return {}
        found = asdict(self.other)
        if not isinstance(self.other, BurleyFit):
            return {"separable": found}
        engines = {f.__name__: asdict(f(self.other.profile)) for f in (unity_parameters, unreal_parameters)}
        return {"burley": found | engines}

    def _through(self) -> dict[str, Floats]:
        """Return the light through the thicknesses, (n, 3), by each way to compute it [-]."""
        if not self.through_mm:
            return {}
        ways = {"gaussians": through_gaussians(self.fit.profile, self.through_mm)}
        return ways if self.tissue is None else ways | {"slab": self.tissue.through(self.through_mm)}


_CHANNEL_COLOURS = ("#c0392b", "#2e8b57", "#2a62b0")
_LEGEND_ABOVE: dict[str, Any] = {"frameon": False, "fontsize": 7, "loc": "lower left", "bbox_to_anchor": (0, 1)}
_LAYERS = ("#b8860b", "#8e44ad", "#16808a", "#7f8c8d")
_DASHES = (0, (4, 3))
_NAMES = ("red", "green", "blue")
_PLOT_FLOOR = 1e-5  # of the peak of r R(r): below that numbers are noise and eyes see nothing
_DATELESS_METADATA: dict[str, dict[str, str | None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Metadata without dates, so that equal plots are equal files."""
_MAX_PHOTON_ERROR = 0.3  # relative standard error beyond which a ring of photons is left out


def draw_plot(path: Path, found: Report, counted: RadialProfile | None) -> None:
    """Write r R(r) of each channel: the model, its Gaussians, and counted photons with error bars.

    path : .png, .svg or .pdf
    """
    rc_context = needed("matplotlib", "plots").rc_context
    spectral = found.spectrum is not None
    size = (7.2, 7.8 if spectral else 5.2)
    figure = needed("matplotlib.figure", "plots").Figure(figsize=size, dpi=160, layout="constrained")
    axes, *more = figure.subplots(1 + spectral, squeeze=False, height_ratios=[2, 1][: 1 + spectral])[:, 0]
    for below in more:
        _plot_spectra(below, found)
    peak = _plot_curves(axes, found)
    if counted is not None:
        peak = max(peak, _plot_photons(axes, counted))
    axes.set(xscale="log", yscale="log", xlabel="r [mm]", ylabel="r R(r) [1/mm]")
    axes.set(xlim=(1e-3, 30.0), ylim=(_PLOT_FLOOR * peak, 2.0 * peak))
    axes.set_title(_title(found), fontsize=10, loc="left")
    axes.grid(which="major", alpha=0.25, linewidth=0.6)
    _add_legend(figure, axes)
    drawn, form = BytesIO(), path.suffix.lower()[1:]
    with rc_context({"svg.hashsalt": "dermis"}):
        figure.savefig(drawn, format=form, metadata=_DATELESS_METADATA.get(form))
    with replacing(path) as trial:  # matplotlib itself has no clean end on a full disk
        trial.write_bytes(drawn.getvalue())


def _plot_spectra(axes: Axes, found: Report) -> None:
    """Reflectance by wavelength, and the layers' coefficients on an axis of their own."""
    assert found.tissue is not None and found.spectrum is not None
    axes.plot(WAVELENGTHS_NM, found.spectrum, color="black", linewidth=1.6, label="R")
    axes.set(xlim=(400, 700), ylim=(0, 1), xlabel="wavelength [nm]", ylabel="R, of incident light")
    right = axes.twinx()
    right.set(yscale="log", ylabel="µa, µs′ [1/mm]")
    for layer, ink in zip(found.tissue.medium.layers, _LAYERS, strict=False):
        right.plot(WAVELENGTHS_NM, layer.sigma_a, color=ink, linewidth=1.0, label=f"µa, {layer.name}")
        label = f"µs′, {layer.name}"
        right.plot(
            WAVELENGTHS_NM, layer.sigma_s_prime, color=ink, linewidth=1.0, linestyle=_DASHES, label=label
        )
    lines = [*axes.get_lines(), *right.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines], ncols=5, **_LEGEND_ABOVE)


def _add_legend(figure: Figure, axes: Axes) -> None:
    """A column for each channel, below the curves."""
    entries = zip(*axes.get_legend_handles_labels(), strict=True)
    by_channel = sorted(entries, key=lambda entry: _NAMES.index(entry[1].partition(",")[0]))
    figure.legend(
        *zip(*by_channel, strict=True), loc="outside lower center", ncols=3, frameon=False, fontsize=8
    )


def _plot_curves(axes: Axes, found: Report) -> float:
    radial, fit = found.radial, found.fit.profile
    r = radial.radius_mm
    fitted = fit.radiant_exitance(r)
    peak = float((r[:, None] * fitted).max())
    if radial.standard_error is not None:
        peak = max(peak, _plot_photons(axes, radial))
    for channel, (ink, name) in enumerate(zip(_CHANNEL_COLOURS, _NAMES, strict=True)):
        if radial.standard_error is None:
            label = f"{name}, {radial.model}"
            axes.plot(r, r * radial.reflectance[:, channel], color=ink, linewidth=1.4, label=label)
            peak = max(peak, float((r * radial.reflectance[:, channel]).max()))
        terms = len(fit.weight) if found.fit.shared else np.count_nonzero(fit.weight[:, channel])
        label = f"{name}, {terms} Gaussians, error {found.fit.error[channel]:.2%}"
        axes.plot(r, r * fitted[:, channel], color=ink, linewidth=1.1, linestyle=_DASHES, label=label)
        if isinstance(found.other, BurleyFit):
            other = r * found.other.profile.radiant_exitance(r)[:, channel]
            label = f"{name}, Burley, error {found.other.error[channel]:.1%} of rings"
            axes.plot(r, other, color=ink, linewidth=1.0, linestyle=":", label=label)
    return peak


def _plot_photons(axes: Axes, counted: RadialProfile) -> float:
    r, peak = counted.radius_mm, 0.0
    error: Floats = counted.standard_error if counted.standard_error is not None else np.zeros((len(r), 3))
    for channel, ink in enumerate(_CHANNEL_COLOURS):
        R, se = counted.reflectance[:, channel], error[:, channel]
        sure = (R > 0.0) & (se < _MAX_PHOTON_ERROR * np.abs(R)) & (r > 1e-3)
        peak = max(peak, float((r * R)[sure].max(initial=0.0)))
        label = f"{_NAMES[channel]}, Monte Carlo"
        bars: dict[str, Any] = {"markersize": 2.2, "elinewidth": 0.8, "color": ink, "alpha": 0.7}
        axes.errorbar(r[sure], (r * R)[sure], (r * se)[sure], fmt="o", label=label, **bars)
    return peak


def _title(found: Report) -> str:
    radial = found.radial
    total = ", ".join(f"{value:.3f}" for value in radial.total)
    eta = f", index {found.tissue.medium.eta:g}" if found.tissue is not None else ""
    return f"{radial.name}{eta}: total reflectance {total}"
