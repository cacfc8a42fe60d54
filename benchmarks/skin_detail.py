"""Measure the detail of the skin of cheeks of two humans and of a scan, in identical light.

A crop of 24 mm of the cheek that faces the window of the light preset "window" is rendered at 0.1 mm per
pixel. Its colours are divided by the colour of the window and scaled to a mean L* of 60. The standard
deviations of lightness and of a* in bands of spatial wavelengths are computed in CIELAB. docs/detail.md
states the figures.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

import dermis
from dermis import Human
from dermis.apps.validation.pages import DOCS, RESULTS, JsonObject, fill_page, read_results, write_results
from dermis.base.arrays import Doubles
from dermis.base.command_line import run_script
from dermis.base.console import print_lines
from dermis.frame.renderer import Renderer
from dermis.images.colour import encode_srgb8, lab, luminance
from dermis.images.io import write_png
from dermis.mesh.head import Head
from dermis.scene.lights import preset_lights

RESULTS_FILE, PAGE = RESULTS / "skin_detail.json", DOCS / "detail.md"
SCAN = "lee_perry_smith"
HUMANS: dict[str, Human] = {"human": Human(), "human, Caucasian": Human(caucasian=1, asian=0, african=0)}
CROP_MM, PIXEL_MM = 24.0, 0.1
MEAN_LIGHTNESS = 60.0
"""Mean L* to which a crop is scaled, because the standard deviations of L* and a* grow with exposure."""
BANDS: dict[str, tuple[int, float, float]] = {
    "lightness, 0.4 to 1.6 mm": (0, 0.4, 1.6),
    "lightness, 1.6 to 6.4 mm": (0, 1.6, 6.4),
    "a*, 0.4 to 1.6 mm": (1, 0.4, 1.6),
    "a*, 1.6 to 6.4 mm": (1, 1.6, 6.4),
}
"""Channel of CIELAB (0 for L*, 1 for a*) and limits of the spatial wavelengths of each band [mm]."""
COMPARED_BANDS = "lightness, 0.4 to 1.6 mm", "a*, 1.6 to 6.4 mm"
_LIGHTS = "window"
_CHEEK_MM, _AZIMUTH_DEGREES, _DISTANCE_MM = (-40.0, -35.0), -20.0, 400.0


def main(
    *heads: str,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = RESULTS_FILE,
    crops: Path | None = None,
    atlas: int = 4096,
    adapter: str = "auto",
    page: bool = False,
) -> int:
    """Measure heads, or write the page from the last measurement.

    Parameters
    ----------
    heads:
        Names of heads, such as human:7. [default: two humans and the scan]
    output:
        JSON file with the figures.
    crops:
        Folder to which the crops are written as PNG.
    atlas:
        Side of the atlas and of the painted maps [texel].
    page:
        Write docs/detail.md from the last measurement, and measure nothing.
    """
    if page:
        fill_page(PAGE, **page_texts(read_results(RESULTS_FILE)))
        return 0
    renderer = Renderer(adapter)
    found: JsonObject = {"adapter": renderer.device.adapter.name, "atlas": atlas, "heads": {}}
    for name in heads or (*HUMANS, SCAN):
        person = HUMANS.get(name)
        head = dermis.load_head(name, subdivide=1) if person is None else person.head()
        linear = cheek_crop(renderer, head, atlas)
        found["heads"][name] = crop_figures(linear)
        print_lines(f"{name}: {found['heads'][name]}")
        if crops is not None:
            crops.mkdir(parents=True, exist_ok=True)
            file_name = re.sub(r"\W+", "_", name)
            write_png(crops / f"{file_name}.png", encode_srgb8(with_mean_lightness(linear)))
    write_results(output, found, 3)
    return 0


def cheek_crop(renderer: Renderer, head: Head, atlas: int) -> Doubles:
    """Return linear colours (n, n, 3) of a crop of the right cheek, divided by the colour of the window."""
    focus = np.array(head.frontmost_point_mm(*_CHEEK_MM))
    angle = np.radians(_AZIMUTH_DEGREES)
    position = focus + _DISTANCE_MM * np.array([np.sin(angle), 0.0, np.cos(angle)])
    axes = head.front_view_axes
    camera = dermis.Camera(
        position=tuple(position @ axes), target=tuple(focus @ axes), up=tuple(axes[1]), frame_mm=CROP_MM
    )
    lights = preset_lights(_LIGHTS)
    side = round(CROP_MM / PIXEL_MM)
    settings = dermis.Settings(size=(side, side), atlas=atlas, strands=False)
    drawn = renderer.draw(dermis.Scene(head, camera=camera, lights=lights), settings).linear()
    white = np.array(lights[0].irradiance)
    return np.asarray(drawn.astype(float) / (white / luminance(white)))


def with_mean_lightness(linear: Doubles) -> Doubles:
    """Return linear colours, multiplied by a factor such that their mean L* is `MEAN_LIGHTNESS`."""
    factor = 1.0
    for _ in range(20):  # L* + 16 is proportional to the cube root of the exposure
        mean = lab(factor * linear)[..., 0].mean()
        factor *= ((MEAN_LIGHTNESS + 16.0) / (mean + 16.0)) ** 3
    return factor * linear


def crop_figures(linear: Doubles) -> JsonObject:
    """Return hue [degrees], chroma, and the standard deviation in each band, of a crop of linear colours."""
    colours = lab(with_mean_lightness(linear))
    a, b = colours[..., 1].mean(), colours[..., 2].mean()
    bands = {name: band_deviation(colours[..., one], low, high) for name, (one, low, high) in BANDS.items()}
    return {"hue": float(np.degrees(np.arctan2(b, a))), "chroma": float(np.hypot(a, b)), **bands}


def band_deviation(channel: Doubles, shortest_mm: float, longest_mm: float) -> float:
    """Return the standard deviation of a channel (n, n) in a band of spatial wavelengths.

    A quadratic trend, which is shading by the shape of the face, is subtracted, and a Hann window avoids the
    jump between opposite sides.
    """
    y, x = (np.indices(channel.shape) / (np.array(channel.shape)[:, None, None] - 1.0) - 0.5).reshape(2, -1)
    basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    rest = channel.ravel() - basis @ np.linalg.lstsq(basis, channel.ravel(), rcond=None)[0]
    window = np.outer(np.hanning(channel.shape[0]), np.hanning(channel.shape[1]))
    spectrum = np.fft.rfft2(rest.reshape(channel.shape) * window)
    frequency = np.hypot(
        np.fft.fftfreq(channel.shape[0], PIXEL_MM)[:, None], np.fft.rfftfreq(channel.shape[1], PIXEL_MM)
    )
    inside = (frequency >= 1.0 / longest_mm) & (frequency < 1.0 / shortest_mm)
    filtered = np.fft.irfft2(spectrum * inside, channel.shape)
    return float(np.sqrt((filtered**2).sum() / (window**2).sum()))


def page_texts(results: JsonObject) -> dict[str, object]:
    """Return the texts of docs/templates/detail.md, keyed by placeholder."""
    heads = results["heads"]
    lines = ["| | " + " | ".join(heads) + " |", "| --- |" + " --- |" * len(heads)]
    for name, unit in {"hue": " [degrees]", "chroma": "", **dict.fromkeys(BANDS, "")}.items():
        digits = 1 if name in ("hue", "chroma") else 2
        cells = " | ".join(f"{one[name]:.{digits}f}" for one in heads.values())
        lines.append(f"| {name}{unit} | {cells} |")
    scan = heads[SCAN]
    worst = max(abs(one[name] / scan[name] - 1.0) for one in heads.values() for name in COMPARED_BANDS)
    common = {"adapter": results["adapter"], "atlas": results["atlas"]}
    return common | {"figures": "\n".join(lines), "difference": f"{worst:.0%}".replace("%", " %")}


if __name__ == "__main__":
    run_script(main)
