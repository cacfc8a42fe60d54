"""`dermis fit`: from a photograph of a face to its light and skin."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dermis.base.console import print_json, print_lines, progress
from dermis.cli.options import Adapter, OutputPath, Json, Options, parse_colour

if TYPE_CHECKING:
    from dermis.apps.inverse.fitting.result import FitResult


def fit(
    photo: Path,
    /,
    *,
    head: str = "human",
    camera: str | None = None,
    landmarks: Path | None = None,
    output: OutputPath = Path("fitted"),
    suns: int = 1,
    exposure: float = 1.0,
    white: str = "1,1,1",
    noise: float = 0.02,
    side: int = 128,
    atlas: int = 256,
    adapter: Adapter = "auto",
    as_json: Json = False,
) -> int:
    """Find the light and the skin of a photograph: melanin, blood, roughness, gloss, sky and suns.

    The head must be of the right shape, before the camera that took the photograph. Written are scene.toml,
    which dermis render takes, with its light and person, the table fit.json, and photo, fit and difference
    as PNG. Eumelanin, oxygen and the thickness of the epidermis are held at the scene's, or else at the
    default skin's, which dermis profile --help prints.

    Examples:

        dermis fit photo.png --head human:7 --camera camera.toml -o fitted

        dermis fit photo.exr --head scene.toml --suns 2 --json

        dermis fit photo.jpg --head human --landmarks face.csv --white specular -o fitted

    Parameters
    ----------
    photo:
        Photograph: PNG, JPEG or TIFF in sRGB, or EXR (linear).
    head:
        human, human:7, a person's numbers (.json), a sample or a mesh; or a scene (.toml) with head, camera
        and pose.
    camera:
        portrait, three-quarter, profile or a TOML file with [camera]; the scene's own when left out.
    landmarks:
        Landmarks in the photograph, to find the camera by and the shape of the human: a CSV file of name,x,y
        in pixels, what dermis render --landmarks writes, or MediaPipe's as JSON.
    output:
        Folder for what is found, which is made.
    suns:
        Lights from one direction beside the light from all around: 0, 1 or 2.
    exposure:
        Factor from radiance to the photograph; the light's strength is one number with it.
    white:
        Colour of the light in the photograph as red,green,blue (linear), or specular: find it by what the
        skin's surface mirrors.
    noise:
        Standard deviation of a pixel, relative.
    side:
        Pixels along the longer side at which the photograph is fitted.
    atlas:
        Side of the atlas of the frames [texel].
    adapter:
        Which adapter computes: auto, cpu or part of a name.
    """
    from dermis.apps.inverse.fitting.fit import fit as fitted
    from dermis.apps.inverse.fitting.result import SUMMARY, save_fit
    from dermis.base.atomic_write import check_folder

    colour = white if white == "specular" else parse_colour(white, "--white")
    check_folder(output, SUMMARY)
    how: Options = {"suns": suns, "exposure": exposure, "white": colour, "noise": noise}
    how |= {"side": side, "atlas": atlas}
    with progress("fitting") as told:
        found = fitted(photo, head, camera=camera, landmarks=landmarks, adapter=adapter, told=told, **how)
    _report(found, save_fit(output, found), as_json)
    return 0


def _report(found: FitResult, written: list[Path], as_json: bool) -> None:
    told = found.summary() | {"files": [str(one) for one in written]}
    if as_json:
        print_json(told)
        return
    lines = [f"{told['pixels']} pixels of skin, {told['frames']} frames ({told['seconds']:.1f} s)"]
    for name, one in told["skin"].items():
        lines.append(f"  {name:10} {one['value']:8.4f}  known to {100 * one['relative_sd']:.0f} %")
    for k, sun in enumerate(told["suns"], start=1):
        way, off = ", ".join(f"{x:.2f}" for x in sun["towards"]), max(sun["sd_degrees"])
        lines.append(
            f"  sun {k}      towards {way} (known to {off:.1f} degrees), irradiance {sun['irradiance']:.3g}"
        )
    lines.append(f"  around     mean radiance {told['around']['mean_radiance']:.3g}")
    lines.append(f"  light      {', '.join(f'{x:.3f}' for x in told['white'])}")
    lines.append(f"  photograph and fit differ by {100 * told['residual']:.1f} % (median)")
    for name in told["not_determined"]:
        lines.append(f"  not determined: {name}, which a belief or a limit says")
    for one in told["not_told_apart"]:
        lines.append(f"  not told apart: {' and '.join(one['pair'])} (correlation {one['correlation']:.2f})")
    lines += [f"  believed: {one}" for one in told["priors"]]
    print_lines(*lines, *(f"  {one}" for one in written))
