"""Text of docs/measured.md from the results of the last measurement."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dermis.apps.validation.accuracy.measured.illuminants import ILLUMINANTS
from dermis.apps.validation.accuracy.measured.probe import APERTURES_MM
from dermis.apps.validation.pages import DOCS, RESULTS, JsonObject, fill_page, read_results
from dermis.human.skin.measured import SITES
from dermis.optics.pigments.parameters import DEFAULT_SKIN

PAGE = DOCS / "measured.md"
RESULT_FILE = RESULTS / "measured.json"
PEOPLE_FILE = RESULTS / "people.json"
"""Tables about people sampled at random, written by `python -m dermis.apps.validation.people page`."""
GROUP_LABELS = {
    "CA": "Caucasian",
    "CN": "Chinese",
    "JP": "Japanese",
    "TH": "Thai",
    "SA": "South Asian",
    "IQ": "Middle Eastern (Iraq)",
    "AB": "Middle Eastern (Arabia)",
    "AF": "African",
}
"""Names of the archive's groups on the page, by their codes."""
_ABSORPTION_LABELS = {
    "former": "absorption of [Jacques1998]",
    "half": "half of it",
    "quarter": "a quarter of it",
    "present": "default skin",
}
_MODEL_NAMES = {
    "present": "default skin",
    "former": "absorption of [Jacques1998], 0.05 mm",
    "donner": "Donner and Jensen 2006",
    "jacques": "Jacques 1998",
    "bioskin": "BioSkin 2023",
}
_CONSTANT_NAMES = {
    "baseline": "bloodless tissue",
    "epidermis_mm": "epidermis",
    "oxygen": "oxygen",
    "scattering": "scattering",
    "dermis": "dermis over epidermis",
    "small_fibres": "Rayleigh scattering",
    "eumelanin": "eumelanin",
    "vessel_mm": "vessel [mm]",
    "bandwidth_nm": "half width [nm]",
    "bilirubin": "bilirubin [1/mm]",
    "carotene": "carotene [1/mm]",
    "methaemoglobin": "methaemoglobin [1/mm]",
}


def write_measured_page() -> None:
    """Write docs/measured.md from docs/templates/measured.md and the results of the last measurement."""
    fill_page(PAGE, **measured_page_texts(read_results(RESULT_FILE)), **read_results(PEOPLE_FILE))


def measured_page_texts(results: JsonObject) -> dict[str, str]:
    """Return the tables, phrases and numbers of docs/measured.md, keyed by placeholder."""
    present = results["models"]["present"]
    return {
        "spectra": f"{results['counts']['spectra']:,}",
        "now": (
            f"{DEFAULT_SKIN.epidermis_mm:g} mm, {100 * DEFAULT_SKIN.oxygen:g} % oxygen, and "
            f"{DEFAULT_SKIN.baseline:g} of that absorption"
        ),
        "models": _models_table(results["models"]),
        **{f"oxygen_{name}": f"{100 * one:.0f} %" for name, one in results["limits"].items()},
        "surface_all": f"{results['surface']['all'][0]:.2f}",
        "surface_face": f"{results['surface']['cheek and forehead'][0]:.2f}",
        "surface_sites": f"{results['surface']['each site'][0]:.2f}",
        "site_two": _joined_numbers(results["site_folds"]["all"]),
        "site_above": f"{100 * results['site_folds']['above_2']:.0f} %",
        "site_face": f"{results['site_folds']['cheek and forehead'][0]:.2f}",
        "folds": _folds_table(results["folds"]),
        **_confounded_constant_texts(results),
        "additions": _additions_table(results["additions"]),
        "residual": _residual_table(results["models"]),
        "groups": "\n\n".join(
            [
                _category_table("group", list(GROUP_LABELS.values()), present["groups"]),
                _category_table("site", SITES, present["by_site"]),
            ]
        ),
        "sites": _sites_table(results["sites"]),
        "lights": _illuminants_table(present["lights"]),
        "alternatives": _published_models_table(results["alternatives"]),
        "edge": _edge_loss_table(results["edge"]),
        "corrected": _corrected_constants_text(results["edge"]),
        "red_loss": f"{100 * results['edge']['8 mm of 11 mm']['loss'][1][5]:.0f} %",
    }


def _models_table(errors_by_model: JsonObject) -> str:
    heads = ["skin", "spectra", "two, by colour", "above 2", "three, by colour"]
    heads += ["two, RMS", "three, RMS", "five, RMS"]
    rows = []
    for name, label in _ABSORPTION_LABELS.items():
        for subset in ("all", "cheek and forehead"):
            one = errors_by_model[name][subset]
            rows.append(
                [
                    f"**{label}**" if name == "present" else label,
                    subset,
                    _joined_numbers(one["two"]),
                    f"{100 * one['above_2']:.0f} %",
                    _joined_numbers(one["three"]),
                    *(_joined_numbers(one[f"rms_{n}"], 4) for n in ("two", "three", "five")),
                ]
            )
    return _markdown_table(heads, rows)


def _folds_table(fold_results: Sequence[JsonObject]) -> str:
    heads = ["part", "spectra", "bloodless tissue", "epidermis [mm]", "oxygen", "constants"]
    heads += ["two", "two, cheek and forehead", "three", "five, RMS"]
    rows = []
    for number, fold in enumerate(fold_results, 1):
        constants = fold["constants"]
        for label in ("fitted", "default"):
            errors = fold[label]
            constant_cells = [f"{constants[name]:.3g}" for name in ("baseline", "epidermis_mm", "oxygen")]
            rows.append(
                [
                    str(number) if label == "fitted" else "",
                    str(fold["people"]) if label == "fitted" else "",
                    *(constant_cells if label == "fitted" else [""] * 3),
                    "of the other parts" if label == "fitted" else "the package's",
                    f"{errors['two']:.2f}",
                    f"{errors['two_face']:.2f}",
                    f"{errors['three']:.2f}",
                    f"{errors['five']:.4f}",
                ]
            )
    return _markdown_table(heads, rows)


def _confounded_constant_texts(results: JsonObject) -> dict[str, str]:
    """Return texts on strongly correlated constants and on corrected spectra, keyed by placeholder.

    The text "confounded" lists pairs of constants with strongly correlated errors. The texts "wide_factor"
    and "small_factor" contain fitted factors of the absorption by bloodless tissue. Before these fits, the
    spectra were corrected for the light that the aperture of the instrument misses: a wide aperture is
    assumed for "wide_factor", a small aperture for "small_factor".
    """
    pairs = {}
    for row in results["additions"]:
        for label in ("three", "five"):
            for a, b, correlation in row.get(label, {}).get("confounded", []):
                pairs[frozenset((a, b))] = correlation
    found = [
        f"{' and '.join(sorted(_CONSTANT_NAMES[one] for one in pair))} ({correlation:+.2f})"
        for pair, correlation in pairs.items()
    ]
    edge = results["edge"]
    small, wide = (f"{edge[name]['constants']['baseline']:.2f}" for name in reversed(APERTURES_MM))
    return {
        "confounded": "; ".join(found) if found else "none above 0.85",
        "wide_factor": wide,
        "small_factor": small,
    }


def _additions_table(addition_results: Sequence[JsonObject]) -> str:
    heads = ("addition", "three unknowns, RMS", "constants", "five unknowns, RMS", "constants")
    rows = []
    for row in addition_results:
        cells = [row["name"]]
        for label in ("three", "five"):
            one = row.get(label)
            cells += ["", ""] if one is None else [f"{one['rms']:.4f}", _constants_text(one["constants"])]
        rows.append(cells)
    return _markdown_table(heads, rows)


def _constants_text(constants: dict[str, float]) -> str:
    return ", ".join(f"{_CONSTANT_NAMES[name]} {value:.3g}" for name, value in constants.items())


def _residual_table(errors_by_model: JsonObject) -> str:
    """Return a Markdown table of the mean difference of reflectance, measured minus fitted, by wavelength."""
    shown = range(0, 31, 2)
    heads = ("mean residual, 1e-4", *(f"{400 + 10 * k}" for k in shown))
    rows = [
        [
            f"{_ABSORPTION_LABELS[name]}, {count}",
            *(f"{1e4 * errors_by_model[name]['residual'][count][k]:.0f}" for k in shown),
        ]
        for name in ("former", "present")
        for count in ("two", "three", "five")
    ]
    return _markdown_table(heads, rows)


def _category_table(
    category_title: str, category_names: Sequence[str], category_rows: Sequence[Sequence[float]]
) -> str:
    cells = [
        [name, f"{count:.0f}", f"{two:.2f}", f"{three:.2f}", f"{five:.4f}"]
        for name, (count, two, three, five) in zip(category_names, category_rows, strict=True)
    ]
    return _markdown_table((category_title, "spectra", "two", "three", "five, RMS"), cells)


def _sites_table(site_results: Sequence[JsonObject]) -> str:
    heads = ("site", "epidermis, by spectrum [mm]", "oxygen", "epidermis, by colour [mm]", "oxygen", "two")
    rows = []
    for name, site in zip(SITES, site_results, strict=True):
        low, middle, high = site["oxygen"]
        rows.append(
            [
                name,
                f"{site['epidermis_mm']:.3f}",
                f"{middle:.2f} ({low:.2f} to {high:.2f})",
                f"{site['colour']['epidermis_mm']:.3f}",
                f"{site['colour']['oxygen']:.2f}",
                f"{site['two']:.2f}",
            ]
        )
    return _markdown_table(heads, rows)


def _illuminants_table(errors_by_fit: JsonObject) -> str:
    labels = {"two": "two, by colour", "three": "three, by colour", "five": "five, by spectrum"}
    rows = [
        [label, *(_joined_numbers(errors_by_fit[name][one]) for one in ILLUMINANTS)]
        for name, label in labels.items()
    ]
    return _markdown_table(("unknowns", *ILLUMINANTS), rows)


def _published_models_table(errors_by_model: JsonObject) -> str:
    heads = ("model", "two, by colour", "three, by colour", "two, RMS", "three, RMS", "five, RMS")
    rows = []
    for name, errors in errors_by_model.items():
        cells = [_joined_numbers(errors[f"colour_{n}"]) for n in (2, 3)]
        rows.append(
            [_MODEL_NAMES[name], *cells, *(_joined_numbers(errors[f"spectrum_{n}"], 4) for n in (2, 3, 5))]
        )
    return _markdown_table(heads, rows)


def _edge_loss_table(edge_results: JsonObject) -> str:
    heads = ("aperture, lit disc", "melanin", *(f"{nm:.0f} nm" for nm in edge_results["wavelength_nm"]))
    rows = [
        [name, f"{100 * melanin:g} %", *(f"{100 * one:.1f} %" for one in loss)]
        for name in APERTURES_MM
        for melanin, loss in zip(edge_results["melanin"], edge_results[name]["loss"], strict=True)
    ]
    return _markdown_table(heads, rows)


def _corrected_constants_text(edge_results: JsonObject) -> str:
    """Return text on constants fitted to the measured spectra, and to spectra corrected for edge loss."""
    parts = [
        f"{_constants_text(edge_results[name]['constants'])} (RMS {edge_results[name]['rms']:.4f}) {label}"
        for name, label in (
            ("uncorrected", "as measured"),
            ("8 mm of 11 mm", "corrected for 8 mm"),
            ("3 mm of 6 mm", "corrected for 3 mm"),
        )
    ]
    return "; ".join(parts)


def _joined_numbers(numbers: Sequence[float], digits: int = 2) -> str:
    return " / ".join(f"{one:.{digits}f}" for one in numbers)


def _markdown_table(column_titles: Sequence[str], table_rows: Iterable[Sequence[str]]) -> str:
    lines = [column_titles, ["---"] * len(column_titles), *table_rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
