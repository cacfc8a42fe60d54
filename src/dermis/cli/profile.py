"""`dermis profile`: how light spreads below a skin, and the Gaussians that stand for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.base.console import note, print_json, print_lines, progress
from dermis.base.errors import refuse
from dermis.base.quantities import number, whole_number
from dermis.cli.options import NO_OPTIONS, Json, Options, Output, Integer, option_name, model_options, parse_lengths
from dermis.optics.pigments.parameters import DEFAULT_SKIN, DEFAULT_STRUCTURE, SKINS
from dermis.scene.skin import Pigments

_NAMES = {"structure": "skin"}


def _defaults() -> dict[str, str]:
    """Return the default of each pigment: the default skin's, and those of other skins where they differ."""
    found: dict[str, str] = {"structure": DEFAULT_STRUCTURE}
    for field in Pigments.model_fields.keys() - found.keys():
        usual, own = getattr(DEFAULT_SKIN, field), {name: getattr(one, field) for name, one in SKINS.items()}
        others = [f"{name} {value:g}" for name, value in own.items() if value != usual]
        found[field] = ", ".join([f"{usual:g}", *others])
    return found


if TYPE_CHECKING:
    from dermis.optics.media import Floats
    from dermis.optics.radial import RadialProfile
    from dermis.optics.tissue import Tissue

    PigmentOptions = Options
else:
    PigmentOptions = model_options(Pigments, names=_NAMES, defaults=_defaults())

Clamp = Literal["layer", "none"]
Model = Literal["counted", "dipole", "better-dipole", "multipole", "layered", "layered-point", "montecarlo"]
Flag = Annotated[bool, Parameter(negative="")]

_TERMS, _PHOTONS, _MAX_PHOTONS = 6, 1_000_000, 10**10


def profile(
    name: str,
    /,
    *,
    model: Model | None = None,
    clamp: Clamp = "layer",
    eta: float | None = None,
    photons: Integer = None,
    seed: Integer = None,
    anisotropy: float = 0.0,
    pigments: PigmentOptions = NO_OPTIONS,
    oiliness: float | None = None,
    fit: Integer = None,
    fit_kind: Literal["gaussian", "burley", "separable"] = "gaussian",
    variances: Literal["shared", "per-channel"] = "shared",
    keep_energy: Flag = False,
    through: str | None = None,
    output: Output = None,
    plot: Path | None = None,
    check: Flag = False,
    as_json: Json = False,
) -> int:
    """Compute how light spreads below a skin, and fit Gaussians to it.

    Examples:

        dermis profile dj3 --model multipole --plot dj3.png

        dermis profile spectral --melanin 0.02 --blood 0.01 -o mine.toml

        dermis render lee_perry_smith --profile mine.toml

        dermis profile skin1 --model montecarlo --photons 1000000 --eta 1.3 --json

    Parameters
    ----------
    name:
        A medium (dj3, skin1, skin2, marble ...), a skin of pigments (spectral, light, medium, dark), the
        published table gpu-gems-3, or a .toml file: [[layers]], a table [skin], or what -o wrote.
    model:
        counted is photons counted beforehand, for one semi-infinite layer of index 1 or 1.4 [its default];
        layered is diffusion with continuous flux [the default of all else], layered-point finite at its
        centre; dipole and better-dipole take one semi-infinite layer; multipole is the deck's; montecarlo
        is the truth.
    clamp:
        Where the multipole puts the source of a layer thinner than a mean free path: inside it (layer), or
        below it as printed (none).
    eta:
        Index of refraction of the layers; 1 for a matched surface [1.4].
    photons:
        Monte Carlo photons for each channel or wavelength [1000000].
    seed:
        Of the photons' random numbers [0].
    anisotropy:
        Mean cosine g of the photons' scattering; the reduced scattering stays what it is.
    oiliness:
        Strength of the surface reflection; nothing below depends on it.
    fit:
        How many Gaussians to fit, 1 to 8 [6].
    fit_kind:
        Also fit the normalised profile of Burley, or a separable kernel, and state their errors.
    variances:
        One set of widths for all channels, as a renderer wants it, or a set for each.
    keep_energy:
        Have the weights sum to the total reflectance; those of counted do.
    through:
        Also give the colour that comes through these thicknesses, such as 0.5,1,2 [mm].
    output:
        Profile to write (.toml), for --profile of render.
    plot:
        Picture to write (.png, .svg or .pdf): r R(r) of each channel with its fit.
    check:
        Add Monte Carlo points with error bars to the plot.
    """
    from dermis.cli.profile_report import Report, draw_plot, gaussian_fit, other_fit
    from dermis.optics.diffusion.models import counted_error, known_error
    from dermis.optics.half_space import COUNTED
    from dermis.optics.profiles import find_table
    from dermis.optics.radial import profile_of_table

    given = pigments | ({"oiliness": oiliness} if oiliness is not None else {})
    _check_outputs(output, plot, check)
    thicknesses = () if through is None else parse_lengths("--through", through)
    light = _tracing_options(photons, seed, anisotropy, check or model == "montecarlo")
    table = find_table(name)
    if table is not None:
        _refuse_tissue_options(name, given | {"model": model, "eta": eta, "check": check or None})
        tissue, radial, counted = None, replace(profile_of_table(table), name=name), None
        error, spectrum = None, None
    else:
        tissue = _tissue(name, given, eta)
        radial = _profile(tissue, model, clamp, light)
        counted = _profile(tissue, "montecarlo", clamp, light) if check and model != "montecarlo" else None
        usual = name if not given and eta is None else ""
        error = counted_error(radial, counted) if counted else known_error(radial.model, usual)
        spectrum = _spectrum(tissue, model, clamp)
    kept = keep_energy or radial.model == COUNTED
    own, terms = (table, _TERMS) if fit is None else (None, fit)
    fitted = gaussian_fit(radial, own, terms, shared=variances == "shared", keep_energy=kept)
    found = Report(radial, tissue, fitted, other_fit(radial, fit_kind), thicknesses, error, spectrum)
    if output is not None:
        found.save(output)
    if plot is not None:
        draw_plot(plot, found, counted)
    if as_json:
        print_json(found.as_json())
    else:
        print_lines(*found.lines())
        for warning in radial.warnings:
            note(f"warning: {warning}")
    return 0


def _check_outputs(output: Path | None, plot: Path | None, check: bool) -> None:
    from dermis.base.atomic_write import check_output

    if output is not None:
        check_output(output, (".toml",), "Give it the suffix .toml")
    if plot is not None:
        check_output(plot, (".png", ".svg", ".pdf"))
    elif check:
        refuse("--check", "a plot to add photons to", "no --plot came", "Add --plot picture.png")


def _tracing_options(photons: int | None, seed: int | None, anisotropy: float, traced: bool) -> Options:
    """Return the options of tracing; print a note when no photons will be traced."""
    if not traced and (photons, seed, anisotropy) != (None, None, 0.0):
        note("note: no photons are traced without --model montecarlo or --check")
    return {
        "photons": whole_number("--photons", _PHOTONS if photons is None else photons, 1, _MAX_PHOTONS),
        "seed": whole_number("--seed", seed or 0, 0, 2**63 - 1),
        "g": number("--anisotropy", anisotropy, -1.0, 1.0, "a mean cosine"),
    }


def _refuse_tissue_options(name: str, given: Options) -> None:
    for option, value in given.items():
        if value is not None:
            expected, came = "a medium or a skin of pigments", f"{name} is a table of Gaussians"
            refuse(option_name(option, _NAMES), expected, came, "Leave it out")


def _tissue(name: str, given: Options, eta: float | None) -> Tissue:
    from dermis.optics.tissue import load_tissue

    structure = given.get("structure")
    tissue = load_tissue(name, structure, {key: value for key, value in given.items() if key != "structure"})
    if structure is not None and tissue.parameters is None:
        refuse("--skin", "a skin made of pigments", f"{name} is a medium", "Leave it out")
    return tissue if eta is None else replace(tissue, medium=tissue.medium.with_eta(eta))


def _spectrum(tissue: Tissue, model: Model | None, clamp: Clamp) -> Floats | None:
    if model is None or model == "counted" or model == "montecarlo":
        return tissue.spectrum(clamp=clamp)
    return tissue.spectrum(model, clamp)


def _profile(tissue: Tissue, model: Model | None, clamp: Clamp, light: Options) -> RadialProfile:
    if model != "montecarlo":
        return tissue.profile(model, clamp)
    from dermis.apps.truths.slab_mc import monte_carlo_profile

    with progress("tracing photons") as report:
        return monte_carlo_profile(tissue.medium, tissue.rgb, report=report, **light)
