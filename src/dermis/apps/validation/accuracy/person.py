"""People rendered by dermis and by path tracing, with the same model of the skin, for docs/path_traced.md.

Each finished comparison is written to a file of results, and traced paths are cached on disk. An interrupted
run therefore continues where it stopped. The page is written from the file of results.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.gallery.panels import Panels, panel_sheet
from dermis.apps.gallery.script import encode_webp
from dermis.apps.truths.metrics import Estimate, energy_ratio, relative_rmse, signed_difference
from dermis.apps.truths.path_traced import MitsubaVariant, path_trace
from dermis.apps.validation.comparisons.person import (
    OMITTED_FEATURES,
    SHARED_SKIN_KINDS,
    OmittedFeature,
    PersonComparison,
    PersonSubject,
    SharedSkin,
    SharedSkinKind,
    compare_person,
    iris_errors,
    render_frame,
    render_subject_frame,
    shared_skin,
    without_feature,
)
from dermis.apps.validation.comparisons.person_regions import picture_regions
from dermis.apps.validation.comparisons.person_textures import person_textures
from dermis.apps.validation.comparisons.person_views import EYE_FRAME_MM, VIEWS, View, view_scene
from dermis.apps.validation.comparisons.scenes import default_region, medium_scene
from dermis.apps.validation.pages import (
    DOCS,
    RESULTS,
    fill_page,
    read_results,
    require_in_checkout,
    write_results,
)
from dermis.base.console import print_lines
from dermis.base.disk import load_arrays, try_save_arrays
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.optics.media import Medium, published_media
from dermis.scene.heads import load_head
from dermis.scene.settings import Settings

PAGE = DOCS / "path_traced.md"
PICTURE_FILE = DOCS / "images" / "path_traced.webp"
RESULTS_FILE = RESULTS / "path_traced.json"
PICTURE_SIDE, PATHS_PER_PIXEL = 160, 48
SHEET_COLUMNS = 2
MAX_SHEET_BYTES = 300_000
NOT_MEASURED = "not measured"
_PANEL_FOLDER, _PANEL_NAMES = "path-traced-panels", ("frame", "traced", "difference")
_ABLATED_VIEWS = "portrait", "profile", "ear from behind", "three-quarter, lebombo"
_FULL_COVERAGE = 0.999
ComparisonResult = dict[str, Any]
PersonName = Literal["human", "short hair", "dark", "old"]
_PEOPLE: dict[PersonName, Callable[[], Head]] = {
    "human": lambda: load_head("human"),
    "short hair": lambda: Human(hair=HairLook("short", length_mm=30.0)).head(),
    "dark": lambda: Human(african=1.0, asian=0.0, caucasian=0.0, sex=1.0).head(),
    "old": lambda: Human(caucasian=1.0, african=0.0, asian=0.0, age=80.0).head(),
}
_PERSON_OF_VIEW: Mapping[str, PersonName] = {"ear from behind": "short hair"}  # of all others: the human
_OTHER_PEOPLE: tuple[PersonName, ...] = "dark", "old"
_PEOPLE_VIEWS = "portrait", "three-quarter, lebombo", "moved"
_MOVED_VIEW = {"moved": View(VIEWS["three-quarter"].camera, "window", "surprise")}
ALL_VIEWS: Mapping[str, View] = VIEWS | _MOVED_VIEW
_HEAD_FILES = {
    "scan": "lee_perry_smith",
    "old man": "heads/makehuman/head_old_male_dark.obj",
    "young man": "heads/makehuman/head_young_male_light.obj",
}
_HEAD_LIGHTS = "front", "back", "laser"
_HEAD_MEDIA = "dj3", "skin1"


@dataclass(frozen=True)
class ComparisonCase:
    """Comparison of one view of a person, rendered by dermis and by path tracing.

    person : key of `_PEOPLE`
    view : key of `ALL_VIEWS`
    skin_kind : model of the skin that both renderers use, one of `comparisons.person.SHARED_SKIN_KINDS`
    omitted_feature : feature that both renderers omit, such as "hair", to find how much of the error it
        causes; None if they omit nothing
    """

    person: PersonName
    view: str
    skin_kind: SharedSkinKind
    omitted_feature: OmittedFeature | None = None

    @property
    def key(self) -> str:
        """Return the name of the comparison in the file of results."""
        return f"{self.person} / {self.view} / {self.skin_kind} / {self.omitted_feature or 'everything'}"


def list_comparison_cases() -> list[ComparisonCase]:
    """Return all comparisons of people rendered by dermis against path tracing, most important first."""
    found = [_view_case(view, "matched") for view in ALL_VIEWS]
    found += [_view_case(view, "layered") for view in VIEWS]
    found += [ComparisonCase(one, view, "matched") for one in _OTHER_PEOPLE for view in _PEOPLE_VIEWS]
    found += [
        _view_case(view, "matched", omitted_feature)
        for view in _ABLATED_VIEWS
        for omitted_feature in OMITTED_FEATURES
    ]
    found += [_view_case(view, "refracting") for view in VIEWS]
    return found


def _view_case(
    view: str, skin_kind: SharedSkinKind, omitted_feature: OmittedFeature | None = None
) -> ComparisonCase:
    """Return the comparison of a view, with the person that the view shows."""
    return ComparisonCase(_PERSON_OF_VIEW.get(view, "human"), view, skin_kind, omitted_feature)


class ComparisonRunner:
    """Comparisons of people and heads rendered by dermis and by path tracing, all with the same options.

    renderer : renderer of the frames
    side : side of the pictures [pixel]
    samples : paths per pixel
    variant : variant of Mitsuba
    folder : folder in which the files of diffusion profiles are written
    """

    def __init__(
        self, renderer: Renderer, side: int, samples: int, variant: MitsubaVariant, folder: Path
    ) -> None:
        self.renderer, self.side, self.samples = renderer, side, samples
        self.variant, self.folder = variant, folder
        self._people: dict[str, tuple[Head, Any]] = {}
        self._skins: dict[tuple[str, str], SharedSkin] = {}

    def compare_case(self, comparison_case: ComparisonCase) -> ComparisonResult:
        """Render a person with dermis and by path tracing; return the errors in JSON-compatible form.

        Pictures that docs/path_traced.md shows are kept in the cache.
        """
        head, textures = self._load_person(comparison_case.person)
        skin = self._shared_skin(comparison_case.person, head, comparison_case.skin_kind)
        subject = PersonSubject(view_scene(head, ALL_VIEWS[comparison_case.view]), textures)
        if comparison_case.omitted_feature is not None:
            subject = without_feature(subject, comparison_case.omitted_feature)
        samples = round(self.samples * ALL_VIEWS[comparison_case.view].sample_factor)
        options: dict[str, Any] = {"picture_side": self.side, "samples": samples, "variant": self.variant}
        pair = compare_person(self.renderer, subject, skin, comparison_case.view, **options)
        result = comparison_result(pair)
        if comparison_case.skin_kind == "matched":
            regions = picture_regions(self.renderer, subject.scene, self.side)
            result["regions"] = {name: list(ratio) for name, ratio in regions.light_ratios(pair).items()}
        if comparison_case.skin_kind == "matched" and comparison_case.omitted_feature is None:
            settings = Settings(size=(self.side, self.side), samples=4)
            shipped = render_subject_frame(self.renderer, subject, None, settings)
            error = relative_rmse(shipped, pair.reference, pair.mask, pair.variance)
            result["default"] = [*error, *energy_ratio(shipped, pair.reference, pair.mask, pair.variance)]
            if comparison_case.view == "eye":
                iris = iris_errors(pair, EYE_FRAME_MM)._asdict()
                result["iris"] = {name: list(value) for name, value in iris.items()}
            if comparison_case.person == _PERSON_OF_VIEW.get(comparison_case.view, "human"):
                save_panels(comparison_case.view, pair)
        return result

    def _load_person(self, person_name: PersonName) -> tuple[Head, Any]:
        if person_name not in self._people:
            head = _PEOPLE[person_name]()
            textures = person_textures(self.renderer, view_scene(head, VIEWS["portrait"]))
            self._people[person_name] = head, textures
        return self._people[person_name]

    def _shared_skin(self, person_name: PersonName, head: Head, skin_kind: SharedSkinKind) -> SharedSkin:
        key = person_name, skin_kind
        if key not in self._skins:
            folder = self.folder / person_name
            folder.mkdir(exist_ok=True)
            self._skins[key] = shared_skin(self.renderer, head, skin_kind, folder)
        return self._skins[key]

    def compare_head(self, head_name: str, light_name: str, medium: Medium) -> ComparisonResult:
        """Compare renderings of a head without maps or surface reflection, and return the errors.

        The result also has the number of paths per pixel and the notes of the path tracer.

        head_name : key of `_HEAD_FILES`
        light_name : key of `scenes.LIGHTS`
        medium : index-matched medium of the head
        """
        settings = Settings(size=(self.side, self.side), samples=4)
        with medium_scene(_load_named_head(head_name), light_name, default_region(light_name), medium) as (
            scene,
            _,
        ):
            traced = path_trace(scene, medium, self.samples, settings, variant=self.variant)
            frame = render_frame(
                self.renderer, scene.replace(skin=scene.skin.replace(direction="half-space")), settings
            )
        mask = traced.mask > _FULL_COVERAGE
        image, variance = traced.image.astype(np.float64), traced.variance.astype(np.float64)
        error, energy = (f(frame, image, mask, variance) for f in (relative_rmse, energy_ratio))
        return {"error": list(error), "energy": list(energy), "paths": traced.samples, "notes": traced.notes}


@cache
def _load_named_head(head_name: str) -> Head:
    from dermis.apps.validation.pages import data_file

    file = _HEAD_FILES[head_name]
    return load_head(str(data_file(file)) if "/" in file else file)


def comparison_result(comparison: PersonComparison) -> ComparisonResult:
    """Return the errors of a comparison, its paths per pixel and its duration in JSON-compatible form."""
    return {
        "error": list(comparison.relrmse),
        "energy": list(comparison.energy),
        "channels": [one.value for one in comparison.energy_by_channel],
        "paths": comparison.samples,
        "seconds": comparison.seconds,
    }


def save_panels(view_name: str, comparison: PersonComparison) -> None:
    """Keep the pictures of a view in the cache: by dermis, path-traced, and their signed difference."""
    from scipy.ndimage import uniform_filter

    ours, reference = (
        uniform_filter(np.maximum(comparison.exposure * image, 0.0), (3, 3, 1))
        for image in (comparison.ours, comparison.reference)
    )
    difference = np.rint(255 * signed_difference(ours, reference)).astype(np.uint8)
    pictures = (
        comparison.tone_mapped(comparison.ours),
        comparison.tone_mapped(comparison.reference),
        difference,
    )
    try_save_arrays(_PANEL_FOLDER, _panel_key(view_name), dict(zip(_PANEL_NAMES, pictures, strict=True)))


def picture_sheet(view_names: Sequence[str]) -> bytes:
    """Return a WebP file that shows three pictures of each view side by side.

    The pictures are by dermis, path-traced, and their difference. Views whose pictures are not in the cache
    are left out.
    """
    panels: dict[str, NDArray[np.uint8]] = {}
    for view in view_names:
        found = load_arrays(_PANEL_FOLDER, _panel_key(view), _PANEL_NAMES)
        if found is not None:
            panels[f"{view}: frame, path-traced, difference"] = np.hstack(
                [found[name] for name in _PANEL_NAMES]
            )
    return sheet_bytes(panels, SHEET_COLUMNS)


def _panel_key(view_name: str) -> str:
    return "".join(letter for letter in view_name if letter.isalnum())


def sheet_bytes(panels: Panels, columns: int) -> bytes:
    """Return a WebP file of at most `MAX_SHEET_BYTES` that shows pictures in rows.

    panels : pictures by title
    columns : number of pictures per row
    """
    picture = np.asarray(panel_sheet(panels, columns))
    for quality in (80, 65, 50, 35, 20):
        data = encode_webp(picture, quality)
        if len(data) <= MAX_SHEET_BYTES:
            break
    return data


def fastest_variant() -> MitsubaVariant:
    """Return the first variant of Mitsuba that works on this machine: CUDA, LLVM, or scalar.

    Each variant is probed in a separate process, because some versions of LLVM abort the process.
    """
    for variant in ("cuda_ad_rgb", "llvm_ad_rgb"):
        done = subprocess.run(
            [sys.executable, "-c", _VARIANT_PROBE_SCRIPT, variant], capture_output=True, check=False
        )
        if done.returncode == 0:
            return variant
    return "scalar_rgb"


_VARIANT_PROBE_SCRIPT = """
import sys
import mitsuba as mi
mi.set_variant(sys.argv[1])
scene = mi.cornell_box()
scene["sensor"]["film"]["width"] = scene["sensor"]["film"]["height"] = 8
import numpy as np
assert np.isfinite(np.array(mi.render(mi.load_dict(scene), spp=4))).all()
"""


def compare_people_with_path_tracer(
    adapter: str = "auto",
    side: int = PICTURE_SIDE,
    samples: int = PATHS_PER_PIXEL,
    variant: str = "auto",
    seconds: float = 0.0,
) -> None:
    """Compare people rendered by dermis with path tracing, and write docs/path_traced.md.

    A comparison is skipped if the file of results already has it at the same size and with as many paths.
    Needs Mitsuba, and DERMIS_DATA or a network for the panoramas and the heads.

    Parameters
    ----------
    side:
        Side of the pictures [pixel].
    samples:
        Paths per pixel.
    variant:
        Variant of Mitsuba, or "auto" for the fastest that works.
    seconds:
        Time after which no further comparison starts; 0 for no limit [s].
    """
    require_in_checkout(PICTURE_FILE.parent)
    started, renderer = time.perf_counter(), Renderer(adapter)
    chosen: Any = fastest_variant() if variant == "auto" else variant
    device = f"{renderer.device.adapter.name}, {renderer.device.adapter.backend}"
    results = read_results(RESULTS_FILE) if RESULTS_FILE.exists() else {}
    settings = {"side": side, "samples": samples}
    if results.get("settings") != settings:
        results = {"settings": settings, "people": {}, "heads": {}}
    results |= {"adapter": device, "variant": chosen}
    with tempfile.TemporaryDirectory() as folder:
        runner = ComparisonRunner(renderer, side, samples, chosen, Path(folder))
        for group, key, compare in _comparison_jobs(runner):
            if key in results[group] or (seconds and time.perf_counter() - started > seconds):
                continue
            results[group][key] = compare()
            write_results(RESULTS_FILE, results, digits=5)
            print_lines(f"{key}: {results[group][key]['error']} {results[group][key]['energy']}")
    PICTURE_FILE.write_bytes(picture_sheet(list(ALL_VIEWS)))
    write_path_traced_page()


_ComparisonJob = tuple[str, str, Callable[[], ComparisonResult]]


def _comparison_jobs(runner: ComparisonRunner) -> list[_ComparisonJob]:
    """Return the comparisons in the order in which they are run, each as a tuple (group, key, function).

    The function runs the comparison and returns its errors. The group and the key, such as "people" and the
    name of the comparison, say where in the file of results these errors are stored.
    """
    people: list[_ComparisonJob] = [
        ("people", one.key, partial(runner.compare_case, one)) for one in list_comparison_cases()
    ]
    heads: list[_ComparisonJob] = [
        (
            "heads",
            f"{name} / {light} / {medium}",
            partial(runner.compare_head, name, light, published_media()[medium].with_eta(1.0)),
        )
        for medium in _HEAD_MEDIA
        for name in _HEAD_FILES
        for light in _HEAD_LIGHTS
    ]
    views, important = len(ALL_VIEWS), len(_HEAD_LIGHTS)
    layered = views + len(VIEWS)
    return [
        *people[:views],
        *heads[:important],
        *people[views:layered],
        *heads[important:],
        *people[layered:],
    ]


def write_path_traced_page() -> None:
    """Write docs/path_traced.md from the last measurement."""
    results = read_results(RESULTS_FILE)
    fill_page(
        PAGE,
        adapter=results["adapter"],
        variant=results["variant"],
        **results["settings"],
        views=view_rows(results["people"]),
        people=people_rows(results["people"]),
        heads=head_rows(results["heads"]),
        regions=region_table(results["people"]),
        causes=omitted_feature_table(results["people"]),
        **iris_cells(results["people"]),
    )


def estimate_text(estimate: Sequence[float] | Estimate | None, digits: int = 3) -> str:
    """Return an estimate with its standard error as text, such as "0.102 ± 0.004"."""
    if estimate is None:
        return NOT_MEASURED
    value, error = estimate
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def _error_cells(comparison_errors: ComparisonResult | None) -> str:
    """Return table cells with the relative RMSE and the energy ratio of a comparison."""
    return (
        f"{estimate_text(comparison_errors['error'])} | {comparison_errors['energy'][0]:.3f}"
        if comparison_errors
        else f"{NOT_MEASURED} | "
    )


def view_rows(people_results: ComparisonResult) -> str:
    """Return Markdown rows, one per view of the human, with the errors against each path-traced reference."""
    lines = []
    for view, where in ALL_VIEWS.items():
        rows = {
            skin_kind: people_results.get(_view_case(view, skin_kind).key) for skin_kind in SHARED_SKIN_KINDS
        }
        matched = rows["matched"]
        shipped = matched["default"] if matched else None
        default = f"{estimate_text(shipped[:2])} | {shipped[2]:.3f}" if shipped else f"{NOT_MEASURED} | "
        cells = " | ".join(_error_cells(rows[skin_kind]) for skin_kind in SHARED_SKIN_KINDS)
        paths = matched["paths"] if matched else ""
        lines.append(f"| {view} | {where.light} | {paths} | {cells} | {default} |")
    return "\n".join(lines)


def people_rows(people_results: ComparisonResult) -> str:
    """Return Markdown rows with the errors of people other than the package's default head."""
    keys = [(one, view) for one in _OTHER_PEOPLE for view in _PEOPLE_VIEWS]
    rows = ((one, view, people_results.get(ComparisonCase(one, view, "matched").key)) for one, view in keys)
    return "\n".join(f"| {one} | {view} | {_error_cells(row)} |" for one, view, row in rows)


def head_rows(head_results: ComparisonResult) -> str:
    """Return Markdown rows with the errors of heads without maps, by head and medium."""
    lines = []
    for medium in _HEAD_MEDIA:
        for name in _HEAD_FILES:
            cells = " | ".join(
                _error_cells(head_results.get(f"{name} / {light} / {medium}")) for light in _HEAD_LIGHTS
            )
            lines.append(f"| {name} | {medium} | {cells} |")
    return "\n".join(lines)


def region_table(people_results: ComparisonResult) -> str:
    """Return a Markdown table with the ratio of light in frames to that in references, by region and view."""
    rows = {view: people_results.get(_view_case(view, "matched").key) for view in ALL_VIEWS}
    found = {view: row["regions"] for view, row in rows.items() if row}
    names = list(dict.fromkeys(name for regions in found.values() for name in regions))
    lines = [f"| region | {' | '.join(found)} |", "|---" * (len(found) + 1) + "|"]
    for name in names:
        cells = (f"{regions[name][0]:.2f}" if name in regions else "" for regions in found.values())
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def omitted_feature_table(people_results: ComparisonResult) -> str:
    """Return a Markdown table with the errors of people without features that cause errors.

    The errors are the relative RMSE and the energy ratio. In the first row, both renderers omit nothing. In
    each further row, they omit one feature that causes errors, such as the hair.
    """
    lines = [
        f"| left out on both sides | {' | '.join(f'{view} | energy' for view in _ABLATED_VIEWS)} |",
        "|---" * (2 * len(_ABLATED_VIEWS) + 1) + "|",
    ]
    for omitted_feature in (None, *OMITTED_FEATURES):
        rows = (
            people_results.get(_view_case(view, "matched", omitted_feature).key) for view in _ABLATED_VIEWS
        )
        lines.append(f"| {omitted_feature or 'nothing'} | {' | '.join(_error_cells(row) for row in rows)} |")
    return "\n".join(lines)


def iris_cells(people_results: ComparisonResult) -> dict[str, str]:
    """Return texts on how the iris rendered by dermis differs from the path-traced one in the view "eye".

    The keys are the placeholders of docs/templates/path_traced.md that the texts replace.
    """
    row = people_results.get(ComparisonCase("human", "eye", "matched").key) or {}
    iris = row.get("iris", {})
    names = "right", "down", "brightness", "left_half", "right_half"
    return {name: estimate_text(iris.get(name), 2) for name in names}
