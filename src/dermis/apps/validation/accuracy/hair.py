"""Hair rendered by dermis and by path tracing, with the same fibres and the same lobes, for docs/hair.md.

Each finished comparison is written to a file of results, and its pictures are cached on disk, so that an
interrupted run continues where it stopped. The page is written from the file of results.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import energy_ratio, relative_rmse
from dermis.apps.truths.person.path_traced import path_trace_person
from dermis.apps.validation.accuracy.person import (
    NOT_MEASURED,
    estimate_text,
    fastest_variant,
    sheet_bytes,
)
from dermis.apps.validation.comparisons.person import (
    PersonComparison,
    PersonSubject,
    person_comparison,
    render_subject_frame,
)
from dermis.apps.validation.comparisons.person_textures import person_textures
from dermis.apps.validation.comparisons.person_views import VIEWS, view_scene
from dermis.apps.validation.pages import (
    DOCS,
    RESULTS,
    JsonObject,
    fill_page,
    read_results,
    require_in_checkout,
    write_results,
)
from dermis.base.console import print_lines
from dermis.base.disk import load_arrays, try_save_arrays
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.labels.classes import class_number
from dermis.human.person import Human
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

PAGE = DOCS / "hair.md"
PICTURE_FILE = DOCS / "images" / "hair.webp"
RESULTS_FILE = RESULTS / "hair.json"
PICTURE_SIDE, PATHS_PER_PIXEL = 144, 64
STYLES = "short", "shoulder-length", "afro"
"""Styles that are compared: short hair, hanging hair, and tightly coiled hair."""
COLOURS: dict[str, dict[str, float]] = {
    "dark": {"eumelanin": 5.0, "pheomelanin": 0.3},
    "brown": {"eumelanin": 1.6, "pheomelanin": 0.5},
    "blond": {"eumelanin": 0.35, "pheomelanin": 0.4},
    "red": {"eumelanin": 0.5, "pheomelanin": 2.0},
    "grey": {"eumelanin": 4.0, "pheomelanin": 0.3, "grey": 0.75},
}
"""Pigments of the compared colours, see `HairLook`."""
ENERGY_GOAL, ERROR_GOAL = 0.05, 0.15
DENSITIES = 0.25, 0.5, 1.0
LOD_SIDES = 64, 128, 256
_REFERENCE_FACTOR = 4  # pixels of the reference of levels of detail per pixel, along each side
_COST_SIDE = 512
_PICTURE_FOLDER = "hair-pictures"
_CURL_BY_STYLE = {"afro": 0.9}
_VIEW = "three-quarter"
_SHEET_COLUMNS = 2


@dataclass(frozen=True)
class HairCase:
    """Style and colour of hair that is rendered by dermis and by path tracing.

    style : one of `STYLES`
    colour : key of `COLOURS`
    """

    style: str
    colour: str

    @property
    def key(self) -> str:
        """Return the name of the comparison in the file of results."""
        return f"{self.style} / {self.colour}"

    def person(self, density: float = 0.9) -> Human:
        """Return a person with this hair."""
        african = float(self.style == "afro")
        look = HairLook(style=self.style, density=density, curl=_CURL_BY_STYLE.get(self.style, 0.1))
        pigments: dict[str, Any] = dict(COLOURS[self.colour])
        look = replace(look, **pigments)
        return Human(african=african, asian=0.0, caucasian=1.0 - african, sex=0.0, age=30.0, hair=look)


def list_hair_cases() -> list[HairCase]:
    """Return all comparisons, one colour of each style first."""
    return [HairCase(style, colour) for colour in COLOURS for style in STYLES]


def hair_mask(renderer: Renderer, scene: Scene, side: int) -> NDArray[np.bool_]:
    """Return the mask (side, side) of the pixels that hair of the head covers for the most part."""
    settings = Settings(size=(side, side), atlas=256)
    observation = next(iter(renderer.observe([scene], settings, outputs=("label",))))
    return np.asarray(observation.outputs["label"] == class_number("hair"))


def compare_hair(renderer: Renderer, case: HairCase, side: int, paths: int, variant: Any) -> PersonComparison:
    """Render hair by dermis and by path tracing, over Lambertian skin, and compare the pixels of hair.

    side : side of the pictures [pixel]
    paths : paths per pixel
    variant : variant of Mitsuba
    """
    scene = view_scene(case.person().head(), VIEWS[_VIEW])
    subject = PersonSubject(scene, person_textures(renderer, scene), "scattering")
    settings = Settings(size=(side, side), atlas=1024, samples=4)
    frame = render_subject_frame(renderer, subject, None, settings)
    traced = path_trace_person(scene, subject.textures, None, (side, side), paths, variant=variant)
    return person_comparison(case.key, frame, traced, hair_mask(renderer, scene, side))


def hair_result(comparison: PersonComparison) -> JsonObject:
    """Return the errors of a comparison in JSON-compatible form."""
    return {
        "error": list(comparison.relrmse),
        "energy": list(comparison.energy),
        "pixels": int(comparison.mask.sum()),
        "paths": comparison.samples,
        "seconds": comparison.seconds,
    }


def density_costs(renderer: Renderer, side: int = _COST_SIDE) -> JsonObject:
    """Return the time of hair in a frame in which all passes are run, by style and density [ms].

    Adapters that cannot time passes give None.

    side : side of the pictures [pixel]
    """
    found: JsonObject = {}
    settings = Settings(size=(side, side), atlas=1024)
    for style in STYLES:
        for density in DENSITIES:
            scene = Scene(HairCase(style, "dark").person(density).head())
            renderer.draw(scene, settings)
            times = renderer.draw(scene, settings, run_all_passes=True).gpu_ms or {}
            found[f"{style} / {density:g}"] = times.get("strands")
    return found


def detail_errors(renderer: Renderer) -> JsonObject:
    """Return relative RMSE and energy of hair in small pictures, against larger pictures, by style and side.

    A larger picture has four times as many pixels along each side, and more and thinner strands.
    """
    found: JsonObject = {}
    for style in STYLES:
        scene = Scene(HairCase(style, "brown").person().head())
        for side in LOD_SIDES:
            small, large = (
                _averaged_frame(renderer, scene, side, factor) for factor in (1, _REFERENCE_FACTOR)
            )
            mask = hair_mask(renderer, scene, side)
            errors = relative_rmse(small, large, mask), energy_ratio(small, large, mask)
            found[f"{style} / {side}"] = [one.value for one in errors]
    return found


def _averaged_frame(renderer: Renderer, scene: Scene, side: int, factor: int) -> NDArray[np.float64]:
    """Render a frame of `factor` times the side, and return its linear radiance averaged to the side."""
    settings = Settings(size=(factor * side, factor * side), atlas=1024)
    image = renderer.draw(scene, settings).linear().astype(np.float64)
    return np.asarray(image.reshape(side, factor, side, factor, 3).mean(axis=(1, 3)))


def write_hair_page(
    adapter: str = "auto",
    *,
    size: int = PICTURE_SIDE,
    paths: int = PATHS_PER_PIXEL,
    variant: str = "auto",
    seconds: float = 0.0,
    measure: bool = True,
) -> None:
    """Compare hair with path tracing, measure its cost and levels of detail, and write docs/hair.md.

    A comparison is skipped if the file of results already has it at the same size, with as many paths and
    on the same adapter, and its pictures are in the cache. Needs Mitsuba.

    Parameters
    ----------
    adapter:
        Adapter that renders the frames.
    size:
        Side of the compared pictures [pixel].
    paths:
        Paths per pixel.
    variant:
        Variant of Mitsuba, or "auto" for the fastest that works.
    seconds:
        Time after which no further comparison starts; 0 for no limit [s].
    measure:
        False writes the page from the last measurement.
    """
    require_in_checkout(PICTURE_FILE.parent)
    if measure:
        _measure(Renderer(adapter), size, paths, variant, seconds)
    results = read_results(RESULTS_FILE)
    fill_page(
        PAGE,
        adapter=results["adapter"],
        variant=results["variant"],
        **results["settings"],
        cases=case_rows(results["cases"]),
        summary=summary_text(results["cases"]),
        costs=cost_rows(results.get("costs", {})),
        costs_adapter=results.get("costs_adapter", results["adapter"]),
        details=detail_rows(results.get("details", {})),
    )


def _measure(renderer: Renderer, size: int, paths: int, variant: str, seconds: float) -> None:
    started, settings = time.perf_counter(), {"side": size, "paths": paths}
    chosen: Any = fastest_variant() if variant == "auto" else variant
    device = f"{renderer.device.adapter.name}, {renderer.device.adapter.backend}"
    results = read_results(RESULTS_FILE) if RESULTS_FILE.exists() else {}
    if results.get("settings") != settings or results.get("adapter") != device:
        results = {"settings": settings, "adapter": device, "cases": {}}
    results["variant"] = chosen

    def is_over() -> bool:
        return bool(seconds) and time.perf_counter() - started > seconds

    panels: dict[str, NDArray[np.uint8]] = {}
    for case in list_hair_cases():
        key = _picture_key(case, size, paths, device)
        cached = load_arrays(_PICTURE_FOLDER, key, ["pair"]) if case.key in results["cases"] else None
        if cached is None:
            if is_over():
                continue
            comparison = compare_hair(renderer, case, size, paths, chosen)
            result = results["cases"][case.key] = hair_result(comparison)
            write_results(RESULTS_FILE, results, digits=5)
            print_lines(f"{case.key}: {result['error']} {result['energy']}")
            shown = replace(comparison, mask=comparison.reference.max(axis=2) > 0.0)  # exposed for the skin
            pictures = shown.tone_mapped(shown.ours), shown.tone_mapped(shown.reference)
            cached = {"pair": np.hstack(pictures)}
            try_save_arrays(_PICTURE_FOLDER, key, cached)
        panels[f"{case.key}: frame, path-traced"] = cached["pair"]
    if panels:
        PICTURE_FILE.write_bytes(sheet_bytes(panels, _SHEET_COLUMNS))
    for name, measured in (("costs", density_costs), ("details", detail_errors)):
        if name not in results and not is_over():
            results[name] = measured(renderer)
            results["costs_adapter"] = device
            write_results(RESULTS_FILE, results, digits=5)


def _picture_key(case: HairCase, size: int, paths: int, device: str) -> str:
    """Return the name under which the pictures of a comparison are cached."""
    return hashlib.sha256(f"{case.key} {size} {paths} {device}".encode()).hexdigest()[:40]


def case_rows(cases: JsonObject) -> str:
    """Return Markdown rows with the errors of each colour and style."""
    lines = []
    for colour in COLOURS:
        found = (cases.get(HairCase(style, colour).key) for style in STYLES)
        cells = (f"{estimate_text(one['error'])} | {one['energy'][0]:.3f}" if one else f"{NOT_MEASURED} | "
                 for one in found)  # fmt: skip
        lines.append(f"| {colour} | {' | '.join(cells)} |")
    return "\n".join(lines)


def summary_text(cases: JsonObject) -> str:
    """Return a sentence on how many of the comparisons reach the goals.

    A relative RMSE reaches its goal if its sum with its standard error does.
    """
    close = [one for one in cases.values() if abs(one["energy"][0] - 1.0) <= ENERGY_GOAL]
    alike = [one for one in cases.values() if sum(one["error"]) <= ERROR_GOAL]
    return (
        f"Of {len(cases)} measured cases, {len(close)} have an energy within {100 * ENERGY_GOAL:.0f} % of "
        f"the path tracer's, and {len(alike)} a relative RMSE of at most {ERROR_GOAL:g}, "
        f"standard error included; there are {len(list_hair_cases())} cases."
    )


def _style_rows(
    values: JsonObject, column_names: tuple[str, ...], cell: Callable[[Any], str], not_measured: str
) -> str:
    """Return Markdown rows, one for each style, with a cell for each column.

    cell : function that returns the text of a measured value
    not_measured : text where a value is missing
    """
    rows = ((style, (values.get(f"{style} / {name}") for name in column_names)) for style in STYLES)
    return "\n".join(
        f"| {style} | {' | '.join(not_measured if one is None else cell(one) for one in found)} |"
        for style, found in rows
    )


def cost_rows(costs: JsonObject) -> str:
    """Return Markdown rows with the time of hair by style and density [ms]."""

    def cell(time_ms: float) -> str:
        return f"{time_ms:.0f}" if time_ms >= 100.0 else f"{time_ms:.3g}"

    return _style_rows(costs, tuple(f"{density:g}" for density in DENSITIES), cell, NOT_MEASURED)


def detail_rows(details: JsonObject) -> str:
    """Return Markdown rows with relative RMSE and energy by style and side of the picture."""
    names = tuple(map(str, LOD_SIDES))
    return _style_rows(details, names, lambda one: f"{one[0]:.3f} | {one[1]:.3f}", f"{NOT_MEASURED} | ")
