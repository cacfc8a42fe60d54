"""Preview of a data set: a table of sampled parameters, a contact sheet, and an estimate of size and time."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.distributions import Constant
from dermis.apps.batch.finishing import finished_image
from dermis.apps.batch.observed_frames import PlannedImage, observe_images
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.shards import Part
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.worker import RunOptions, Worker
from dermis.frame.renderer import Renderer
from dermis.scene.toml_text import value_text

SHEET_IMAGE_COUNT = 16
"""Number of images on the contact sheet."""
MAX_COUNTED_IMAGES = 20_000
"""Largest number of images that the statistics of the parameter table cover."""
_SHEET_COLUMNS, _SHEET_IMAGE_SIDE, _SHEET_GAP = 4, 192, 4  # of the contact sheet; lengths in pixels
_MAX_PREVIEW_SIDES = {"atlas": 512, "shadow_size": 1024}  # upper limits of settings for the contact sheet
_MAX_COLUMN_CHARACTERS = 60  # characters
_MEASURED_IMAGE_COUNT, _WARM_UP_IMAGE_COUNT = 6, 2  # images of an estimate; the first of them are not timed
_PERSON_IDENTIFIERS = "person.number", "person.seed"
_MAX_LISTED_VALUES = 12  # largest number of listed values of a text parameter


class ParameterRow(TypedDict):
    """Row of the parameter table: a parameter with its distribution and statistics of its samples.

    drawn : distribution as TOML
    first : samples of the first 16 images; None for an image without this parameter
    images : number of images with this parameter, among the first 20,000 images
    min, mean, max : statistics of numeric samples
    counts : number of images with each value, if the values are strings
    """

    parameter: str
    drawn: str
    first: list[float | str | None]
    images: int
    min: NotRequired[float]
    mean: NotRequired[float]
    max: NotRequired[float]
    counts: NotRequired[dict[str, int]]


class Estimate(TypedDict):
    """Size and duration of a data set, estimated by rendering its first images at full size.

    images : number of images of the data set
    measured : number of images that were rendered for the estimate
    bytes : size of the data set [bytes]
    hours : duration of rendering the data set with one worker [h]
    """

    images: int
    measured: int
    bytes: int
    hours: float


def dry_run(spec: Spec, adapter: str = "auto") -> tuple[list[ParameterRow], NDArray[np.uint8], Estimate]:
    """Return the parameter table, an sRGB contact sheet (h, w, 3), and the estimated size and duration.

    Raises DermisError as `SceneBuilder.build` and `Renderer.draw` do.
    """
    return parameter_rows(spec), contact_sheet(spec, adapter), estimate_size_and_duration(spec, adapter)


def estimate_size_and_duration(spec: Spec, adapter: str = "auto") -> Estimate:
    """Estimate the size of a data set and the duration of its rendering, from its first images.

    These images are rendered by a `Worker`. The first two of them, which fill caches, are not timed.
    """
    count = min(spec.count, spec.shard_size, _MEASURED_IMAGE_COUNT)
    times, measured = [time.monotonic()], spec.replace(count=count)  # a complete shard of few images
    with TemporaryDirectory() as name, closing(Worker(adapter, RunOptions(measured, Path(name)))) as worker:
        send = lambda event: times.extend([time.monotonic()] * event.images)  # noqa: E731
        worker.run_tasks([Part(0, 0, count)], send)
        size = sum(path.stat().st_size for path in Path(name).rglob("*") if path.is_file())
    untimed = _WARM_UP_IMAGE_COUNT if count > _WARM_UP_IMAGE_COUNT else 0
    seconds = (times[-1] - times[untimed]) / (count - untimed)
    hours = spec.count * seconds / 3600
    return {"images": spec.count, "measured": count, "bytes": spec.count * size // count, "hours": hours}


def estimate_line(estimate: Estimate) -> str:
    """Return the estimated size and duration of a data set as a line of text."""
    size, hours = f"{estimate['bytes'] / 1e9:.3g} GB", f"{estimate['hours']:.3g} hours with one worker"
    return f"{estimate['images']:,} images: about {size} and {hours}, from {estimate['measured']} images"


def parameter_rows(spec: Spec) -> list[ParameterRow]:
    """Return a row of the parameter table for each parameter that varies."""
    samples = [spec.parameters(k) for k in range(min(spec.count, MAX_COUNTED_IMAGES))]
    names = dict.fromkeys(name for sample in samples for name in sample)
    varying = [name for name in names if not isinstance(spec.distributions.get(name), Constant)]
    return [_parameter_row(spec, name, samples) for name in varying if name not in _PERSON_IDENTIFIERS]


def parameter_table_lines(rows: Sequence[ParameterRow]) -> list[str]:
    """Return the parameter table as aligned lines of text."""
    cells = [("parameter", "distribution", "images", "min", "mean", "max"), *map(_table_cells, rows)]
    widths = [max(len(row[k]) for row in cells if len(row) > 4 or k < 3) for k in range(3)]
    lines = []
    for row in cells:
        texts = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
        values = [cell.rjust(10) for cell in row[3:]] if len(row) > 4 else list(row[3:])
        lines.append("  ".join([*texts, *values]).rstrip())
    return lines


def contact_sheet(spec: Spec, adapter: str = "auto") -> NDArray[np.uint8]:
    """Return an sRGB picture (h, w, 3) with 16 images at reduced quality, labelled by number.

    They are the first ones, or four frames of each of the first clips.
    """
    from PIL import Image, ImageDraw

    width, height = (max(_SHEET_IMAGE_SIDE * side // max(spec.size), 1) for side in spec.size)
    limited = {name: min(side, getattr(spec.render, name)) for name, side in _MAX_PREVIEW_SIDES.items()}
    clip = None if spec.clip is None else spec.clip.replace(flow=None)
    render = spec.render.replace(size=(width, height), **limited)
    spec = spec.replace(render=render, clip=clip, outputs=(), landmarks=())
    numbers = range(0, spec.count, _sheet_step(spec))[:SHEET_IMAGE_COUNT]
    count = len(numbers)
    columns = min(count, _SHEET_COLUMNS)
    rows = -(-count // columns)
    size = columns * (width + _SHEET_GAP) - _SHEET_GAP, rows * (height + _SHEET_GAP) - _SHEET_GAP
    sheet = Image.new("RGB", size, (20, 20, 20))
    draw = ImageDraw.Draw(sheet)
    pictures = _sheet_pictures(spec, numbers, SceneBuilder(spec), Renderer(adapter))
    for k, (number, picture) in enumerate(zip(numbers, pictures, strict=True)):
        x, y = (k % columns) * (width + _SHEET_GAP), (k // columns) * (height + _SHEET_GAP)
        sheet.paste(Image.fromarray(picture), (x, y))
        draw.text((x + 4, y + 2), str(number), fill=(255, 255, 255), stroke_width=1, stroke_fill=(0, 0, 0))
    return np.array(sheet)


def _sheet_step(spec: Spec) -> int:
    """Return the difference between the numbers of images on the sheet, which has four frames of a clip."""
    return max(spec.sequence.frames // _SHEET_COLUMNS, 1)


def _sheet_pictures(
    spec: Spec, numbers: range, builder: SceneBuilder, renderer: Renderer
) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of a data set as sRGB bytes (h, w, 3)."""
    for k in numbers:
        parameters = spec.parameters(k)
        scene, settings = builder.build(parameters)
        facts = builder.facts(parameters, scene)
        blurred = builder.blur_scenes(k, parameters, scene)
        plan = PlannedImage(k, parameters, facts, scene, settings, None, None, blurred)
        (observation,) = observe_images(renderer, spec, [plan])
        photo, _ = finished_image(observation, parameters, facts, spec)
        alpha = photo.picture[..., 3:] / 255.0 if photo.picture.shape[2] == 4 else 1.0
        yield np.asarray(photo.picture[..., :3] * alpha, np.uint8)  # on black


def _parameter_row(spec: Spec, parameter: str, samples: Sequence[Parameters]) -> ParameterRow:
    values = [sample[parameter] for sample in samples if parameter in sample]
    distribution = spec.distributions.get(parameter)
    text = "" if distribution is None else value_text(distribution.spec_value())
    first = [sample.get(parameter) for sample in samples[:SHEET_IMAGE_COUNT]]
    row: ParameterRow = {"parameter": parameter, "drawn": text, "first": first, "images": len(values)}
    numbers = [value for value in values if not isinstance(value, str)]
    if not numbers:
        return {**row, "counts": dict(Counter(map(str, values)).most_common())}
    return {**row, "min": min(numbers), "mean": float(np.mean(numbers)), "max": max(numbers)}


def _table_cells(parameter_row: ParameterRow) -> tuple[str, ...]:
    text = parameter_row["drawn"]
    if len(text) > _MAX_COLUMN_CHARACTERS:
        text = f"{text[: _MAX_COLUMN_CHARACTERS - 4]} ..."
    fields = parameter_row["parameter"], text, str(parameter_row["images"])
    if "counts" not in parameter_row:
        return *fields, *(
            f"{number:.4g}" for number in (parameter_row["min"], parameter_row["mean"], parameter_row["max"])
        )
    counts = [f"{name} {count}" for name, count in parameter_row["counts"].items()]
    more = f", and {len(counts) - _MAX_LISTED_VALUES} more" if len(counts) > _MAX_LISTED_VALUES else ""
    return *fields, ", ".join(counts[:_MAX_LISTED_VALUES]) + more
