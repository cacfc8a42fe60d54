"""The package's human beside the same person path-traced: docs/path_traced.md from docs/templates/path_traced.md.

Paths are kept on disk as they are traced: a run that was interrupted continues where it stopped.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dermis.apps.gallery.panels import Panels, sheet
from dermis.apps.gallery.script import encode_webp
from dermis.apps.truths.metrics import Estimate
from dermis.apps.validation.comparisons.person import EYE_FRAME_MM, VIEWS, PersonComparison, compare_person, iris_errors, view_scene
from dermis.apps.validation.comparisons.person_textures import person_textures
from dermis.apps.validation.pages import DOCS, fill_page, require_in_checkout
from dermis.base.console import print_lines
from dermis.frame.renderer import Renderer
from dermis.scene.heads import load_head

PAGE = DOCS / "path_traced.md"
PICTURE = DOCS / "images" / "path_traced.webp"
SIDE, SAMPLES = 192, 40
COLUMNS = 4
MAX_BYTES = 300_000


def with_error(found: Estimate, digits: int = 2) -> str:
    """Return a number with its standard error."""
    return f"{found.value:.{digits}f} ± {found.standard_error:.{digits}f}"


def view_row(pair: PersonComparison) -> str:
    """Return a line of the table of views."""
    channels = ", ".join(f"{one.value:.2f}" for one in pair.by_channel)
    figures = f"{with_error(pair.relrmse, 3)} | {with_error(pair.energy, 3)} | {channels}"
    return f"| {pair.name} | {VIEWS[pair.name].light} | {pair.samples} | {figures} |"


def iris_cells(pair: PersonComparison) -> dict[str, str]:
    """Return the figures of the iris in the view of the eye."""
    found = iris_errors(pair, EYE_FRAME_MM)
    return {name: with_error(getattr(found, name)) for name in found._fields}


def picture_sheet(pairs: Sequence[PersonComparison]) -> bytes:
    """Return a sheet of all views, ours to the left of the truth, as WebP of at most `MOST_BYTES`."""
    panels = {}
    for pair in pairs:
        panels[pair.name] = pair.shown(pair.ours)
        panels[f"{pair.name}, traced"] = pair.shown(pair.truth)
    return sheet_bytes(panels, COLUMNS)


def sheet_bytes(panels: Panels, columns: int) -> bytes:
    """Return panels on a sheet, as WebP of at most `MOST_BYTES`."""
    drawn = np.asarray(sheet(panels, columns))
    for quality in (80, 65, 50, 35, 20):
        data = encode_webp(drawn, quality)
        if len(data) <= MAX_BYTES:
            break
    return data


def person(adapter: str = "auto", side: int = SIDE, samples: int = SAMPLES) -> None:
    """Path-trace the package's human, draw it and write docs/path_traced.md with its picture.

    Needs Mitsuba, and DERMIS_DATA or a network for the two panoramas.

    Parameters
    ----------
    side:
        Of the pictures [pixel].
    samples:
        Paths through each pixel.
    """
    require_in_checkout(PICTURE.parent)
    renderer, head = Renderer(adapter), load_head("human")
    paint, pairs = person_textures(renderer, view_scene(head, VIEWS["portrait"])), list[PersonComparison]()
    for name in VIEWS:
        pair = compare_person(renderer, head, paint, name, side=side, samples=samples)
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
