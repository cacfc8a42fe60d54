"""Views of the package's human by dermis and by path tracing, compared for docs/path_traced.md.

Paths are cached on disk while they are traced, so an interrupted run continues where it stopped.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dermis.apps.gallery.panels import Panels, panel_sheet
from dermis.apps.gallery.script import encode_webp
from dermis.apps.truths.metrics import Estimate
from dermis.apps.validation.comparisons.person import (
    EYE_FRAME_MM,
    VIEWS,
    PersonComparison,
    compare_person,
    iris_errors,
    view_scene,
)
from dermis.apps.validation.comparisons.person_textures import person_textures
from dermis.apps.validation.pages import DOCS, fill_page, in_checkout
from dermis.base.console import print_lines
from dermis.frame.renderer import Renderer
from dermis.scene.heads import load_head

PAGE = DOCS / "path_traced.md"
PICTURE = DOCS / "images" / "path_traced.webp"
PICTURE_SIDE, PATHS_PER_PIXEL = 192, 40
SHEET_COLUMNS = 4
MAX_SHEET_BYTES = 300_000


def with_error(estimate: Estimate, digits: int = 2) -> str:
    """Return an estimate with its standard error as text, such as "1.02 ± 0.04"."""
    return f"{estimate.value:.{digits}f} ± {estimate.standard_error:.{digits}f}"


def view_row(pair: PersonComparison) -> str:
    """Return a Markdown row with the errors of one view."""
    channels = ", ".join(f"{one.value:.2f}" for one in pair.energy_by_channel)
    figures = f"{with_error(pair.relrmse, 3)} | {with_error(pair.energy, 3)} | {channels}"
    return f"| {pair.name} | {VIEWS[pair.name].light} | {pair.samples} | {figures} |"


def iris_cells(pair: PersonComparison) -> dict[str, str]:
    """Return errors of the iris in the eye view for docs/templates/path_traced.md, keyed by placeholder."""
    return {name: with_error(one) for name, one in iris_errors(pair, EYE_FRAME_MM)._asdict().items()}


def picture_sheet(pairs: Sequence[PersonComparison]) -> bytes:
    """Return a sheet of all views, with dermis's picture to the left of the reference, as a WebP file."""
    panels = {}
    for pair in pairs:
        panels[pair.name] = pair.tone_mapped(pair.ours)
        panels[f"{pair.name}, traced"] = pair.tone_mapped(pair.reference)
    return sheet_bytes(panels, SHEET_COLUMNS)


def sheet_bytes(panels: Panels, columns: int) -> bytes:
    """Return pictures on a sheet as a WebP file of at most `MAX_SHEET_BYTES`."""
    picture = np.asarray(panel_sheet(panels, columns))
    for quality in (80, 65, 50, 35, 20):
        data = encode_webp(picture, quality)
        if len(data) <= MAX_SHEET_BYTES:
            break
    return data


def person(adapter: str = "auto", side: int = PICTURE_SIDE, samples: int = PATHS_PER_PIXEL) -> None:
    """Path-trace and render the package's human, and write docs/path_traced.md with its picture.

    Needs Mitsuba, and DERMIS_DATA or a network for the two panoramas.

    Parameters
    ----------
    side:
        Side of the pictures [pixel].
    samples:
        Paths per pixel.
    """
    in_checkout(PICTURE.parent)
    renderer, head = Renderer(adapter), load_head("human")
    textures, pairs = person_textures(renderer, view_scene(head, VIEWS["portrait"])), []
    for name in VIEWS:
        pair = compare_person(renderer, head, textures, name, side=side, samples=samples)
        print_lines(f"{view_row(pair)} {pair.seconds:.0f} s")
        pairs.append(pair)
    by_name = {pair.name: pair for pair in pairs}
    PICTURE.write_bytes(picture_sheet(pairs))
    fill_page(
        PAGE,
        adapter=f"{renderer.device.adapter.name}, {renderer.device.adapter.backend}",
        side=side,
        minutes=f"{sum(pair.seconds for pair in pairs) / 60:.0f}",
        rows="\n".join(map(view_row, pairs)),
        **iris_cells(by_name["eye"]),
    )
