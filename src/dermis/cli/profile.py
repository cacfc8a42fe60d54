"""The command `dermis profile`: diffusion profiles of skin and their Gaussian fits."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.base.console import print_json, print_lines, print_note, progress_bar
from dermis.base.errors import refuse
from dermis.base.quantities import checked_integer, checked_number
from dermis.cli.options import (
    NO_OPTIONS,
    FlagOption,
    IntegerOption,
    JsonOption,
    OptionalOutputPath,
    Options,
    drop_none,
    model_options,
    option_name,
    parse_lengths,
)
from dermis.optics.pigments.parameters import DEFAULT_SKIN, DEFAULT_STRUCTURE, SKINS
from dermis.scene.skin import Pigments

_PIGMENT_OPTION_NAMES = {"structure": "skin"}


def _pigment_default_texts() -> dict[str, str]:
    """Return a dictionary from each pigment field to a help text with its default.

    If named skins, such as "dark", have other values, the text lists these skins and values too.
    """
    defaults: dict[str, str] = {"structure": DEFAULT_STRUCTURE}
    for field in Pigments.model_fields.keys() - defaults.keys():
        default = getattr(DEFAULT_SKIN, field)
        values_of_skins = {name: getattr(skin, field) for name, skin in SKINS.items()}
        different = [f"{name} {value:g}" for name, value in values_of_skins.items() if value != default]
        defaults[field] = ", ".join([f"{default:g}", *different])
    return defaults


if TYPE_CHECKING:
    from dermis.optics.media import Floats
    from dermis.optics.radial import RadialProfile
    from dermis.optics.tissue import Tissue

    PigmentOptions = Options
else:
    PigmentOptions = model_options(
        Pigments, option_names=_PIGMENT_OPTION_NAMES, shown_defaults=_pigment_default_texts()
    )

SourceDepthClamp = Literal["layer", "none"]
ProfileModelName = Literal[
    "counted", "dipole", "better-dipole", "multipole", "layered", "layered-point", "montecarlo"
]

_DEFAULT_TERM_COUNT, _DEFAULT_PHOTON_COUNT, _MAX_PHOTON_COUNT = 6, 1_000_000, 10**10


def profile(
    name: str,
    /,
    *,
    model: ProfileModelName | None = None,
    clamp: SourceDepthClamp = "layer",
    eta: float | None = None,
    photons: IntegerOption = None,
    seed: IntegerOption = None,
    anisotropy: float = 0.0,
    pigments: PigmentOptions = NO_OPTIONS,
    oiliness: float | None = None,
    fit: IntegerOption = None,
    fit_kind: Literal["gaussian", "burley", "separable"] = "gaussian",
    variances: Literal["shared", "per-channel"] = "shared",
    keep_energy: FlagOption = False,
    transmission_thicknesses: Annotated[str | None, Parameter(name="--through")] = None,
    output: OptionalOutputPath = None,
    plot: Path | None = None,
    check: FlagOption = False,
    as_json: JsonOption = False,
) -> int:
    """Compute the diffusion profile of a skin or medium, and fit Gaussians to it.

    Examples:

        dermis profile dj3 --model multipole --plot dj3.png

        dermis profile spectral --melanin 0.02 --blood 0.01 -o mine.toml

        dermis render lee_perry_smith --profile mine.toml

        dermis profile skin1 --model montecarlo --photons 1000000 --eta 1.3 --json

    Parameters
    ----------
    name:
        Medium (dj3, skin1, skin2, marble ...), pigmented skin (spectral, light, medium, dark), the published
        table gpu-gems-3, or a .toml file: with [[layers]], with a table [skin], or written by -o.
    model:
        Model of the profile. counted: tabulated photon counts, the default for one semi-infinite layer of
        index 1 or 1.4; layered: layered diffusion, the default for all other media; layered-point: layered
        with a finite value at r = 0; dipole, better-dipole: for one semi-infinite layer; multipole: the model
        of the talk "Advanced Skin Rendering" (2007); montecarlo: the reference, for which photons are traced
        now.
    clamp:
        Source depth of the multipole in layers thinner than one mean free path: layer (moved inside the
        layer), or none (below the layer, as published).
    eta:
        Index of refraction of the layers; 1 for an index-matched surface. [default: 1.4]
    photons:
        Number of Monte Carlo photons per colour channel or wavelength. [default: 1000000]
    seed:
        Seed of the Monte Carlo random numbers. [default: 0]
    anisotropy:
        Mean cosine g of the scattering angle of Monte Carlo photons; reduced scattering does not change.
    oiliness:
        Oiliness of the surface, 0 to 1; only recorded in the file that -o writes, without effect on the
        profile.
    fit:
        Number of Gaussians to fit, 1 to 8. [default: 6]
    fit_kind:
        Additional fit to report: burley (normalised diffusion) or separable (separable kernel); gaussian adds
        none.
    variances:
        Variances of the Gaussians: shared by all colour channels, as the renderer requires, or per-channel.
    keep_energy:
        Make the weights of the Gaussians sum to the total reflectance; always on for the model counted.
    transmission_thicknesses:
        Thicknesses at which to report the transmitted colour, such as 0.5,1,2 [mm].
    output:
        Profile to write (.toml), for `dermis render --profile`.
    plot:
        Plot to write (.png, .svg or .pdf): r R(r) of each colour channel, and its fit.
    check:
        Add Monte Carlo results with error bars to the plot.
    as_json:
        Print one JSON object with the profile, its fits and errors.
    """
    from dermis.cli.profile_report import ProfileReport, additional_fit, draw_plot, gaussian_fit
    from dermis.optics.diffusion.models import error_against_monte_carlo, measured_model_error
    from dermis.optics.half_space import PHOTON_TABLE_MODEL
    from dermis.optics.profiles import find_gaussians
    from dermis.optics.radial import gaussian_radial_profile

    tissue_options = pigments | drop_none(oiliness=oiliness)
    changed = tissue_options or eta is not None
    _check_outputs(output, plot, check)
    thicknesses = (
        () if transmission_thicknesses is None else parse_lengths("--through", transmission_thicknesses)
    )
    tracing = _tracing_options(photons, seed, anisotropy, check or model == "montecarlo")
    table = find_gaussians(name)
    if table is not None:
        _refuse_tissue_options(name, tissue_options | {"model": model, "eta": eta, "check": check or None})
        tissue, radial, monte_carlo = None, replace(gaussian_radial_profile(table), name=name), None
        model_error, spectrum = None, None
    else:
        tissue = _load_tissue(name, tissue_options, eta)
        radial = _compute_profile(tissue, model, clamp, tracing)
        monte_carlo, model_error = None, measured_model_error(radial.model, "" if changed else name)
        if check and model != "montecarlo":
            monte_carlo = _compute_profile(tissue, "montecarlo", clamp, tracing)
            model_error = error_against_monte_carlo(radial, monte_carlo)
        spectrum = _reflectance_spectrum(tissue, model, clamp)
    conserve = keep_energy or radial.model == PHOTON_TABLE_MODEL
    table_fit, terms = (table, _DEFAULT_TERM_COUNT) if fit is None else (None, fit)
    fitted = gaussian_fit(
        radial, table_fit, terms, shared_variances=variances == "shared", keep_energy=conserve
    )
    report = ProfileReport(
        radial, tissue, fitted, additional_fit(radial, fit_kind), thicknesses, model_error, spectrum
    )
    if output is not None:
        report.save(output)
    if plot is not None:
        draw_plot(plot, report, monte_carlo)
    if as_json:
        print_json(report.as_json())
    else:
        print_lines(*report.lines())
        for warning in radial.warnings:
            print_note(f"warning: {warning}")
    return 0


def _check_outputs(profile_path: Path | None, plot_path: Path | None, adds_monte_carlo: bool) -> None:
    from dermis.base.atomic_write import check_output

    if profile_path is not None:
        check_output(profile_path, (".toml",), "Give it the suffix .toml")
    if plot_path is not None:
        check_output(plot_path, (".png", ".svg", ".pdf"))
    elif adds_monte_carlo:
        refuse("--check", "the option --plot", "it is missing", "Add --plot picture.png")


def _tracing_options(photons: int | None, seed: int | None, anisotropy: float, is_traced: bool) -> Options:
    """Return the keyword arguments for the Monte Carlo simulation.

    A note is printed if an option of the simulation is given although the simulation will not run.

    is_traced : whether the simulation will run
    """
    if not is_traced and (photons, seed, anisotropy) != (None, None, 0.0):
        print_note(
            "note: --photons, --seed and --anisotropy have no effect without --model montecarlo or --check"
        )
    return {
        "photons": checked_integer(
            "--photons", _DEFAULT_PHOTON_COUNT if photons is None else photons, 1, _MAX_PHOTON_COUNT
        ),
        "seed": checked_integer("--seed", seed or 0, 0, 2**63 - 1),
        "g": checked_number("--anisotropy", anisotropy, -1.0, 1.0, "a mean cosine"),
    }


def _refuse_tissue_options(medium_name: str, options: Options) -> None:
    for option, value in options.items():
        if value is not None:
            expected, actual = "a medium or a pigmented skin", f"{medium_name} is a table of Gaussians"
            refuse(option_name(option, _PIGMENT_OPTION_NAMES), expected, actual, "Remove the option")


def _load_tissue(medium_name: str, options: Options, eta: float | None) -> Tissue:
    from dermis.optics.tissue import load_tissue

    pigments = dict(options)
    structure = pigments.pop("structure", None)
    tissue = load_tissue(medium_name, structure, pigments)
    if structure is not None and tissue.parameters is None:
        refuse("--skin", "a pigmented skin", f"{medium_name} is a medium", "Remove the option")
    return tissue if eta is None else replace(tissue, medium=tissue.medium.with_eta(eta))


def _reflectance_spectrum(
    tissue: Tissue, model_name: ProfileModelName | None, source_clamp: SourceDepthClamp
) -> Floats | None:
    if model_name is None or model_name == "counted" or model_name == "montecarlo":
        return tissue.spectrum(clamp=source_clamp)
    return tissue.spectrum(model_name, source_clamp)


def _compute_profile(
    tissue: Tissue,
    model_name: ProfileModelName | None,
    source_clamp: SourceDepthClamp,
    tracing_options: Options,
) -> RadialProfile:
    if model_name != "montecarlo":
        return tissue.profile(model_name, source_clamp)
    from dermis.apps.truths.slab_mc import monte_carlo_profile

    with progress_bar("tracing photons") as report:
        return monte_carlo_profile(tissue.medium, tissue.rgb, progress=report, **tracing_options)
