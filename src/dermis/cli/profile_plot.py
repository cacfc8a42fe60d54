"""The figure of `dermis profile --plot`."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dermis.base.atomic_write import replacing
from dermis.base.extras import needed
from dermis.optics.fits.burley import BurleyFit

if TYPE_CHECKING:
    from dermis.cli.profile_report import Report
    from dermis.optics.media import Floats
    from dermis.optics.radial import RadialProfile

_INK = ("#c0392b", "#2e8b57", "#2a62b0")
_ABOVE: dict[str, Any] = {"frameon": False, "fontsize": 7, "loc": "lower left", "bbox_to_anchor": (0, 1)}
_LAYERS = ("#b8860b", "#8e44ad", "#16808a", "#7f8c8d")
_NAMES = ("red", "green", "blue")
_FAINTEST = 1e-5  # of the peak of r R(r): below that numbers are noise and eyes see nothing
_UNDATED: dict[str, dict[str, Any]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""What keeps the same plot the same file."""
_LEAST_COUNT = 0.3  # relative standard error beyond which a ring of photons is left out


def draw(path: Path, found: Report, counted: RadialProfile | None) -> None:
    """Write r R(r) of each channel: the model, its Gaussians, and counted photons with error bars.

    path : .png, .svg or .pdf
    """
    rc_context = needed("matplotlib", "plots").rc_context
    spectral = found.spectrum is not None
    size = (7.2, 7.8 if spectral else 5.2)
    figure = needed("matplotlib.figure", "plots").Figure(figsize=size, dpi=160, layout="constrained")
    axes, *more = figure.subplots(1 + spectral, squeeze=False, height_ratios=[2, 1][: 1 + spectral])[:, 0]
    for below in more:
        _spectra(below, found)
    peak = _curves(axes, found)
    if counted is not None:
        peak = max(peak, _photons(axes, counted))
    axes.set(xscale="log", yscale="log", xlabel="r [mm]", ylabel="r R(r) [1/mm]")
    axes.set(xlim=(1e-3, 30.0), ylim=(_FAINTEST * peak, 2.0 * peak))
    axes.set_title(_title(found), fontsize=10, loc="left")
    axes.grid(which="major", alpha=0.25, linewidth=0.6)
    _legend(figure, axes)
    drawn, form = BytesIO(), path.suffix.lower()[1:]
    with rc_context({"svg.hashsalt": "dermis"}):
        figure.savefig(drawn, format=form, metadata=_UNDATED.get(form))
    with replacing(path) as trial:  # matplotlib itself has no clean end on a full disk
        trial.write_bytes(drawn.getvalue())


def _spectra(axes: Any, found: Report) -> None:
    """Reflectance by wavelength, and the layers' coefficients on an axis of their own."""
    from dermis.optics.pigments.spectra import WAVELENGTHS_NM

    assert found.tissue is not None
    axes.plot(WAVELENGTHS_NM, found.spectrum, color="black", linewidth=1.6, label="R")
    axes.set(xlim=(400, 700), ylim=(0, 1), xlabel="wavelength [nm]", ylabel="R, of incident light")
    right = axes.twinx()
    right.set(yscale="log", ylabel="µa, µs′ [1/mm]")
    for layer, ink in zip(found.tissue.medium.layers, _LAYERS, strict=False):
        right.plot(WAVELENGTHS_NM, layer.sigma_a, color=ink, linewidth=1.0, label=f"µa, {layer.name}")
        dashes = {"linewidth": 1.0, "linestyle": (0, (4, 3)), "label": f"µs′, {layer.name}"}
        right.plot(WAVELENGTHS_NM, layer.sigma_s_prime, color=ink, **dashes)
    lines = [*axes.get_lines(), *right.get_lines()]
    axes.legend(lines, [line.get_label() for line in lines], ncols=5, **_ABOVE)


def _legend(figure: Any, axes: Any) -> None:
    """A column for each channel, below the curves."""
    entries = zip(*axes.get_legend_handles_labels(), strict=True)
    by_channel = sorted(entries, key=lambda entry: _NAMES.index(entry[1].partition(",")[0]))
    figure.legend(
        *zip(*by_channel, strict=True), loc="outside lower center", ncols=3, frameon=False, fontsize=8
    )


def _curves(axes: Any, found: Report) -> float:
    radial, fit = found.radial, found.fit.profile
    r = radial.radius_mm
    fitted = fit.radiant_exitance(r)
    peak = float((r[:, None] * fitted).max())
    if radial.standard_error is not None:
        peak = max(peak, _photons(axes, radial))
    for channel, (ink, name) in enumerate(zip(_INK, _NAMES, strict=True)):
        if radial.standard_error is None:
            label = f"{name}, {radial.model}"
            axes.plot(r, r * radial.reflectance[:, channel], color=ink, linewidth=1.4, label=label)
            peak = max(peak, float((r * radial.reflectance[:, channel]).max()))
        terms = len(fit.weight) if found.fit.shared else np.count_nonzero(fit.weight[:, channel])
        label = f"{name}, {terms} Gaussians, error {found.fit.error[channel]:.2%}"
        axes.plot(r, r * fitted[:, channel], color=ink, linewidth=1.1, linestyle=(0, (4, 3)), label=label)
        if isinstance(found.other, BurleyFit):
            other = r * found.other.profile.radiant_exitance(r)[:, channel]
            label = f"{name}, Burley, error {found.other.error[channel]:.1%} of rings"
            axes.plot(r, other, color=ink, linewidth=1.0, linestyle=":", label=label)
    return peak


def _photons(axes: Any, counted: RadialProfile) -> float:
    r, peak = counted.radius_mm, 0.0
    error: Floats = counted.standard_error if counted.standard_error is not None else np.zeros((len(r), 3))
    for channel, ink in enumerate(_INK):
        R, se = counted.reflectance[:, channel], error[:, channel]
        sure = (R > 0.0) & (se < _LEAST_COUNT * np.abs(R)) & (r > 1e-3)
        peak = max(peak, float((r * R)[sure].max(initial=0.0)))
        label = f"{_NAMES[channel]}, Monte Carlo"
        bars = {"markersize": 2.2, "elinewidth": 0.8, "color": ink, "alpha": 0.7, "label": label}
        axes.errorbar(r[sure], (r * R)[sure], (r * se)[sure], fmt="o", **bars)
    return peak


def _title(found: Report) -> str:
    radial = found.radial
    total = ", ".join(f"{value:.3f}" for value in radial.total)
    eta = f", index {found.tissue.medium.eta:g}" if found.tissue is not None else ""
    return f"{radial.name}{eta}: total reflectance {total}"
