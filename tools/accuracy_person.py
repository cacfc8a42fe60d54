"""The package's human beside the same person path-traced: docs/path_traced.md from docs/path_traced.in.md.

python tools/accuracy_person.py [ADAPTER [SIDE [SAMPLES]]]

Needs mitsuba, and DERMIS_DATA or a network for the two panoramas. Paths are kept on disk as they are traced:
a run that was cut off goes on where it stopped.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dermis.apps.gallery.picture import sheet
from dermis.apps.gallery.run import encode_webp
from dermis.apps.gallery.script import Panels
from dermis.apps.truths.metrics import Estimate
from dermis.apps.validation.comparisons.person import Pair, compare_person
from dermis.apps.validation.comparisons.person_iris import iris_of
from dermis.apps.validation.comparisons.person_paint import paint_of
from dermis.apps.validation.comparisons.person_views import EYE_MM, VIEWS, scene_of
from dermis.frame.renderer import Renderer
from dermis.scene.heads import load_head

DOCS = Path(__file__).parent.parent / "docs"
PAGE = DOCS / "path_traced.md"
PICTURE = DOCS / "images" / "path_traced.webp"
SIDE, SAMPLES = 192, 40
COLUMNS = 4
MOST_BYTES = 300_000


def told(found: Estimate, digits: int = 2) -> str:
    """A number with its standard error."""
    return f"{found.value:.{digits}f} ± {found.standard_error:.{digits}f}"


def row(pair: Pair) -> str:
    """A line of the table of views."""
    channels = ", ".join(f"{one.value:.2f}" for one in pair.by_channel)
    figures = f"{told(pair.relrmse, 3)} | {told(pair.energy, 3)} | {channels}"
    return f"| {pair.name} | {VIEWS[pair.name].light} | {pair.samples} | {figures} |"


def iris(pair: Pair) -> dict[str, str]:
    """What is said of the eye from the front."""
    found = iris_of(pair, EYE_MM)
    return {name: told(getattr(found, name)) for name in found._fields}


def pictures(pairs: Sequence[Pair]) -> bytes:
    """A sheet of all views, ours to the left of the truth, as WebP of at most `MOST_BYTES`."""
    panels = {}
    for pair in pairs:
        panels[pair.name] = pair.shown(pair.ours)
        panels[f"{pair.name}, traced"] = pair.shown(pair.truth)
    return sheet_bytes(panels, COLUMNS)


def sheet_bytes(panels: Panels, columns: int) -> bytes:
    """Panels on a sheet, as WebP of at most `MOST_BYTES`."""
    drawn = np.asarray(sheet(panels, columns))
    for quality in (80, 65, 50, 35, 20):
        data = encode_webp(drawn, quality)
        if len(data) <= MOST_BYTES:
            break
    return data


def main(adapter: str = "auto", side: int = SIDE, samples: int = SAMPLES) -> None:
    """Trace, draw, write the page and its picture."""
    renderer, head = Renderer(adapter), load_head("human")
    paint, pairs = paint_of(renderer, scene_of(head, VIEWS["portrait"])), list[Pair]()
    for name in VIEWS:
        pair = compare_person(renderer, head, paint, name, side=side, samples=samples)
        sys.stdout.write(f"{row(pair)} {pair.seconds:.0f} s\n")
        sys.stdout.flush()
        pairs.append(pair)
    by_name = {pair.name: pair for pair in pairs}
    PICTURE.write_bytes(pictures(pairs))
    text = PAGE.with_suffix(".in.md").read_text(encoding="utf-8")
    filled = {
        "adapter": f"{renderer.device.adapter.name}, {renderer.device.adapter.backend}",
        "side": side,
        "minutes": f"{sum(pair.seconds for pair in pairs) / 60:.0f}",
        "rows": "\n".join(map(row, pairs)),
        **iris(by_name["eye"]),
    }
    PAGE.write_text(text.format(**filled), encoding="utf-8")


if __name__ == "__main__":
    given = sys.argv[1:] + ["auto", str(SIDE), str(SAMPLES)][len(sys.argv) - 1 :]
    main(given[0], int(given[1]), int(given[2]))
