"""`dermis unmix`: from a picture of skin's colour to melanin and blood, and to the same skin with others."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.base.console import print_json, print_lines, progress
from dermis.cli.options import Adapter, OutputPath, Json, given
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters

if TYPE_CHECKING:
    from dermis.apps.inverse.unmixing.unmix import Change, Unmixed

_Share = Annotated[str | None, Parameter(show_default=False)]


def unmix(
    colour_map: Path,
    /,
    *,
    output: OutputPath = Path("maps"),
    melanin: _Share = None,
    blood: _Share = None,
    oxygen: float | None = None,
    eumelanin: float | None = None,
    find: Literal["none", "oxygen"] = "none",
    model_oxygen: float = DEFAULT_SKIN.oxygen,
    model_eumelanin: float = DEFAULT_SKIN.eumelanin,
    epidermis_mm: float = DEFAULT_SKIN.epidermis_mm,
    noise: float = 0.01,
    shading: Annotated[bool, Parameter(negative="")] = False,
    widths: Annotated[bool, Parameter(negative="")] = False,
    adapter: Adapter = "auto",
    as_json: Json = False,
) -> int:
    """Find the melanin and blood of each texel of a picture of skin's colour, and recolour it.

    Written are melanin.exr and blood.exr (shares of the volume, as dermis profile takes them), how well each
    can be known (melanin_sd.exr, blood_sd.exr), and residual.exr: the colour over that of the model, which
    holds paint, hair, and all else that is no such skin.

    Examples:

        dermis unmix colour.jpg -o maps

        dermis unmix colour.jpg --melanin 0.15 -o tanned

        dermis unmix colour.jpg --blood x2 --oxygen 0.3 -o cold

        dermis unmix colour.jpg --widths -o maps

        dermis unmix photographed.png --shading --find oxygen -o maps --json

    Parameters
    ----------
    colour_map:
        Albedo of skin: PNG, JPEG or TIFF in sRGB, or EXR (linear, 0 to 1).
    output:
        Folder for the maps, which is made.
    melanin:
        Recolour: x2 for twice as much, 0.1 for a median of that share of the volume.
    blood:
        Recolour: likewise.
    oxygen:
        Recolour: share of the haemoglobin that carries oxygen, 0 to 1.
    eumelanin:
        Recolour: share of the melanin that is brown to black, 0 to 1.
    find:
        oxygen: find that too, as far as colour tells; 0.1 around the model's is held likely.
    model_oxygen:
        Of the skin in the picture, 0 to 1.
    model_eumelanin:
        Of the skin in the picture, 0 to 1.
    epidermis_mm:
        Thickness of its epidermis [mm].
    noise:
        Standard deviation of a channel, relative; what is known of melanin and blood follows from it.
    shading:
        Take slow changes of brightness for light, and divide by them; shading.exr has them.
    widths:
        Write three diffusion profiles and the map that mixes them, for dermis render --profile-map.
    adapter:
        Which adapter computes: auto, cpu or part of a name.
    """
    from dermis.apps.inverse.unmixing.profile_widths import save_widths, widths_of
    from dermis.apps.inverse.unmixing.unmix import SUMMARY, save_maps
    from dermis.apps.inverse.unmixing.unmix import unmix as unmixed
    from dermis.base.atomic_write import check_folder

    started = time.perf_counter()
    check_folder(output, SUMMARY)
    change = _change(melanin, blood, oxygen, eumelanin)
    skin = SkinParameters(oxygen=model_oxygen, eumelanin=model_eumelanin, epidermis_mm=epidermis_mm)
    with progress("unmixing") as told:
        found = unmixed(
            colour_map,
            skin=skin,
            third=find,
            noise=noise,
            shading=shading,
            adapter=adapter,
            told=told,
        )
    recoloured = None if change is None else found.recoloured(change, adapter)
    written = save_maps(output, found, recoloured, linear=colour_map.suffix.lower() in (".exr", ".hdr"))
    if widths:
        written += save_widths(output, widths_of(found))
    _report(found, written, time.perf_counter() - started, as_json)
    return 0


def _change(
    melanin: str | None, blood: str | None, oxygen: float | None, eumelanin: float | None
) -> Change | None:
    """Return the change of colour that was typed, None for none."""
    from dermis.apps.inverse.unmixing.unmix import Change, parse_share
    from dermis.base.quantities import number

    changed = given(oxygen=oxygen, eumelanin=eumelanin)
    for name, value in changed.items():
        number(f"--{name}", value, 0.0, 1.0, "a share")
    for name, words in given(melanin=melanin, blood=blood).items():
        changed[name] = parse_share(f"--{name}", words)
    return Change(**changed) if changed else None


def _report(found: Unmixed, written: list[Path], seconds: float, as_json: bool) -> None:
    told = found.summary() | {"files": [str(one) for one in written], "seconds": round(seconds, 3)}
    if as_json:
        print_json(told)
        return
    height, width = found.melanin.shape
    lines = [f"{width} x {height} texels, {100.0 * told['skin']:.0f} % of them like skin ({seconds:.1f} s)"]
    if "melanin" in told:
        for name in ("melanin", "blood"):
            one = told[name]
            lines.append(
                f"  {name:8} median {one['median']:.4f}, 5 to 95 %: {one['p5']:.4f} to {one['p95']:.4f}, "
                f"known to {one['sd']:.4f}"
            )
        off = told["delta_e"]
        apart = f"{off['median']:.2f} (median), {off['p95']:.2f} (95 %)"
        lines.append(f"  the model's colours are off by CIEDE2000 {apart}")
    lines += [f"  {one}" for one in written]
    print_lines(*lines)
