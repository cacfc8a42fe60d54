"""The command `dermis unmix`: melanin and blood estimated from skin colour, and recolouring."""

from __future__ import annotations

import time
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from dermis.base.console import print_json, print_lines, progress_bar
from dermis.base.errors import refuse
from dermis.cli.options import AdapterOption, FlagOption, JsonOption, Options, OutputPath, drop_none
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters

if TYPE_CHECKING:
    from dermis.apps.inverse.unmixing.unmix import PigmentChange, UnmixResult


def unmix(
    colour_map: Path | None = None,
    /,
    *,
    spectra: Path | None = None,
    output: OutputPath = Path("maps"),
    melanin: str | None = None,
    blood: str | None = None,
    oxygen: float | None = None,
    eumelanin: float | None = None,
    find: Literal["none", "oxygen", "all"] = "none",
    model_oxygen: float = DEFAULT_SKIN.oxygen,
    model_eumelanin: float = DEFAULT_SKIN.eumelanin,
    epidermis_mm: float = DEFAULT_SKIN.epidermis_mm,
    surface: float = 0.0278,
    noise: float = 0.01,
    shading: FlagOption = False,
    widths: FlagOption = False,
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Estimate melanin and blood of each texel of a skin colour map, and recolour it.

    The command writes melanin.exr and blood.exr (volume fractions, as in `dermis profile`), and their
    standard deviations melanin_sd.exr and blood_sd.exr. It also writes residual.exr, the colour map divided
    by the colour of the estimated pigments. The residual contains what pigments cannot explain, such as paint
    and hair.

    With --spectra, the command instead prints the pigments for each measured reflectance spectrum in a table.

    Examples:

        dermis unmix colour.jpg -o maps

        dermis unmix colour.jpg --melanin 0.15 -o tanned

        dermis unmix colour.jpg --blood x2 --oxygen 0.3 -o cold

        dermis unmix colour.jpg --widths -o maps

        dermis unmix photographed.png --shading --find oxygen -o maps --json

        dermis unmix --spectra measured.csv --find all --json

    Parameters
    ----------
    colour_map:
        Albedo of the skin: PNG, JPEG, HEIC, TIFF, WebP or AVIF, whose EXIF orientation and colour profile are
        applied; or EXR (linear, 0 to 1).
    spectra:
        Table of measured reflectance spectra to use instead of a colour map (.csv or .csv.gz). Wavelengths
        from 400 to 700 nm are headings (400, r400, 400 nm) or the first column; values are from 0 to 1 or in
        percent.
    output:
        Folder of the maps, created if necessary.
    melanin:
        Recolour: factor on melanin, such as x2, or its new median volume fraction, such as 0.1.
    blood:
        Recolour: factor on blood, such as x2, or its new median volume fraction, such as 0.02.
    oxygen:
        Recolour: new oxygen saturation of the blood, 0 to 1.
    eumelanin:
        Recolour: new fraction of the melanin that is eumelanin, 0 to 1.
    find:
        What to estimate besides melanin and blood. oxygen: oxygen saturation, with a prior whose mean is
        --model-oxygen and whose standard deviation was measured on people; all (only with --spectra): also
        the level of scattering and the thickness of the epidermis.
    model_oxygen:
        Oxygen saturation of the skin in the colour map, 0 to 1.
    model_eumelanin:
        Eumelanin fraction of the skin in the colour map, 0 to 1.
    epidermis_mm:
        Thickness of the epidermis [mm].
    surface:
        Surface reflectance to subtract from the spectra; 0 for spectra without specular reflection [-].
    noise:
        Relative standard deviation of the colour channels, from which the uncertainty of the result follows
        [-].
    shading:
        Treat gradual changes of brightness across the map as shading: divide the colours by the shading, and
        write the shading to shading.exr.
    widths:
        Also write three diffusion profiles and their mixing map, for `dermis render --profile-map`.
    as_json:
        Print one JSON object with statistics of the maps, or with all spectra.
    """
    from dermis.apps.inverse.unmixing.profile_widths import profile_mixture, save_mixture
    from dermis.apps.inverse.unmixing.unmix import UNMIX_SUMMARY_FILE, save_maps
    from dermis.apps.inverse.unmixing.unmix import unmix as unmixed
    from dermis.base.atomic_write import check_folder

    started = time.perf_counter()
    skin = SkinParameters(oxygen=model_oxygen, eumelanin=model_eumelanin, epidermis_mm=epidermis_mm)
    if spectra is not None:
        if colour_map is not None:
            refuse("--spectra", "a table of spectra or a colour map", "got both", "Give one of them")
        map_options = drop_none(melanin=melanin, blood=blood, oxygen=oxygen, eumelanin=eumelanin)
        map_options |= {name: True for name, given in (("shading", shading), ("widths", widths)) if given}
        if map_options:
            option = f"--{next(iter(map_options))}"
            refuse(option, "a colour map", "got --spectra, which writes no maps", "Leave it out")
        return _unmix_spectra(spectra, find, skin, surface, as_json)
    if colour_map is None:
        refuse("colour map", "a file, or --spectra with a table", "got neither", "Give one of them")
    if find == "all":
        refuse("--find", "none or oxygen for a colour map", "got all", "Colours do not determine more")
    check_folder(output, UNMIX_SUMMARY_FILE)
    change = _parse_pigment_change(melanin, blood, oxygen, eumelanin)
    with progress_bar("unmixing") as report_progress:
        options: Options = {"extra_unknown": find, "noise": noise, "shading": shading, "adapter": adapter}
        result = unmixed(colour_map, skin=skin, progress=report_progress, **options)
    recoloured = None if change is None else result.recoloured(change, adapter)
    written = save_maps(output, result, recoloured, linear=colour_map.suffix.lower() in (".exr", ".hdr"))
    if widths:
        written += save_mixture(output, profile_mixture(result))
    _print_report(result, written, time.perf_counter() - started, as_json)
    return 0


def _unmix_spectra(
    path: Path,
    quantities_to_find: Literal["none", "oxygen", "all"],
    skin_parameters: SkinParameters,
    surface_reflectance: float,
    as_json: bool,
) -> int:
    """Print the pigments and residuals of each spectrum of a table."""
    from dermis.apps.inverse.unmixing.spectra_file import unmix_spectra
    from dermis.optics.pigments.spectra import WAVELENGTHS_NM

    found = unmix_spectra(path, quantities_to_find, skin_parameters, surface_reflectance)
    summary = found.summary()
    if as_json:
        wavelengths = {"wavelength_nm": WAVELENGTHS_NM.tolist()}
        print_json(summary | wavelengths | {"rows": found.rows()})
        return 0
    columns = (*found.names, "rms", "delta_e")
    lines = ["".join([f"{'row':>6}", *(f"{name:>14}" for name in columns)])]
    for row in found.rows():
        numbers = (f"{row[name]:14.4f}" if name in row else f"{'-':>14}" for name in columns)
        labels = " ".join(row["labels"].values())
        lines.append(f"{row['row']:6d}{''.join(numbers)}  {labels}".rstrip())
    medians = (f"{summary[name]['median']:14.4f}" for name in columns)
    print_lines(*lines, f"median{''.join(medians)}")
    return 0


def _parse_pigment_change(
    melanin: str | None, blood: str | None, oxygen: float | None, eumelanin: float | None
) -> PigmentChange | None:
    """Return the change of pigments that the recolouring options request; None without such options."""
    from dermis.apps.inverse.unmixing.unmix import PigmentChange, parse_fraction_change
    from dermis.base.quantities import checked_number

    values = drop_none(oxygen=oxygen, eumelanin=eumelanin)
    for name, value in values.items():
        checked_number(f"--{name}", value, 0.0, 1.0, "a fraction")
    for name, text in drop_none(melanin=melanin, blood=blood).items():
        values[name] = parse_fraction_change(f"--{name}", text)
    return PigmentChange(**values) if values else None


def _print_report(
    unmixing_result: UnmixResult, written_files: list[Path], duration_s: float, as_json: bool
) -> None:
    summary = unmixing_result.summary() | {
        "files": [str(path) for path in written_files],
        "seconds": round(duration_s, 3),
    }
    if as_json:
        print_json(summary)
        return
    height, width = unmixing_result.melanin.shape
    lines = [f"{width} x {height} texels, {100.0 * summary['skin']:.0f} % of them skin ({duration_s:.1f} s)"]
    if "melanin" in summary:
        for name in ("melanin", "blood"):
            values = summary[name]
            lines.append(
                f"  {name:8} median {values['median']:.4f}, 5 to 95 %: {values['p5']:.4f} to "
                f"{values['p95']:.4f}, standard deviation {values['sd']:.4f}, with unknown oxygen and "
                f"thickness of the epidermis {hypot(values['sd'], values['skin_sd']):.4f}"
            )
        error = summary["delta_e"]
        lines.append(f"  colour error CIEDE2000 {error['median']:.2f} (median), {error['p95']:.2f} (95 %)")
        tone = summary["skin_tone"]
        lines.append(
            f"  median colour L* {tone['L']:.1f}, a* {tone['a']:.1f}, b* {tone['b']:.1f}, ITA "
            f"{tone['ita_degrees']:.0f}°, nearest Monk {tone['monk']}, Fitzpatrick {tone['fitzpatrick']}"
        )
        lines.append(f"  ({tone['statement']})")
    print_lines(*lines, *(f"  {path}" for path in written_files))
