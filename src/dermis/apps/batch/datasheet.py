"""Datasheet of a data set: README.md for people, dataset.json for programs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import TypedDict

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.goodness_of_fit import FitTest, fit_tests
from dermis.apps.batch.index import statistics
from dermis.apps.batch.output_encoding import file_format, storage_description
from dermis.apps.batch.shard_formats import ShardManifest
from dermis.apps.batch.shards import is_there, shard_path, list_shards, read_manifest
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
_LABELS = "label", "label_face_synthetics"
_OURS = {"none", "uniform", "human"}

Rows = Iterable[Sequence[object]]


def write_datasheet(out: Path, spec: Spec) -> None:
    """Write the description of the data set in a folder, by its spec, its index and its shards.

    The same shards give the same bytes. Raises DermisError where the index is missing, and where nothing can
    be written.
    """
    there = [shard for shard in list_shards(spec) if is_there(out, shard, spec)]
    text = _readme(out, spec, [read_manifest(shard_path(out, shard, spec)) for shard in there]).encode()
    description = {
        "spec": spec.digest(),
        "count": spec.count,
        "seed": spec.seed,
        "size": list(spec.size),
        "outputs": output_facts(spec),
        "labels": classes(spec),
        "landmarks": {name: landmark_names(name, spec) for name in spec.landmarks},
    }
    data = (json.dumps(description, indent=1, ensure_ascii=False) + "\n").encode()
    atomic_write(out / DESCRIPTION, lambda path: path.write_bytes(data))
    atomic_write(out / README, lambda path: path.write_bytes(text))


def _readme(out: Path, spec: Spec, stamps: Sequence[ShardManifest]) -> str:
    width, height = spec.size
    left_out = [one for stamp in stamps for one in stamp.left_out]
    images = sum(stamp.stop - stamp.first for stamp in stamps) - len(left_out)
    facts = [
        ("images", f"{images:,} of {spec.count:,}, {width} x {height} pixels"),
        ("shards", f"{len(stamps):,} of up to {spec.shard_size:,} images, format {spec.format}"),
        ("seed", spec.seed),
        ("SHA-256 of the spec", f"`{spec.digest()}`"),
    ]
    failed = f"\n## Left out\n\n{len(left_out):,} images could not be made.\n\n"
    template = resources.files(__package__).joinpath("datasheet.md").read_text("utf-8").removesuffix("\n")
    return Template(template).substitute(
        facts=_table(("", ""), facts),
        files=_files(spec),
        landmarks=_landmarks(spec),
        labels=_labels(spec),
        parameters=_table(("parameter", "images", "values"), statistics(out)),
        tests=_tests(fit_tests(out, spec)),
        licences=_table(("part", "by", "licence"), licences(spec)),
        made_with=_made_with(stamps),
        left_out=failed + _table(("image", "why"), left_out[:_MOST_LISTED]) if left_out else "",
    )


def _files(spec: Spec) -> str:
    alpha = ", with alpha" if "none" in spec.background.kind.support else ""
    outputs = [
        (f"{name}.{one['file']}", one["description"], one["unit"], one["stored"], f"{one['background']:g}")
        for name, one in output_facts(spec).items()
    ]
    rows = [
        ("png", f"picture, sRGB{alpha}", "", "8-bit PNG", ""),
        *outputs,
        ("json", "parameters, camera, head_pose, gaze, landmarks", "", "", ""),
    ]
    return _table(("file", "content", "unit", "stored as", "where nothing is seen"), rows)


def _tests(tests: Iterable[FitTest]) -> str:
    rows = [
        (*one[:4], *(f"{size:.2g}" for size in one[4:]), "" if one.agrees else "not as stated")
        for one in tests
    ]
    return _table(("parameter", "draws", "stated", "found", "distance", "usual", "chance", ""), rows)


def _landmarks(spec: Spec) -> str:
    if not spec.landmarks:
        return ""
    rows = [(name, len(landmark_names(name, spec))) for name in spec.landmarks]
    title = "## Landmarks\n\nTheir names stand in `dataset.json`, in the order of the records.\n\n"
    return title + _table(("set", "points"), rows)


def _labels(spec: Spec) -> str:
    return "\n".join(
        f"## Classes of {name}\n\n{_table(('level', 'classes'), names.items())}"
        for name, names in classes(spec).items()
    )


def _made_with(stamps: Sequence[ShardManifest]) -> str:
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


class OutputFacts(TypedDict):
    """Facts of an output's files: value = (level - zero) * step; (1, 0) for numbers as they are."""

    file: str
    stored: str
    step: float
    zero: int
    unit: str
    description: str
    background: float


def output_facts(spec: Spec) -> dict[str, OutputFacts]:
    """Return the facts of the files of each output."""
    found: dict[str, OutputFacts] = {}
    for name in spec.outputs:
        output, file = OUTPUTS[name], file_format(name, spec.encoding)
        step, zero = (1.0, 0) if output.levels is None or file != "png" else output.levels
        found[name] = {
            "file": file,
            "stored": storage_description(name, spec.encoding),
            "step": step,
            "zero": zero,
            "unit": output.unit,
            "description": output.description.partition(", see ")[0],  # pages are elsewhere
            "background": output.background,
        }
    return found


def classes(spec: Spec) -> dict[str, dict[int, str]]:
    """Return the names of the classes by level, of each output of the spec that holds labels."""
    found: dict[str, dict[int, str]] = {}
    for one in label_classes():
        for output, level in zip(_LABELS, (one.number, one.face_synthetics), strict=True):
            if output in spec.outputs:
                named = found.setdefault(output, {})
                named[level] = f"{named[level]}, {one.name}" if level in named else one.name
    return {output: dict(sorted(named.items())) for output, named in found.items()}


def landmark_names(name: str, spec: Spec) -> list[str]:
    """Return the names of the points of a set, or of a table of the spec, in order."""
    if name in SETS:
        return [row["landmark"] for row in read_rows("dermis.human.landmarks", name)]
    return [landmark for landmark, _ in table_points(spec.landmark_tables[name])]


def licences(spec: Spec) -> Iterator[tuple[str, str, str]]:
    """Yield part, author and licence of everything that the spec can render."""
    author, _, licence = THANKS.rpartition(", ")
    yield "people: the parametric human", author, licence
    for parameter in ("person.head", "environment.name"):
        found = spec.distributions.get(parameter)
        for name in () if found is None else map(str, found.support):
            if name in SAMPLES:
                yield f"{parameter} {name}", SAMPLES[name].attribution, SAMPLES[name].licence
            elif name not in _OURS and not name.startswith("human:"):
                yield f"{parameter} {name}", "a file of the spec", "its owner's: state it here"
    yield "light, skin and pictures", "computed by dermis (Apache-2.0)", "none is claimed"
