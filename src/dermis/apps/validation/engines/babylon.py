"""Edges of light on exported skin in Babylon.js itself, a half-lit plane in headless Chromium."""

from __future__ import annotations

import base64
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import burley_curve, fit_burley_width
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.subject import load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.babylon.target import WIDTH_ERROR, spiral_samples
from dermis.apps.validation.pages import RESULTS, JsonObject, chromium_page, write_results
from dermis.base.errors import refuse

if TYPE_CHECKING:
    from playwright.sync_api import Page

PAGE = Path(__file__).with_name("babylon.html")
FIGURES = RESULTS / "engines_babylon.json"
LIBRARY = "DERMIS_BABYLON"
CANVAS_SIDE, PIXELS_PER_WIDTH, LIT_RADIANCE = 640, 14.0, 0.9  # of the canvas; in the widest d; radiance of what is lit
DIRECTION_COUNT = 5
Floats = NDArray[np.floating]


def babylon_library() -> Path:
    """Return the folder of the library.

    Raises DermisError when DERMIS_BABYLON names none.
    """
    folder = Path(os.environ.get(LIBRARY, ""))
    if not (folder / "babylonjs" / "babylon.js").is_file():
        actual = f"{folder} has no babylonjs/babylon.js" if os.environ.get(LIBRARY) else "it is not set"
        refuse(LIBRARY, "a folder that npm has installed babylonjs into", actual, "npm install babylonjs")
    return folder


@contextmanager
def babylon_page(library: Path) -> Iterator[Page]:
    """Open the page with the library loaded."""
    with chromium_page(CANVAS_SIDE) as page:
        page.goto(PAGE.as_uri())
        page.add_script_tag(path=str(library / "babylonjs" / "babylon.js"))
        yield page


def measured_radiance(page: Page, colour: Floats, metres: float, pixel: float, turn: float) -> Floats:
    """Return (SIDE, SIDE, 3) radiance of the canvas over that of lit parts, rows from below."""
    told = {"colour": list(map(float, colour)), "metersPerUnit": metres, "pixel": pixel, "turn": turn}
    data = base64.b64decode(page.evaluate("(told) => drawEdge(told)", told))
    levels = np.frombuffer(data, np.uint8).reshape(CANVAS_SIDE, CANVAS_SIDE, 4)[..., :3]
    return levels / (255.0 * LIT_RADIANCE)


def predicted_radiance(colour: Floats, metres: float, pixel: float, turn: float) -> Floats:
    """Return the same by the shader's samples, rounded to pixels; metersPerUnit is of scenes in mm."""
    r, angle, weight = spiral_samples(colour)
    across = WIDTH_ERROR * 1e-3 * r / metres / pixel
    right, upwards = np.round(across * np.cos(angle)), np.round(across * np.sin(angle))
    middle = np.arange(CANVAS_SIDE) + 0.5 - 0.5 * CANVAS_SIDE
    told = np.zeros((CANVAS_SIDE, CANVAS_SIDE, 3))
    for one in range(len(r)):
        x, y = middle[None, :] + right[one], middle[:, None] + upwards[one]
        told += (x * np.cos(turn) + y * np.sin(turn) > 0.0)[..., None] * weight[one]
    return told


def edge_profile(picture: Floats, pixel: float, turn: float, at_mm: Floats, half_mm: float) -> Floats:
    """Return means (n, 3) at distances from the edge, of a strip across it."""
    middle = (np.arange(CANVAS_SIDE) + 0.5 - 0.5 * CANVAS_SIDE) * pixel
    x, y = middle[None, :], middle[:, None]
    away, beside = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    strip = np.abs(beside) < half_mm
    bins = np.round((away[strip] - at_mm[0]) / (at_mm[1] - at_mm[0])).astype(int)
    kept = (bins >= 0) & (bins < len(at_mm))
    count = np.bincount(bins[kept], minlength=len(at_mm))
    sums = [np.bincount(bins[kept], picture[strip][kept, c], len(at_mm)) for c in range(3)]
    return np.stack(sums, axis=-1) / np.maximum(count, 1)[:, None]


def edge_responses(page: Page, colour: Floats, metres: float, shown_d: Floats) -> JsonObject:
    """Return edge responses over all turns: measured, by the samples, and of true lobes of widths d.

    metres : metersPerUnit of a scene in mm
    """
    widest = float(shown_d.max())
    pixel = widest / PIXELS_PER_WIDTH
    at = np.arange(-84, 85) * pixel  # 6 d
    found, told, worst = [], [], 0.0
    for turn in np.arange(DIRECTION_COUNT) * 2.0 * np.pi / DIRECTION_COUNT + 0.1:
        pictures = measured_radiance(page, colour, metres, pixel, turn), predicted_radiance(colour, metres, pixel, turn)
        two = [edge_profile(picture, pixel, turn, at, 3.0 * widest) for picture in pictures]
        worst = max(worst, float(np.abs(two[0] - two[1]).max()))
        found.append(two[0])
        told.append(two[1])
    mean, by_samples, true = np.mean(found, 0), np.mean(told, 0), burley_curve(shown_d, np.ones(3)).edge_response(at)
    near = np.abs(at)[:, None] <= 6.0 * shown_d
    keep = slice(0, None, 7)
    return {
        "colour": np.round(colour, 5).tolist(),
        "metersPerUnit_mm": round(1e3 * metres, 5),
        "expected_d_mm": np.round(shown_d, 5).tolist(),
        "fitted_d_mm": fitted_widths(at, mean),
        "x_mm": np.round(at[keep], 4).tolist(),
        "edge": np.round(mean[keep], 4).tolist(),
        "predicted": np.round(by_samples[keep], 4).tolist(),
        "measured_less_predicted": _max_by_channel(mean - by_samples, near),
        "measured_less_predicted_in_one_direction": round(worst, 4),
        "measured_less_lobes": _max_by_channel(mean - true, near),
    }


def _max_by_channel(difference: Floats, near: NDArray[np.bool_]) -> list[float]:
    return [round(float(x), 4) for x in np.abs(difference * near).max(axis=0)]


def fitted_widths(at: Floats, edge: Floats) -> list[float]:
    """Return widths of the lobes with the nearest edge responses [mm]."""
    tried = np.geomspace(at[-1] / 600.0, at[-1], 241)
    curves = np.stack([burley_curve(np.full(3, d), np.ones(3)).edge_response(at)[:, 0] for d in tried])
    off = ((curves[:, :, None] - edge) ** 2).sum(axis=1)
    return [round(float(x), 4) for x in tried[off.argmin(axis=0)]]


def exported_skin(page: Page, name: str) -> JsonObject:
    """Return the figures of a skin with its exported parameters, also against its profile."""
    subject, target = load_subject(name), TARGETS["babylon"].with_variant(None)
    rows = target.parameters(subject, target.resolve_version(None))
    colour = np.array(get_numbers(rows, "subSurface.scatteringDiffusionProfile"))
    metres = 1e-3 * get_numbers(rows, "subSurfaceConfiguration.metersPerUnit")[0]
    told = edge_responses(page, colour, metres, fit_burley_width(subject.curve))
    x, edge = np.array(told["x_mm"]), np.array(told["edge"])
    near = np.abs(x)[:, None] <= 6.0 * fit_burley_width(subject.curve)
    return told | {"measured_less_profile": _max_by_channel(edge - subject.curve.edge_response(x), near)}


def babylon() -> None:
    """Measure edges of light in Babylon.js; writes benchmarks/results/engines_babylon.json.

    DERMIS_BABYLON names the folder that npm has installed the package babylonjs into. Chromium draws with its
    software WebGL.
    """
    with babylon_page(babylon_library()) as page:
        plain = {
            name: edge_responses(page, np.array(colour), 1e-3, WIDTH_ERROR / np.array(colour))
            for name, colour in {
                "white": (1, 1, 1),
                "grey": (0.5, 0.5, 0.5),
                "coloured": (1, 0.5, 0.25),
            }.items()
        }
        skins = {name: exported_skin(page, name) for name in ("skin1", "skin2", "dj3")}
        told = {
            "engine": "babylonjs " + page.evaluate("BABYLON.Engine.Version"),
            "turns": DIRECTION_COUNT,
            "samples": 40,
        }
    told |= {"noise": 0.002, "plain": plain, "skins": skins}
    write_results(FIGURES, told)
