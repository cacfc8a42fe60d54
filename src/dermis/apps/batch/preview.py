"""A data set before it is drawn: what its images would be, as a table and on a contact sheet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.distributions import Constant
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.scenes import SceneMaker
from dermis.apps.batch.spec import Spec
from dermis.frame.renderer import Renderer
from dermis.scene.toml_text import value_text

SHOWN = 16
MOST_COUNTED = 20_000
_COLUMNS, _SIDE, _GAP = 4, 192, 4
_SMALL = {"atlas": 512, "shadow_size": 1024}
_WIDEST = 60  # letters of a column
_NUMBERS_OF_PEOPLE = "person.number", "person.seed"
_SHORTER_WAY = 12  # values that are counted one by one

Row = dict[str, Any]


def dry_run(spec: Spec, adapter: str = "auto") -> tuple[list[Row], NDArray[np.uint8]]:
    """Parameters of a data set, and its first 16 pictures, small.

    Rows have: parameter; drawn, as the spec has it; first, values of the first 16 images, None where one has
    none; images, how many of the first 20,000 have it; min, mean and max of them, or counts by value.
    The picture is (h, w, 3) sRGB.

    Raises DermisError as `SceneMaker.scene` and `Renderer.draw` do.
    """
    return parameter_rows(spec), contact_sheet(spec, adapter)


def parameter_rows(spec: Spec) -> list[Row]:
    """A row for each parameter, see `dry_run`; those that never change are left out."""
    found = [spec.parameters(k) for k in range(min(spec.count, MOST_COUNTED))]
    names = dict.fromkeys(name for one in found for name in one)
    changing = [name for name in names if not isinstance(spec.distributions.get(name), Constant)]
    return [_row(spec, name, found) for name in changing if name not in _NUMBERS_OF_PEOPLE]


def table_lines(rows: Sequence[Row]) -> list[str]:
    """The rows as a table for people: parameter, what it is drawn from, and what comes of it."""
    cells = [("parameter", "drawn", "images", "min", "mean", "max"), *map(_cells, rows)]
    widths = [max(len(row[k]) for row in cells if len(row) > 4 or k < 3) for k in range(3)]
    lines = []
    for row in cells:
        start = [one.ljust(width) for one, width in zip(row, widths, strict=False)]
        rest = [one.rjust(10) for one in row[3:]] if len(row) > 4 else list(row[3:])
        lines.append("  ".join([*start, *rest]).rstrip())
    return lines


def contact_sheet(spec: Spec, adapter: str = "auto") -> NDArray[np.uint8]:
    """(h, w, 3) the first 16 pictures with their numbers, sRGB."""
    from PIL import Image, ImageDraw

    width, height = (max(_SIDE * side // max(spec.size), 1) for side in spec.size)
    small = {name: min(value, getattr(spec.render, name)) for name, value in _SMALL.items()}
    tried = spec.replace(render=spec.render.replace(size=(width, height), **small))
    count = min(spec.count, SHOWN)
    across = min(count, _COLUMNS)
    down = -(-count // across)
    size = across * (width + _GAP) - _GAP, down * (height + _GAP) - _GAP
    sheet = Image.new("RGB", size, (20, 20, 20))
    draw = ImageDraw.Draw(sheet)
    for k, picture in enumerate(_pictures(tried, count, adapter)):
        place = (k % across) * (width + _GAP), (k // across) * (height + _GAP)
        sheet.paste(Image.fromarray(picture), place)
        told = place[0] + 4, place[1] + 2
        draw.text(told, str(k), fill=(255, 255, 255), stroke_width=1, stroke_fill=(0, 0, 0))
    return np.array(sheet)


def _pictures(spec: Spec, count: int, adapter: str) -> Iterator[NDArray[np.uint8]]:
    maker, renderer = SceneMaker(spec), Renderer(adapter)
    for k in range(count):
        yield renderer.draw(*maker.scene(spec.parameters(k)), timed=False).srgb8()


def _row(spec: Spec, name: str, found: Sequence[Parameters]) -> Row:
    values = [one[name] for one in found if name in one]
    drawn = spec.distributions.get(name)
    row: Row = {"parameter": name, "drawn": "" if drawn is None else value_text(drawn.spec_value())}
    row |= {"first": [one.get(name) for one in found[:SHOWN]], "images": len(values)}
    numbers = [value for value in values if not isinstance(value, str)]
    if not numbers:
        return row | {"counts": dict(Counter(map(str, values)).most_common())}
    return row | {"min": min(numbers), "mean": float(np.mean(numbers)), "max": max(numbers)}


def _cells(row: Row) -> tuple[str, ...]:
    drawn = row["drawn"] if len(row["drawn"]) <= _WIDEST else f"{row['drawn'][: _WIDEST - 4]} ..."
    start = row["parameter"], drawn, str(row["images"])
    if "counts" not in row:
        return *start, *(f"{row[name]:.4g}" for name in ("min", "mean", "max"))
    counts = [f"{name} {count}" for name, count in row["counts"].items()]
    more = f", and {len(counts) - _SHORTER_WAY} more" if len(counts) > _SHORTER_WAY else ""
    return *start, ", ".join(counts[:_SHORTER_WAY]) + more
