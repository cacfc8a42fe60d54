"""What a data set says of itself: README.md for people, dataset.json for programs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.goodness_of_fit import FitTest, fit_tests
from dermis.apps.batch.index import statistics
from dermis.apps.batch.output_encoding import file_kind, stored_as
from dermis.apps.batch.shard_formats import Stamp
from dermis.apps.batch.shards import is_there, shard_path, shards_of, stamp_of
from dermis.apps.batch.spec import Spec
from dermis.base.tables import read_rows
from dermis.formats.samples import SAMPLES
from dermis.human.labels.classes import label_classes
from dermis.human.landmarks.points import table_points
from dermis.human.landmarks.sets import SETS
from dermis.human.model import THANKS
from dermis.scene.outputs import OUTPUTS

README, DESCRIPTION = "README.md", "dataset.json"
_MOST_LISTED = 50
_TITLE = """# Images of faces with ground truth

Drawn by dermis. `dermis batch spec.toml -o FOLDER` draws all of it again: with the same versions the same to
the bit on the same kind of adapter.
"""
_DRAWN = """## What was drawn

`spec.toml` says from which distributions, `index.parquet` what for each image.
"""
_FILES = """## Files of each image

Named by the image's number, as in 000000012.png. Outputs are those of each pixel's middle, not filtered.
Cameras are OpenCV's, K (R X + t): x to the right, y down, z forward; the middle of the first pixel is (0, 0).
Places are in mm from the head's centre, and `head_pose` goes from the head at rest to the camera. In Python,
`dermis.read_dataset(FOLDER)` reads all of it.

"""

_STATED = """## Drawn and stated

What varies, against its distribution in `spec.toml`: mean and standard deviation, or shares; the greatest
distance of both (Kolmogorov and Smirnov's; for texts, of two shares), and what it usually is for so many
draws; the chance of one as great by chance alone (for texts, of a chi-square as great). Rows below 1e-6 are
marked. People count once.

"""

Rows = Iterable[Sequence[object]]


def write_datasheet(out: Path, spec: Spec) -> None:
    """Write what the data set in a folder says of itself, by its spec, its index and its shards.

    The same shards give the same bytes. Raises DermisError where the index is missing, and where nothing can
    be written.
    """
    there = [shard for shard in shards_of(spec) if is_there(out, shard, spec)]
    stamps = [stamp_of(shard_path(out, shard, spec)) for shard in there]
    text = _readme(spec, stamps, statistics(out), fit_tests(out, spec)).encode()
    description = (json.dumps(_description(spec), indent=1, ensure_ascii=False) + "\n").encode()
    atomic_write(out / DESCRIPTION, lambda path: path.write_bytes(description))
    atomic_write(out / README, lambda path: path.write_bytes(text))


def _description(spec: Spec) -> dict[str, Any]:
    return {
        "spec": spec.digest(),
        "count": spec.count,
        "seed": spec.seed,
        "size": list(spec.size),
        "outputs": outputs_of(spec),
        "labels": classes(spec),
        "landmarks": {name: landmark_names(name, spec) for name in spec.landmarks},
    }


def _readme(spec: Spec, stamps: Sequence[Stamp], drawn: Rows, agreed: Iterable[FitTest]) -> str:
    width, height = spec.size
    left_out = [one for stamp in stamps for one in stamp.left_out]
    images = sum(stamp.stop - stamp.first for stamp in stamps) - len(left_out)
    faces = [
        ("images", f"{images:,} of {spec.count:,}, {width} x {height} pixels"),
        ("shards", f"{len(stamps):,} of up to {spec.shard_size:,} images, format {spec.format}"),
        ("seed", spec.seed),
        ("SHA-256 of the spec", f"`{spec.digest()}`"),
    ]
    parts = [
        _TITLE,
        _table(("", ""), faces),
        _files(spec),
        _landmarks(spec),
        _labels(spec),
        _DRAWN,
        _table(("parameter", "images", "values"), drawn),
        _stated(agreed),
        "## Licences\n",
        _table(("part", "by", "licence"), licences(spec)),
        "## Made with\n",
        _made_with(stamps),
    ]
    if left_out:
        listed = left_out[:_MOST_LISTED]
        parts += [
            f"## Left out\n\n{len(left_out):,} images could not be made.\n",
            _table(("image", "why"), listed),
        ]
    return "\n".join(parts)


def _files(spec: Spec) -> str:
    rows: list[Sequence[object]] = [
        ("png", "picture, sRGB" + (", with alpha" if _has_alpha(spec) else ""), "", "8-bit PNG", "")
    ]
    rows += [
        (f"{name}.{one['file']}", one["description"], one["unit"], one["stored"], f"{one['background']:g}")
        for name, one in outputs_of(spec).items()
    ]
    rows.append(("json", "parameters, camera, head_pose, gaze, landmarks", "", "", ""))
    return _FILES + _table(("file", "content", "unit", "stored as", "where nothing is seen"), rows)


def _stated(agreed: Iterable[FitTest]) -> str:
    """The distances of what was drawn from what is stated."""
    rows = [
        (*one[:4], *(f"{size:.2g}" for size in one[4:]), "" if one.agrees else "not as stated")
        for one in agreed
    ]
    heads = "parameter", "draws", "stated", "found", "distance", "usual", "chance", ""
    return _STATED + _table(heads, rows)


def _has_alpha(spec: Spec) -> bool:
    return "none" in spec.background.kind.ends


def _landmarks(spec: Spec) -> str:
    if not spec.landmarks:
        return ""
    rows = [(name, len(landmark_names(name, spec))) for name in spec.landmarks]
    return "## Landmarks\n\nTheir names stand in `dataset.json`, in the order of the records.\n\n" + _table(
        ("set", "points"), rows
    )


def _labels(spec: Spec) -> str:
    found = classes(spec)
    return "\n".join(
        f"## Classes of {name}\n\n{_table(('level', 'classes'), names.items())}"
        for name, names in found.items()
    )


def _made_with(stamps: Sequence[Stamp]) -> str:
    counted = Counter(tuple(sorted(stamp.made_with.items())) for stamp in stamps)
    rows = [
        (count, ", ".join(f"{name} {value}" for name, value in made))
        for made, count in sorted(counted.items())
    ]
    return _table(("shards", "by"), rows)


def _table(heads: Sequence[str], rows: Rows) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    cells = [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in line] for line in lines]
    return "".join(f"| {' | '.join(line)} |\n" for line in cells)


_LABELS = "label", "label_face_synthetics"


def outputs_of(spec: Spec) -> dict[str, dict[str, Any]]:
    """Of each output: kind of its files, how numbers are stored, unit, content, value of the background."""
    return {
        name: {
            "file": file_kind(name, spec.encoding),
            "stored": stored_as(name, spec.encoding),
            "step": _levels(name, spec)[0],
            "zero": _levels(name, spec)[1],
            "unit": OUTPUTS[name].unit,
            "description": OUTPUTS[name].description.partition(", see ")[0],  # pages are elsewhere
            "background": OUTPUTS[name].background,
        }
        for name in spec.outputs
    }


def classes(spec: Spec) -> dict[str, dict[int, str]]:
    """Names of the classes by level, of each output of the spec that holds labels."""
    found: dict[str, dict[int, str]] = {}
    for one in label_classes():
        for output, level in zip(_LABELS, (one.number, one.face_synthetics), strict=True):
            if output in spec.outputs:
                named = found.setdefault(output, {})
                named[level] = f"{named[level]}, {one.name}" if level in named else one.name
    return {output: dict(sorted(named.items())) for output, named in found.items()}


def landmark_names(name: str, spec: Spec) -> list[str]:
    """Of the points of a set, or of a table that the spec names, in their order."""
    if name in SETS:
        return [row["landmark"] for row in read_rows("dermis.human.landmarks", name)]
    return [landmark for landmark, _ in table_points(spec.landmark_tables[name])]


def _levels(name: str, spec: Spec) -> tuple[float, int]:
    """Step and zero of its levels: value = (level - zero) * step; (1, 0) for numbers as they are."""
    levels = OUTPUTS[name].levels
    return (1.0, 0) if levels is None or file_kind(name, spec.encoding) != "png" else levels


_OURS = {"none", "uniform", "human"}


def licences(spec: Spec) -> Iterator[tuple[str, str, str]]:
    """Part, author and licence of all that the spec can draw.

    Files that it names are their owner's.
    """
    author, _, licence = THANKS.rpartition(", ")
    yield "people: the parametric human", author, licence
    for parameter in ("person.head", "environment.name"):
        found = spec.distributions.get(parameter)
        for name in () if found is None else map(str, found.ends):
            if name in SAMPLES:
                yield f"{parameter} {name}", SAMPLES[name].attribution, SAMPLES[name].licence
            elif name not in _OURS and not name.startswith("human:"):
                yield f"{parameter} {name}", "a file of the spec", "its owner's: state it here"
    yield "light, skin and pictures", "computed by dermis (Apache-2.0)", "none is claimed"
