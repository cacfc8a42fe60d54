"""The command `dermis unmix`: melanin and blood from skin colour, and recolouring."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from dermis.base.console import print_json, print_lines, progress_bar
from dermis.cli.options import AdapterOption, FlagOption, JsonOption, Options, OutputPath, drop_none
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters

if TYPE_CHECKING:
    from dermis.apps.inverse.unmixing.unmix import PigmentChange, UnmixResult


def unmix(
    colour_map: Path,
    /,
    *,
    output: OutputPath = Path("maps"),
    melanin: str | None = None,
    blood: str | None = None,
    oxygen: float | None = None,
    eumelanin: float | None = None,
    find: Literal["none", "oxygen"] = "none",
    model_oxygen: float = DEFAULT_SKIN.oxygen,
    model_eumelanin: float = DEFAULT_SKIN.eumelanin,
    epidermis_mm: float = DEFAULT_SKIN.epidermis_mm,
    noise: float = 0.01,
    shading: FlagOption = False,
    widths: FlagOption = False,
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Estimate melanin and blood of each texel of a skin colour map, and recolour it.

    The command writes melanin.exr and blood.exr (volume fractions, as in `dermis profile`), their standard
    deviations melanin_sd.exr and blood_sd.exr, and residual.exr, the ratio of the colour map to the model
    colour, which contains paint, hair and everything else that is not such skin.

    Examples:

        dermis unmix colour.jpg -o maps

        dermis unmix colour.jpg --melanin 0.15 -o tanned

        dermis unmix colour.jpg --blood x2 --oxygen 0.3 -o cold

        dermis unmix colour.jpg --widths -o maps

        dermis unmix photographed.png --shading --find oxygen -o maps --json

    Parameters
    ----------
    colour_map:
        Albedo of the skin: PNG, JPEG, HEIC, TIFF, WebP or AVIF, turned by its EXIF and converted by its
        colour profile; or EXR (linear, 0 to 1).
    output:
        Folder of the maps, created if necessary.
    melanin:
        Recolour: a factor such as x2, or the new median volume fraction such as 0.1.
    blood:
        Recolour: a factor such as x2, or the new median volume fraction such as 0.02.
    oxygen:
        Recolour: new oxygen saturation of the blood, 0 to 1.
    eumelanin:
        Recolour: new fraction of the melanin that is eumelanin, 0 to 1.
    find:
        oxygen: estimate the oxygen saturation too, with a prior of standard deviation 0.1 around
        --model-oxygen.
    model_oxygen:
        Oxygen saturation of the skin in the colour map, 0 to 1.
    model_eumelanin:
        Eumelanin fraction of the skin in the colour map, 0 to 1.
    epidermis_mm:
        Thickness of the epidermis [mm].
    noise:
        Relative standard deviation of the colour channels, which determines the uncertainty of the result
        [-].
    shading:
        Treat slow changes of brightness as shading and divide by them; written as shading.exr.
    widths:
        Also write three diffusion profiles and their mixing map, for `dermis render --profile-map`.
    as_json:
        Print one JSON object with statistics of the maps.
    """
    from dermis.apps.inverse.unmixing.profile_widths import profile_mixture, save_mixture
    from dermis.apps.inverse.unmixing.unmix import UNMIX_SUMMARY_FILE, save_maps
    from dermis.apps.inverse.unmixing.unmix import unmix as unmixed
    from dermis.base.atomic_write import check_folder

    started = time.perf_counter()
    check_folder(output, UNMIX_SUMMARY_FILE)
    change = _parse_change(melanin, blood, oxygen, eumelanin)
    skin = SkinParameters(oxygen=model_oxygen, eumelanin=model_eumelanin, epidermis_mm=epidermis_mm)
    with progress_bar("unmixing") as report_progress:
        options: Options = {"third": find, "noise": noise, "shading": shading, "adapter": adapter}
        result = unmixed(colour_map, skin=skin, progress=report_progress, **options)
    recoloured = None if change is None else result.recoloured(change, adapter)
    written = save_maps(output, result, recoloured, linear=colour_map.suffix.lower() in (".exr", ".hdr"))
    if widths:
        written += save_mixture(output, profile_mixture(result))
    _print_report(result, written, time.perf_counter() - started, as_json)
    return 0


def _parse_change(
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


def _print_report(result: UnmixResult, written: list[Path], seconds: float, as_json: bool) -> None:
    summary = result.summary() | {"files": [str(path) for path in written], "seconds": round(seconds, 3)}
    if as_json:
        print_json(summary)
        return
    height, width = result.melanin.shape
    lines = [f"{width} x {height} texels, {100.0 * summary['skin']:.0f} % of them skin ({seconds:.1f} s)"]
    if "melanin" in summary:
        for name in ("melanin", "blood"):
            values = summary[name]
            lines.append(
                f"  {name:8} median {values['median']:.4f}, 5 to 95 %: {values['p5']:.4f} to "
                f"{values['p95']:.4f}, standard deviation {values['sd']:.4f}"
            )
        error = summary["delta_e"]
        lines.append(f"  colour error CIEDE2000 {error['median']:.2f} (median), {error['p95']:.2f} (95 %)")
    print_lines(*lines, *(f"  {path}" for path in written))
