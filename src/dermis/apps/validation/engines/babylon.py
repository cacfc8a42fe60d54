"""Edge responses of exported skin in Babylon.js: light scattered across the edge of a half-lit plane.

Headless Chromium draws the plane.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import cumulative_burley_profile, fit_burley_width
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.subject import load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.babylon.target import RENDERED_WIDTH_RATIO, spiral_samples
from dermis.apps.validation.pages import RESULTS, JsonObject, chromium_page, write_results
from dermis.base.errors import refuse

if TYPE_CHECKING:
    from playwright.sync_api import Page

PAGE_FILE = Path(__file__).with_name("babylon.html")
RESULTS_FILE = RESULTS / "engines_babylon.json"
LIBRARY_FOLDER_VARIABLE = "DERMIS_BABYLON"
CANVAS_SIDE, FULLY_LIT_RADIANCE = 640, 0.9
PIXELS_PER_BURLEY_WIDTH = 14.0  # number of pixels that the largest Burley width covers
AZIMUTH_COUNT = 5
Floats = NDArray[np.floating]


def babylon_library() -> Path:
    """Return the npm folder that contains Babylon.js.

    Raises DermisError when DERMIS_BABYLON does not name such a folder.
    """
    folder = Path(os.environ.get(LIBRARY_FOLDER_VARIABLE, ""))
    if not (folder / "babylonjs" / "babylon.js").is_file():
        actual = (
            f"{folder} has no babylonjs/babylon.js"
            if os.environ.get(LIBRARY_FOLDER_VARIABLE)
            else "it is not set"
        )
        refuse(
            LIBRARY_FOLDER_VARIABLE,
            "a folder that npm has installed babylonjs into",
            actual,
            "npm install babylonjs",
        )
    return folder


@contextmanager
def babylon_page(library_folder: Path) -> Iterator[Page]:
    """Open the measurement page with Babylon.js in Chromium for the duration of a context."""
    with chromium_page(CANVAS_SIDE) as page:
        page.goto(PAGE_FILE.as_uri())
        page.add_script_tag(path=str(library_folder / "babylonjs" / "babylon.js"))
        yield page


def measured_radiance(
    page: Page, profile_colour: Floats, meters_per_unit: float, pixel_mm: float, azimuth: float
) -> Floats:
    """Return the radiance (side, side, 3) of a half-lit plane in Babylon.js, relative to a fully lit plane.

    Row 0 is at the bottom.

    profile_colour : colour by which Babylon.js describes the diffusion profile
    meters_per_unit : value of the setting metersPerUnit of Babylon.js; the scene is in millimetres
    pixel_mm : size of a pixel [mm]
    azimuth : angle in the picture from the x axis to the direction that points from the edge of the lit half,
        perpendicular to this edge, into the lit half [rad]
    """
    edge = {
        "colour": list(map(float, profile_colour)),
        "metersPerUnit": meters_per_unit,
        "pixel": pixel_mm,
        "turn": azimuth,
    }
    data = base64.b64decode(page.evaluate("(edge) => drawEdge(edge)", edge))
    levels = np.frombuffer(data, np.uint8).reshape(CANVAS_SIDE, CANVAS_SIDE, 4)[..., :3]
    return levels / (255.0 * FULLY_LIT_RADIANCE)


def predicted_radiance(
    profile_colour: Floats, meters_per_unit: float, pixel_mm: float, azimuth: float
) -> Floats:
    """Return the radiance (side, side, 3) that Babylon.js is predicted to draw for a half-lit plane.

    The radiance is relative to that of a fully lit plane. The prediction uses the positions at which the
    shader of Babylon.js samples the light; these positions are rounded to whole pixels.

    profile_colour : colour by which Babylon.js describes the diffusion profile
    meters_per_unit : value of the setting metersPerUnit of Babylon.js; the scene is in millimetres
    pixel_mm : size of a pixel [mm]
    azimuth : angle in the picture from the x axis to the direction that points from the edge of the lit half,
        perpendicular to this edge, into the lit half [rad]
    """
    r, angle, weight = spiral_samples(profile_colour)
    distance = RENDERED_WIDTH_RATIO * 1e-3 * r / meters_per_unit / pixel_mm
    right, upwards = np.round(distance * np.cos(angle)), np.round(distance * np.sin(angle))
    middle = np.arange(CANVAS_SIDE) + 0.5 - 0.5 * CANVAS_SIDE
    radiance = np.zeros((CANVAS_SIDE, CANVAS_SIDE, 3))
    for k in range(len(r)):
        x, y = middle[None, :] + right[k], middle[:, None] + upwards[k]
        radiance += (x * np.cos(azimuth) + y * np.sin(azimuth) > 0.0)[..., None] * weight[k]
    return radiance


def edge_profile(
    picture: Floats, pixel_mm: float, azimuth: float, edge_distance_mm: Floats, half_width_mm: float
) -> Floats:
    """Return the mean radiance (n, 3) at distances from the edge of the lit half, in a strip across the edge.

    picture : (side, side, 3) radiance
    pixel_mm : size of a pixel [mm]
    azimuth : angle in the picture from the x axis to the direction that points from the edge, perpendicular
        to this edge, into the lit half [rad]
    edge_distance_mm : (n,) evenly spaced distances from the edge, positive on the lit side [mm]
    half_width_mm : half the width of the strip [mm]
    """
    middle = (np.arange(CANVAS_SIDE) + 0.5 - 0.5 * CANVAS_SIDE) * pixel_mm
    x, y = middle[None, :], middle[:, None]
    across = x * np.cos(azimuth) + y * np.sin(azimuth)
    strip = np.abs(y * np.cos(azimuth) - x * np.sin(azimuth)) < half_width_mm
    bins = np.round(
        (across[strip] - edge_distance_mm[0]) / (edge_distance_mm[1] - edge_distance_mm[0])
    ).astype(int)
    inside = (bins >= 0) & (bins < len(edge_distance_mm))
    count = np.bincount(bins[inside], minlength=len(edge_distance_mm))
    sums = [np.bincount(bins[inside], picture[strip][inside, c], len(edge_distance_mm)) for c in range(3)]
    return np.stack(sums, axis=-1) / np.maximum(count, 1)[:, None]


def edge_responses(
    page: Page, profile_colour: Floats, meters_per_unit: float, burley_width_mm: Floats
) -> JsonObject:
    """Measure the edge response of a diffusion profile in Babylon.js, and compare it with predictions.

    An edge response is the radiance of a half-lit plane by distance from the edge of the lit half. Here it is
    averaged over several orientations of the edge in the picture. The predictions come from the samples of
    Babylon.js's shader and from exact Burley profiles.

    profile_colour : colour by which Babylon.js describes the diffusion profile
    meters_per_unit : value of the setting metersPerUnit of Babylon.js; the scene is in millimetres
    burley_width_mm : (3,) widths of the Burley profiles, by channel [mm]
    """
    widest = float(burley_width_mm.max())
    pixel = widest / PIXELS_PER_BURLEY_WIDTH
    x = np.arange(-84, 85) * pixel  # to 6 d
    profiles = []
    for azimuth in np.arange(AZIMUTH_COUNT) * 2.0 * np.pi / AZIMUTH_COUNT + 0.1:
        canvas = profile_colour, meters_per_unit, pixel, azimuth
        pictures = measured_radiance(page, *canvas), predicted_radiance(*canvas)
        profiles.append([edge_profile(one, pixel, azimuth, x, 3.0 * widest) for one in pictures])
    largest = max(float(np.abs(one - other).max()) for one, other in profiles)
    measured, predicted = np.mean(profiles, axis=0)
    true = cumulative_burley_profile(burley_width_mm, np.ones(3)).edge_response(x)
    near = np.abs(x)[:, None] <= 6.0 * burley_width_mm
    step = slice(0, None, 7)
    return {
        "colour": np.round(profile_colour, 5).tolist(),
        "metersPerUnit_mm": round(1e3 * meters_per_unit, 5),
        "expected_d_mm": np.round(burley_width_mm, 5).tolist(),
        "fitted_d_mm": fitted_widths(x, measured),
        "x_mm": np.round(x[step], 4).tolist(),
        "edge": np.round(measured[step], 4).tolist(),
        "predicted": np.round(predicted[step], 4).tolist(),
        "measured_less_predicted": _max_by_channel(measured - predicted, near),
        "measured_less_predicted_in_one_direction": round(largest, 4),
        "measured_less_lobes": _max_by_channel(measured - true, near),
    }


def _max_by_channel(difference: Floats, is_near_edge: NDArray[np.bool_]) -> list[float]:
    return [round(float(x), 4) for x in np.abs(difference * is_near_edge).max(axis=0)]


def fitted_widths(edge_distance_mm: Floats, edge_response: Floats) -> list[float]:
    """Return the width of the Burley profile that fits the measured edge response best, by channel [mm].

    edge_distance_mm : (n,) distances from the edge
    edge_response : (n, 3) measured edge responses
    """
    widths = np.geomspace(edge_distance_mm[-1] / 600.0, edge_distance_mm[-1], 241)
    curves = [
        cumulative_burley_profile(np.full(3, d), np.ones(3)).edge_response(edge_distance_mm)[:, 0]
        for d in widths
    ]
    error = ((np.stack(curves)[:, :, None] - edge_response) ** 2).sum(axis=1)
    return [round(float(d), 4) for d in widths[error.argmin(axis=0)]]


def measure_exported_skin(page: Page, skin_name: str) -> JsonObject:
    """Return results of `edge_responses` for an exported skin, and errors against the skin's own profile."""
    subject, target = load_subject(skin_name), TARGETS["babylon"].with_variant(None)
    rows = target.parameters(subject, target.resolve_version(None))
    colour = np.array(get_numbers(rows, "subSurface.scatteringDiffusionProfile"))
    metres = 1e-3 * get_numbers(rows, "subSurfaceConfiguration.metersPerUnit")[0]
    d_mm = fit_burley_width(subject.curve)
    responses = edge_responses(page, colour, metres, d_mm)
    x = np.array(responses["x_mm"])
    difference = np.array(responses["edge"]) - subject.curve.edge_response(x)
    error = _max_by_channel(difference, np.abs(x)[:, None] <= 6.0 * d_mm)
    return responses | {"measured_less_profile": error}


DIFFUSION_COLOURS = {"white": (1, 1, 1), "grey": (0.5, 0.5, 0.5), "coloured": (1, 0.5, 0.25)}


def measure_babylon() -> None:
    """Measure light across the edge of a half-lit plane; write benchmarks/results/engines_babylon.json.

    The environment variable DERMIS_BABYLON names the folder into which npm has installed the package
    babylonjs. Chromium draws with its software WebGL.
    """
    with babylon_page(babylon_library()) as page:
        plain = {
            name: edge_responses(page, np.array(colour), 1e-3, RENDERED_WIDTH_RATIO / np.array(colour))
            for name, colour in DIFFUSION_COLOURS.items()
        }
        skins = {name: measure_exported_skin(page, name) for name in ("skin1", "skin2", "dj3")}
        engine = "babylonjs " + page.evaluate("BABYLON.Engine.Version")
    settings = {"engine": engine, "turns": AZIMUTH_COUNT, "samples": 40, "noise": 0.002}
    write_results(RESULTS_FILE, settings | {"plain": plain, "skins": skins})
