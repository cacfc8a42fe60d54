"""Command that compares the spectral model of skin with measured spectra, and writes docs/measured.md."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from dermis.apps.inverse.unmixing.spectral_inversion import (
    PIGMENT_AND_OXYGEN_UNKNOWNS,
    PIGMENT_UNKNOWNS,
    TISSUE_UNKNOWNS,
    UNKNOWNS,
    ParameterValues,
    SpectralFit,
    SpectralModel,
    colour_metric,
    fit_skin,
    invert_spectra,
)
from dermis.apps.validation.accuracy.measured.bioskin import (
    BIOSKIN_UNKNOWN_SETS,
    BIOSKIN_UNKNOWNS,
    bioskin_model,
)
from dermis.apps.validation.accuracy.measured.constants import ExtendedModel, fit_constants
from dermis.apps.validation.accuracy.measured.illuminants import ILLUMINANTS, colour_weights
from dermis.apps.validation.accuracy.measured.page import GROUP_LABELS, RESULT_FILE, write_measured_page
from dermis.apps.validation.accuracy.measured.probe import APERTURES_MM, edge_loss
from dermis.apps.validation.pages import JsonObject, read_results, write_results
from dermis.apps.validation.spectral_archive import FOLD_COUNT, Archive, read_archive
from dermis.base.console import print_lines
from dermis.human.skin.measured import SITES
from dermis.images.colour import delta_e_2000, lab, linear_of_lab
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.pigments.spectra import (
    WAVELENGTHS_NM,
    baseline_absorption,
    blood_absorption,
    jacques_scattering,
    melanosome_absorption,
    rgb_weights,
)
from dermis.optics.skin_spectra import two_layer_reflectance

CHEEK_AND_FOREHEAD = SITES.index("cheek"), SITES.index("forehead")
"""Indices of the two facial sites at which most people were measured."""
PREVIOUS_DEFAULT_SKIN = replace(DEFAULT_SKIN, baseline=1.0, epidermis_mm=0.05, oxygen=0.75)
"""Default skin of earlier versions, before default skin was compared with the spectral archive."""
_SPECTRA_SAMPLE_COUNT, _CONSTANTS_SAMPLE_COUNT = (
    1500,
    600,
)  # numbers of spectra, for published models and for fits of constants
_SITE_SAMPLE_COUNT = 300  # number of spectra of a site, for fits of its constants
_OXYGEN_LIMIT_TOLERANCE, _MAX_MATCHED_DELTA_E = (
    1e-6,
    0.25,
)  # tolerance of oxygen at a bound [-], and of a matched colour [CIEDE2000]
_REGRESSION_NEIGHBOUR_COUNT = 80  # of other people, for the local regression of colours
_ERROR_PERCENTILES = 50.0, 95.0
_DONNER_JENSEN_SKIN = SkinParameters(baseline=1.0, epidermis_mm=0.25, oxygen=0.75)
_EDGE_LOSS_MELANIN = 0.01, 0.03, 0.1, 0.3
_EDGE_LOSS_WAVELENGTHS_NM = np.arange(400.0, 701.0, 50.0)
_ADDED_CONSTANTS_BY_NAME: dict[str, tuple[str, ...]] = {
    "none": (),
    "scattering, both layers": ("scattering",),
    "scattering of the dermis": ("dermis",),
    "Rayleigh scattering": ("small_fibres",),
    "kind of melanin": ("eumelanin",),
    "blood in vessels": ("vessel_mm",),
    "band of the instrument": ("bandwidth_nm",),
    "bilirubin": ("bilirubin",),
    "carotene": ("carotene",),
    "methaemoglobin": ("methaemoglobin",),
}


def fit_measured_spectra(
    bioskin_weights: Annotated[Path | None, Parameter(name="--bioskin")] = None,
    only_part: Annotated[str | None, Parameter(name="--only")] = None,
) -> None:
    """Fit the spectral model of skin to all measured spectra, and write docs/measured.md.

    Takes ten minutes.

    Parameters
    ----------
    only_part:
        Part to measure again (models, surface, limits, folds, alternatives, additions, sites, site_folds or
        edge); the other parts keep their last results.
    bioskin_weights:
        File pretrained_models/BioSkin.pt of facebookresearch/BioSkin; with it, BioSkin's decoder is also
        compared.
    """
    archive = read_archive()
    parts: dict[str, Callable[[], object]] = {
        "counts": lambda: {"spectra": len(archive.spectra), "folds": FOLD_COUNT},
        "models": lambda: _default_skin_errors(archive),
        "surface": lambda: _smooth_surface_errors(archive),
        "limits": lambda: _implausible_fit_fractions(archive),
        "folds": lambda: _cross_validation_errors(archive),
        "alternatives": lambda: _published_model_errors(
            archive.sample_rows(_SPECTRA_SAMPLE_COUNT, 2), bioskin_weights
        ),
        "additions": lambda: _additional_constant_errors(archive.sample_rows(_CONSTANTS_SAMPLE_COUNT, 3)),
        "sites": lambda: _site_fits(archive),
        "site_folds": lambda: _site_cross_validation_errors(archive),
        "edge": lambda: _edge_loss_errors(archive.sample_rows(_CONSTANTS_SAMPLE_COUNT, 3)),
    }
    results: JsonObject = {} if only_part is None else read_results(RESULT_FILE)
    for name in parts if only_part is None else [only_part]:
        results[name] = parts[name]()
        print_lines(f"{name} measured")
    write_results(RESULT_FILE, results, digits=4)
    write_measured_page()


def rewrite_measured_page() -> None:
    """Write docs/measured.md from the last measurement."""
    write_measured_page()


def _default_skin_errors(archive: Archive) -> JsonObject:
    """Return the errors of fits with two, three and five unknowns, for four choices of the fixed parameters.

    Fixed parameters are those that are not fitted. Each key names a skin that provides their values.
    "present" is the default skin. "former" is `PREVIOUS_DEFAULT_SKIN`, the default skin of earlier versions.
    "half" and "quarter" are `PREVIOUS_DEFAULT_SKIN` with a half and a quarter of the absorption by bloodless
    tissue.
    """
    skins = {
        "former": PREVIOUS_DEFAULT_SKIN,
        "half": replace(PREVIOUS_DEFAULT_SKIN, baseline=0.5),
        "quarter": replace(PREVIOUS_DEFAULT_SKIN, baseline=0.25),
        "present": DEFAULT_SKIN,
    }
    face = np.isin(archive.site, CHEEK_AND_FOREHEAD)
    subsets = {"all": np.ones(len(archive.spectra), bool), "cheek and forehead": face}
    results: JsonObject = {}
    for name, skin in skins.items():
        two, three = (
            fit_skin(archive.spectra, n, "colour", skin)
            for n in (PIGMENT_UNKNOWNS, PIGMENT_AND_OXYGEN_UNKNOWNS)
        )
        five = fit_skin(archive.spectra, TISSUE_UNKNOWNS, "spectrum", skin)
        two_spectra, three_spectra = (
            fit_skin(archive.spectra, n, "spectrum", skin)
            for n in (PIGMENT_UNKNOWNS, PIGMENT_AND_OXYGEN_UNKNOWNS)
        )
        results[name] = {
            label: {
                "two": _percentiles(two.delta_e()[chosen]),
                "above_2": float((two.delta_e()[chosen] > 2.0).mean()),
                "three": _percentiles(three.delta_e()[chosen]),
                "rms_two": _percentiles(two_spectra.rms_residual[chosen]),
                "rms_three": _percentiles(three_spectra.rms_residual[chosen]),
                "rms_five": _percentiles(five.rms_residual[chosen]),
            }
            for label, chosen in subsets.items()
        }
        if name in ("former", "present"):
            results[name]["residual"] = {
                "two": two_spectra.residual.mean(axis=0),
                "three": three_spectra.residual.mean(axis=0),
                "five": five.residual.mean(axis=0),
            }
            results[name]["lights"] = _illuminant_errors({"two": two, "three": three, "five": five})
            results[name]["groups"] = _category_errors(
                archive, list(GROUP_LABELS), archive.group, two, three, five
            )
            results[name]["by_site"] = _category_errors(
                archive, range(len(SITES)), archive.site, two, three, five
            )
        if name == "present":
            results["medians"] = {
                one: _percentiles(values, (5.0, 50.0, 95.0)) for one, values in five.values.items()
            }
    return _arrays_to_lists(results)


def _smooth_surface_errors(archive: Archive) -> JsonObject:
    """Return percentiles of the distances of measured colours from a smooth surface in colour space.

    The surface near a person's colour is fitted to the colours of other people. The colours that a skin model
    with two unknowns can produce also form a surface. The errors of such a model can therefore hardly be
    smaller than these distances. For the key "each site", a separate surface is fitted for each site of the
    body.
    """
    face = np.isin(archive.site, CHEEK_AND_FOREHEAD)
    sites = [_surface_distances(archive.select_rows(archive.site == site)) for site in range(len(SITES))]
    return {
        "all": _percentiles(_surface_distances(archive)),
        "cheek and forehead": _percentiles(_surface_distances(archive.select_rows(face))),
        "each site": _percentiles(np.concatenate(sites)),
    }


def _surface_distances(archive_part: Archive) -> Floats:
    """Return the CIEDE2000 differences (n,) of colours from a smooth surface through other people's colours.

    The surface is a local linear regression of the colours' third principal component on the first two.
    """
    from scipy.spatial import cKDTree

    colours = lab(archive_part.spectra @ rgb_weights().T)
    mean, scale = colours.mean(axis=0), colour_metric(np.median(colours, axis=0)[None])[0]
    axes = np.linalg.svd((colours - mean) @ scale.T, full_matrices=False)[2]
    point = (colours - mean) @ scale.T @ axes.T
    nearest = np.asarray(cKDTree(point[:, :2]).query(point[:, :2], k=_REGRESSION_NEIGHBOUR_COUNT + 40)[1])
    on_surface = point.copy()
    for k, neighbours in enumerate(nearest):
        others = neighbours[archive_part.person[neighbours] != archive_part.person[k]][
            :_REGRESSION_NEIGHBOUR_COUNT
        ]
        A = np.column_stack([np.ones(len(others)), point[others, :2] - point[k, :2]])
        on_surface[k, 2] = np.linalg.lstsq(A, point[others, 2], rcond=None)[0][0]
    nearby = on_surface @ axes @ np.linalg.inv(scale).T + mean
    return delta_e_2000(linear_of_lab(nearby), linear_of_lab(colours))


def _implausible_fit_fractions(archive: Archive) -> JsonObject:
    """Return the fractions of implausible or failed fits of three unknowns to measured colours.

    The keys are "none" for a fitted oxygenation of 0, "all" for an oxygenation of 1, and "unmatched" for fits
    that do not reproduce the measured colour.
    """
    fit = fit_skin(archive.spectra, PIGMENT_AND_OXYGEN_UNKNOWNS, "colour")
    oxygen = fit.values["oxygen"]
    return {
        "none": float((oxygen <= _OXYGEN_LIMIT_TOLERANCE).mean()),
        "all": float((oxygen >= 1.0 - _OXYGEN_LIMIT_TOLERANCE).mean()),
        "unmatched": float((fit.delta_e() > _MAX_MATCHED_DELTA_E).mean()),
    }


def _category_errors(
    archive: Archive,
    categories: Sequence[object],
    category_by_spectrum: np.ndarray,
    two_unknown_fit: SpectralFit,
    three_unknown_fit: SpectralFit,
    five_unknown_fit: SpectralFit,
) -> list[list[float]]:
    """Return the number of spectra and three median errors for each group of people or each site.

    The median errors are the colour error of the fit with two unknowns, the colour error of the fit with
    three unknowns, and the RMS difference between measured and fitted spectra of the fit with five unknowns.

    categories : all groups or all sites
    category_by_spectrum : (n,) group or site of each spectrum
    """
    rows = []
    for category in categories:
        chosen = category_by_spectrum == category
        medians = [float(np.median(one.delta_e()[chosen])) for one in (two_unknown_fit, three_unknown_fit)]
        rows.append([int(chosen.sum()), *medians, float(np.median(five_unknown_fit.rms_residual[chosen]))])
    return rows


def _illuminant_errors(fits_by_unknown_count: dict[str, SpectralFit]) -> JsonObject:
    """Return percentiles of the colour differences between spectra and fits under each illuminant."""
    return {
        name: {light: _percentiles(fit.delta_e(colour_weights(light))) for light in ILLUMINANTS}
        for name, fit in fits_by_unknown_count.items()
    }


def _cross_validation_errors(archive: Archive) -> list[JsonObject]:
    """Return one object for each fold of the cross-validation, with fitted constants and median errors.

    The measured people are divided into folds. For each fold, the constants are fitted to the spectra of the
    people outside the fold. Errors are then computed for the people in the fold. The key "fitted" has the
    errors with the fitted constants; the key "default" has the errors with the constants of the default skin.
    """
    rows = []
    for fold in range(FOLD_COUNT):
        known = archive.select_rows(archive.fold != fold).sample_rows(_CONSTANTS_SAMPLE_COUNT, fold)
        held = archive.select_rows(archive.fold == fold)
        spectral = fit_constants(known.spectra, PIGMENT_AND_OXYGEN_UNKNOWNS, ("baseline", "epidermis_mm"))
        colour = fit_constants(known.spectra, PIGMENT_UNKNOWNS, ("oxygen",), "colour", spectral.constants)
        skin = replace(DEFAULT_SKIN, **colour.constants | {"oxygen": min(1.0, colour.constants["oxygen"])})
        row: JsonObject = {"constants": colour.constants, "people": len(held.spectra)}
        for label, one in (("fitted", skin), ("default", DEFAULT_SKIN)):
            two, three = (
                fit_skin(held.spectra, n, "colour", one)
                for n in (PIGMENT_UNKNOWNS, PIGMENT_AND_OXYGEN_UNKNOWNS)
            )
            five = fit_skin(held.spectra, TISSUE_UNKNOWNS, "spectrum", one)
            face = np.isin(held.site, CHEEK_AND_FOREHEAD)
            row[label] = {
                "two": float(np.median(two.delta_e())),
                "two_face": float(np.median(two.delta_e()[face])),
                "three": float(np.median(three.delta_e())),
                "five": float(np.median(five.rms_residual)),
            }
        rows.append(row)
    return rows


def _published_model_errors(archive: Archive, bioskin_weights: Path | None) -> JsonObject:
    """Return fit errors of published models of skin, with two, three and five unknowns per spectrum.

    bioskin_weights : file of BioSkin's weights, see `bioskin_model`; None to leave out this model
    """
    sets = (PIGMENT_UNKNOWNS, PIGMENT_AND_OXYGEN_UNKNOWNS, TISSUE_UNKNOWNS)

    def model_errors(
        model: SpectralModel | None, skin: SkinParameters, unknown_sets: Sequence[Sequence[str]]
    ) -> JsonObject:
        known = BIOSKIN_UNKNOWNS if unknown_sets is BIOSKIN_UNKNOWN_SETS else UNKNOWNS
        result: JsonObject = {}
        for one in unknown_sets:
            for criterion in ("spectrum", "colour"):
                if criterion == "colour" and len(one) > 3:
                    continue
                fit = (
                    fit_skin(archive.spectra, one, criterion, skin)
                    if model is None
                    else invert_spectra(archive.spectra, model, [known[n] for n in one], criterion)
                )
                error = fit.rms_residual if criterion == "spectrum" else fit.delta_e()
                result[f"{criterion}_{len(one)}"] = _percentiles(error)
        return result

    results = {
        "present": model_errors(None, DEFAULT_SKIN, sets),
        "former": model_errors(None, PREVIOUS_DEFAULT_SKIN, sets),
        "donner": model_errors(None, _DONNER_JENSEN_SKIN, sets),
        "jacques": model_errors(_jacques_model, PREVIOUS_DEFAULT_SKIN, sets),
    }
    if bioskin_weights is not None:
        results["bioskin"] = model_errors(bioskin_model(bioskin_weights), DEFAULT_SKIN, BIOSKIN_UNKNOWN_SETS)
    return results


def _jacques_model(parameter_values: ParameterValues) -> Floats:
    """Return the reflectance (n, 31) of skins whose tissue scatters and absorbs as in [Jacques1998].

    Two formulae of the source are used: the one for scattering, and the one for the absorption by tissue
    without blood and melanin. Melanin and blood absorb as in the package's skin model.

    parameter_values : parameters of the skins by name
    """
    bloodless, sigma_s_prime = baseline_absorption(WAVELENGTHS_NM), jacques_scattering(WAVELENGTHS_NM)

    def parameter_column(name: str, default_value: float) -> Floats:
        return np.asarray(parameter_values.get(name, np.float64(default_value)))[..., None]

    m, b, oxygen = (
        parameter_column("melanin", 0.0),
        parameter_column("blood", 0.0),
        parameter_column("oxygen", 0.75),
    )
    vessels = oxygen * blood_absorption(WAVELENGTHS_NM, 1.0) + (1.0 - oxygen) * blood_absorption(
        WAVELENGTHS_NM, 0.0
    )
    return two_layer_reflectance(
        m * melanosome_absorption(WAVELENGTHS_NM, 1.0) + (1.0 - m) * bloodless,
        b * vessels + (1.0 - b) * bloodless,
        parameter_column("scattering", 1.0) * sigma_s_prime,
        parameter_column("epidermis_mm", 0.06),
        1.0,
    )


def _additional_constant_errors(archive_sample: Archive) -> list[JsonObject]:
    """Return errors of fits in which one more constant of the skin model is fitted, such as carotene.

    There is one result for each entry of `_ADDED_CONSTANTS_BY_NAME`. The added constant has one value for all
    spectra; the entry "none" adds no constant. The keys "three" and "five" have the errors of fits with three
    and with five unknowns per spectrum.
    """
    rows = []
    for name, free in _ADDED_CONSTANTS_BY_NAME.items():
        row: JsonObject = {"name": name}
        for label, unknowns in (("three", PIGMENT_AND_OXYGEN_UNKNOWNS), ("five", TISSUE_UNKNOWNS)):
            shared = ("baseline", "epidermis_mm") if label == "three" else ("baseline",)
            if label == "five" and free == ("scattering",):
                continue
            found = fit_constants(archive_sample.spectra, unknowns, (*shared, *free))
            row[label] = {
                "rms": float(np.sqrt((found.fit.residual**2).mean())),
                "constants": found.constants,
                "confounded": [[a, b, c] for a, b, c in found.confounded],
            }
        rows.append(row)
    return rows


def _site_fits(archive: Archive) -> list[JsonObject]:
    """Return the epidermis thickness and the oxygenation for which the model fits each site's spectra best.

    The key "colour" has the values for which the model fits the colours of the site's spectra best.
    """
    rows = []
    for site in range(len(SITES)):
        sample = archive.select_rows(archive.site == site).sample_rows(_SITE_SAMPLE_COUNT, site)
        fixed = {"baseline": DEFAULT_SKIN.baseline}
        spectral = fit_constants(
            sample.spectra, PIGMENT_AND_OXYGEN_UNKNOWNS, ("epidermis_mm",), fixed_constants=fixed
        )
        colour = fit_constants(sample.spectra, PIGMENT_UNKNOWNS, ("epidermis_mm", "oxygen"), "colour", fixed)
        oxygen = spectral.fit.values["oxygen"]
        rows.append(
            {
                "spectra": int((archive.site == site).sum()),
                "epidermis_mm": spectral.constants["epidermis_mm"],
                "oxygen": _percentiles(oxygen, (25.0, 50.0, 75.0)),
                "colour": colour.constants,
                "two": float(np.median(colour.fit.delta_e())),
            }
        )
    return rows


def _site_cross_validation_errors(archive: Archive) -> JsonObject:
    """Return colour errors of fits with two unknowns per spectrum and two constants per site of the body.

    The constants are the epidermis thickness and the oxygenation. The errors are cross-validated: the
    constants are fitted to people of other folds.
    """
    error = np.zeros(len(archive.spectra))
    fixed = {"baseline": DEFAULT_SKIN.baseline}
    for fold in range(FOLD_COUNT):
        for site in range(len(SITES)):
            here = archive.site == site
            held = here & (archive.fold == fold)
            sample = archive.select_rows(here & (archive.fold != fold)).sample_rows(_SITE_SAMPLE_COUNT, site)
            free = ("epidermis_mm", "oxygen")
            constants = fit_constants(sample.spectra, PIGMENT_UNKNOWNS, free, "colour", fixed).constants
            unknowns = [UNKNOWNS[name] for name in PIGMENT_UNKNOWNS]
            found = invert_spectra(archive.spectra[held], ExtendedModel(constants), unknowns, "colour")
            error[held] = found.delta_e()
    face = error[np.isin(archive.site, CHEEK_AND_FOREHEAD)]
    return {
        "all": _percentiles(error),
        "cheek and forehead": _percentiles(face),
        "above_2": float((error > 2.0).mean()),
    }


def _edge_loss_errors(archive_sample: Archive) -> JsonObject:
    """Return the edge loss of each aperture, and skin constants fitted to spectra corrected for this loss.

    The edge loss is the fraction of the reflected light that an aperture of a spectrophotometer misses.
    Measured spectra are corrected by dividing them by the fraction that the aperture receives. The key
    "uncorrected" has the constants fitted to the spectra as measured.
    """
    skins = [replace(DEFAULT_SKIN, melanin=m, blood=0.008) for m in _EDGE_LOSS_MELANIN]
    losses = [edge_loss(one, _EDGE_LOSS_WAVELENGTHS_NM) for one in skins]
    model = ExtendedModel({"baseline": DEFAULT_SKIN.baseline, "oxygen": DEFAULT_SKIN.oxygen})
    true = model(
        {"melanin": np.array(_EDGE_LOSS_MELANIN), "blood": np.full(len(skins), 0.008)}
        | {"epidermis_mm": np.full(len(skins), DEFAULT_SKIN.epidermis_mm)}
    )
    results: JsonObject = {"wavelength_nm": _EDGE_LOSS_WAVELENGTHS_NM, "melanin": _EDGE_LOSS_MELANIN}
    for name in APERTURES_MM:
        loss = np.array([np.interp(WAVELENGTHS_NM, _EDGE_LOSS_WAVELENGTHS_NM, one[name]) for one in losses])
        seen = true * (1.0 - loss)
        factor = np.stack(
            [1.0 - np.interp(archive_sample.spectra[:, k], seen[::-1, k], loss[::-1, k]) for k in range(31)],
            axis=-1,
        )
        found = fit_constants(
            archive_sample.spectra / factor, PIGMENT_AND_OXYGEN_UNKNOWNS, ("baseline", "epidermis_mm")
        )
        results[name] = {
            "loss": [one[name] for one in losses],
            "constants": found.constants,
            "rms": float(np.sqrt((found.fit.residual**2).mean())),
        }
    uncorrected = fit_constants(
        archive_sample.spectra, PIGMENT_AND_OXYGEN_UNKNOWNS, ("baseline", "epidermis_mm")
    )
    results["uncorrected"] = {
        "constants": uncorrected.constants,
        "rms": float(np.sqrt((uncorrected.fit.residual**2).mean())),
    }
    return _arrays_to_lists(results)


def _percentiles(errors: Floats, percentiles: Sequence[float] = _ERROR_PERCENTILES) -> list[float]:
    return [float(one) for one in np.percentile(errors, percentiles)]


def _arrays_to_lists(nested_value: object) -> JsonObject:
    """Return nested dictionaries and lists in which all arrays are converted to lists."""
    if isinstance(nested_value, np.ndarray):
        return nested_value.tolist()  # type: ignore[no-any-return]
    if isinstance(nested_value, dict):
        return {str(key): _arrays_to_lists(one) for key, one in nested_value.items()}
    if isinstance(nested_value, list | tuple):
        return [_arrays_to_lists(one) for one in nested_value]  # type: ignore[return-value]
    return nested_value  # type: ignore[return-value]
