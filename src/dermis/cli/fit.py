"""The command `dermis fit`: light and skin from a photograph of a face."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dermis.base.console import print_json, print_lines, progress_bar
from dermis.cli.options import AdapterOption, JsonOption, Options, OutputPath, parse_colour

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
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Estimate the light and the skin in a photograph: melanin, blood, roughness, gloss, sky and suns.

    The head must have the shape of the person, and the camera must match the photograph. The command writes
    the estimated light and skin to scene.toml (for `dermis render`) and fit.json, and the photograph, the
    fitted picture and their difference as PNG. Eumelanin, oxygenation and epidermis thickness are not
    estimated: they have the values of the scene, or else the defaults that `dermis profile --help` prints.

    Examples:

        dermis fit photo.png --head human:7 --camera camera.toml -o fitted

        dermis fit photo.exr --head scene.toml --suns 2 --json

        dermis fit photo.jpg --head human --landmarks face.csv --white specular -o fitted

    Parameters
    ----------
    photo:
        Photograph: JPEG, HEIC, PNG, TIFF, WebP or AVIF, whose EXIF orientation and colour profile are
        applied; or EXR or HDR (linear).
    head:
        Head of the person: human, human:SEED, a person (.json), a sample or a mesh file; or a scene (.toml)
        with head, camera and pose.
    camera:
        Camera of the photograph: portrait, three-quarter, profile or a TOML file with [camera]. [default:
        camera of the scene]
    landmarks:
        File with landmarks in the photograph, from which the camera and the shape of the human are estimated:
        a table of name,x,y or x,y [pixel], a .pts file of iBUG, the output of `dermis render --landmarks`, or
        JSON of MediaPipe.
    output:
        Folder of the results, created if necessary.
    suns:
        Number of directional lights in addition to the environment: 0, 1 or 2.
    exposure:
        Factor from radiance to pixel value. A photograph only determines the product of this factor and the
        intensity of the light.
    white:
        Colour of the light as linear red,green,blue; or the word specular to estimate it from specular
        highlights.
    noise:
        Relative standard deviation of the pixel values [-].
    side:
        Length to which the longer side of the photograph is reduced for the fit [pixel].
    atlas:
        Side of the atlas of the rendered frames [texel].
    as_json:
        Print one JSON object with the estimates and their uncertainties.
    """
    from dermis.apps.inverse.fitting.fit import fit as fitted
    from dermis.apps.inverse.fitting.result import FIT_SUMMARY_FILE, save_fit
    from dermis.base.atomic_write import check_folder

    colour = white if white == "specular" else parse_colour(white, "--white")
    check_folder(output, FIT_SUMMARY_FILE)
    options: Options = {"camera": camera, "landmarks": landmarks, "adapter": adapter, "suns": suns}
    options |= {"exposure": exposure, "white": colour, "noise": noise, "side": side, "atlas": atlas}
    with progress_bar("fitting") as report_progress:
        result = fitted(photo, head, progress=report_progress, **options)
    _print_report(result, save_fit(output, result), as_json)
    return 0


def _print_report(fit_result: FitResult, written_files: list[Path], as_json: bool) -> None:
    summary = fit_result.summary() | {"files": [str(path) for path in written_files]}
    if as_json:
        print_json(summary)
        return
    lines = [f"{summary['pixels']} pixels of skin, {summary['frames']} frames ({summary['seconds']:.1f} s)"]
    for name, value in summary["skin"].items():
        lines.append(f"  {name:10} {value['value']:8.4f}  ± {100 * value['relative_sd']:.0f} %")
    for k, sun in enumerate(summary["suns"], start=1):
        direction, sd = ", ".join(f"{x:.2f}" for x in sun["towards"]), max(sun["sd_degrees"])
        light = f"(± {sd:.1f} degrees), irradiance {sun['irradiance']:.3g}"
        lines.append(f"  sun {k}      towards {direction} {light}")
    lines.append(f"  sky        mean radiance {summary['around']['mean_radiance']:.3g}")
    lines.append(f"  white      {', '.join(f'{x:.3f}' for x in summary['white'])}")
    lines.append(f"  median difference of photograph and fit {100 * summary['residual']:.1f} %")
    for name in summary["not_determined"]:
        lines.append(f"  not determined by the photograph: {name} (from a prior or a limit)")
    for row in summary["not_told_apart"]:
        lines.append(f"  not separable: {' and '.join(row['pair'])} (correlation {row['correlation']:.2f})")
    lines += [f"  prior: {prior}" for prior in summary["priors"]]
    print_lines(*lines, *(f"  {path}" for path in written_files))
