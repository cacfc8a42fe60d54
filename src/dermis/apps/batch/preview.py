"""Preview of a data set: its sampled parameters as a table, and a contact sheet of its first images."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.distributions import Constant
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.spec import Spec
from dermis.frame.renderer import Renderer
from dermis.scene.toml_text import value_text

SHOWN = 16
MAX_COUNTED = 20_000
_COLUMNS, _SIDE, _GAP = 4, 192, 4
_SMALL = {"atlas": 512, "shadow_size": 1024}
_WIDEST = 60  # letters of a column
_NUMBERS_OF_PEOPLE = "person.number", "person.seed"
_MAX_VALUES = 12  # values that are listed


class _RowFields(TypedDict):
    """Fields of every row.

    drawn : the distribution as TOML
    first : values of the first 16 images, None where one has none
    images : number of the first 20,000 that have it
    """

    parameter: str
    drawn: str
    first: list[float | str | None]
    images: int


class Row(_RowFields, total=False):
    """Row of the table: extremes and mean of numbers, or counts by value of texts."""

    min: float
    mean: float
    max: float
    counts: dict[str, int]


def dry_run(spec: Spec, adapter: str = "auto") -> tuple[list[Row], NDArray[np.uint8]]:
    """Return the table of parameters of a data set, and a sheet (h, w, 3) of its first 16 pictures, sRGB.

    Raises DermisError as `SceneBuilder.scene` and `Renderer.draw` do.
    """
    return parameter_rows(spec), contact_sheet(spec, adapter)


def parameter_rows(spec: Spec) -> list[Row]:
    """Return a row for each parameter that varies."""
    found = [spec.parameters(k) for k in range(min(spec.count, MAX_COUNTED))]
    names = dict.fromkeys(name for one in found for name in one)
    varying = [name for name in names if not isinstance(spec.distributions.get(name), Constant)]
    return [_row(spec, name, found) for name in varying if name not in _NUMBERS_OF_PEOPLE]


def table_lines(rows: Sequence[Row]) -> list[str]:
    """Return the rows as lines of a table for people."""
    cells = [("parameter", "drawn", "images", "min", "mean", "max"), *map(_cells, rows)]
    widths = [max(len(row[k]) for row in cells if len(row) > 4 or k < 3) for k in range(3)]
    lines = []
    for row in cells:
        start = [one.ljust(width) for one, width in zip(row, widths, strict=False)]
        rest = [one.rjust(10) for one in row[3:]] if len(row) > 4 else list(row[3:])
        lines.append("  ".join([*start, *rest]).rstrip())
    return lines


def contact_sheet(spec: Spec, adapter: str = "auto") -> NDArray[np.uint8]:
    """Return the first 16 pictures with their numbers (h, w, 3), sRGB."""
    from PIL import Image, ImageDraw

    width, height = (max(_SIDE * side // max(spec.size), 1) for side in spec.size)
    small = {name: min(value, getattr(spec.render, name)) for name, value in _SMALL.items()}
    spec = spec.replace(render=spec.render.replace(size=(width, height), **small))
    count = min(spec.count, SHOWN)
    across = min(count, _COLUMNS)
    down = -(-count // across)
    size = across * (width + _GAP) - _GAP, down * (height + _GAP) - _GAP
    sheet = Image.new("RGB", size, (20, 20, 20))
    draw = ImageDraw.Draw(sheet)
    maker, renderer = SceneBuilder(spec), Renderer(adapter)
    for k in range(count):
        picture = renderer.draw(*maker.scene(spec.parameters(k)), timed=False).srgb8()
        x, y = (k % across) * (width + _GAP), (k // across) * (height + _GAP)
        sheet.paste(Image.fromarray(picture), (x, y))
        draw.text((x + 4, y + 2), str(k), fill=(255, 255, 255), stroke_width=1, stroke_fill=(0, 0, 0))
    return np.array(sheet)


def _row(spec: Spec, name: str, found: Sequence[Parameters]) -> Row:
    values = [one[name] for one in found if name in one]
    drawn = spec.distributions.get(name)
    text = "" if drawn is None else value_text(drawn.spec_value())
    first = [one.get(name) for one in found[:SHOWN]]
    row: Row = {"parameter": name, "drawn": text, "first": first, "images": len(values)}
    numbers = [value for value in values if not isinstance(value, str)]
    if not numbers:
        return {**row, "counts": dict(Counter(map(str, values)).most_common())}
    return {**row, "min": min(numbers), "mean": float(np.mean(numbers)), "max": max(numbers)}


def _cells(row: Row) -> tuple[str, ...]:
    drawn = row["drawn"] if len(row["drawn"]) <= _WIDEST else f"{row['drawn'][: _WIDEST - 4]} ..."
    start = row["parameter"], drawn, str(row["images"])
    if "counts" not in row:
        return *start, *(f"{one:.4g}" for one in (row["min"], row["mean"], row["max"]))
    counts = [f"{name} {count}" for name, count in row["counts"].items()]
    more = f", and {len(counts) - _MAX_VALUES} more" if len(counts) > _MAX_VALUES else ""
    return *start, ", ".join(counts[:_MAX_VALUES]) + more
