"""Datasheet of a data set: README.md for people and dataset.json for programs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import TypedDict

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.goodness_of_fit import FitTest, fit_tests
from dermis.apps.batch.index import parameter_summaries
from dermis.apps.batch.licences import asset_licences
from dermis.apps.batch.output_encoding import LINEAR_PICTURE, file_format, storage_description, stored_output
from dermis.apps.batch.shard_formats import ShardManifest
from dermis.apps.batch.shards import list_shards, read_manifest, shard_exists, shard_path
from dermis.apps.batch.spec import Spec
from dermis.base.tables import read_rows
from dermis.human.labels.classes import label_classes
from dermis.human.landmarks.points import read_landmark_table
from dermis.human.landmarks.sets import LANDMARK_SETS

README_FILE, DESCRIPTION_FILE = "README.md", "dataset.json"
_MAX_LISTED_FAILURES = 50
_CLASS_OUTPUTS = "label", "label_amodal"
_FACE_SYNTHETICS_OUTPUT = "label_face_synthetics"

TableRows = Iterable[Sequence[object]]


def write_datasheet(dataset_folder: Path, spec: Spec) -> None:
    """Write README.md and dataset.json of a data set from its spec, index and shards.

    Data sets with equal specs and identical shards get identical files.

    Raises DermisError if the index is missing, or if a file cannot be written.
    """
    existing = [shard for shard in list_shards(spec) if shard_exists(dataset_folder, shard, spec)]
    text = _readme_text(
        dataset_folder, spec, [read_manifest(shard_path(dataset_folder, shard, spec)) for shard in existing]
    ).encode()
    description = {
        "spec": spec.digest(),
        "count": spec.count,
        "seed": spec.seed,
        "size": list(spec.size),
        "outputs": output_formats(spec),
        "labels": label_names(spec),
        "landmarks": {name: landmark_names(name, spec) for name in spec.landmarks},
    }
    data = (json.dumps(description, indent=1, ensure_ascii=False) + "\n").encode()
    atomic_write(dataset_folder / DESCRIPTION_FILE, lambda path: path.write_bytes(data))
    atomic_write(dataset_folder / README_FILE, lambda path: path.write_bytes(text))


def _readme_text(dataset_folder: Path, spec: Spec, manifests: Sequence[ShardManifest]) -> str:
    width, height = spec.size
    left_out = [image for manifest in manifests for image in manifest.left_out]
    images = sum(manifest.stop - manifest.first for manifest in manifests) - len(left_out)
    facts = [
        ("images", f"{images:,} of {spec.count:,}, {width} x {height} pixels"),
        ("shards", f"{len(manifests):,} of up to {spec.shard_size:,} images, format {spec.format}"),
        ("seed", spec.seed),
        ("SHA-256 of the spec", f"`{spec.digest()}`"),
    ]
    failed = f"\n## Left out\n\n{len(left_out):,} images could not be rendered.\n\n"
    template = resources.files(__package__).joinpath("datasheet.md").read_text("utf-8").removesuffix("\n")
    return Template(template).substitute(
        facts=_markdown_table(("", ""), facts),
        files=_files_table(spec),
        landmarks=_landmarks_section(spec),
        labels=_labels_section(spec),
        parameters=_markdown_table(("parameter", "images", "values"), parameter_summaries(dataset_folder)),
        tests=_fit_tests_table(fit_tests(dataset_folder, spec)),
        licences=_markdown_table(("part", "by", "licence"), asset_licences(spec)),
        made_with=_software_table(manifests),
        left_out=failed + _markdown_table(("image", "reason"), left_out[:_MAX_LISTED_FAILURES])
        if left_out
        else "",
    )


def _files_table(spec: Spec) -> str:
    alpha = ", with alpha" if "none" in spec.background.kind.support else ""
    sensor = ", as the camera of [sensor] stores it (decoded, if that is JPEG)" if spec.sensor else ""
    rig = "rig (all cameras), " if spec.rig else ""
    outputs = [
        (f"{name}.{one['file']}", one["description"], one["unit"], one["stored"], f"{one['background']:g}")
        for name, one in output_formats(spec).items()
    ]
    rows = [
        ("png", f"picture, sRGB{alpha}{sensor}", "", "8-bit PNG", ""),
        *outputs,
        ("json", f"parameters, camera, {rig}head_pose, gaze, boxes, landmarks, split, licence", "", "", ""),
    ]
    return _markdown_table(("file", "content", "unit", "stored as", "background value"), rows)


def _fit_tests_table(fit_test_results: Iterable[FitTest]) -> str:
    rows = [
        (
            *one[:4],
            *(f"{number:.2g}" for number in one[4:]),
            "" if one.is_accepted else "differs from the spec",
        )
        for one in fit_test_results
    ]
    columns = "parameter", "samples", "spec", "sampled", "distance", "expected distance", "p-value", ""
    return _markdown_table(columns, rows)


def _landmarks_section(spec: Spec) -> str:
    if not spec.landmarks:
        return ""
    rows = [(name, len(landmark_names(name, spec))) for name in spec.landmarks]
    title = "## Landmarks\n\n`dataset.json` lists their names in the order of the records.\n\n"
    return title + _markdown_table(("set", "points"), rows)


def _labels_section(spec: Spec) -> str:
    return "\n".join(
        f"## Classes of {name}\n\n{_markdown_table(('level', 'classes'), names.items())}"
        for name, names in label_names(spec).items()
    )


def _software_table(manifests: Sequence[ShardManifest]) -> str:
    counts = Counter(tuple(sorted(manifest.made_with.items())) for manifest in manifests)
    rows = [
        (count, ", ".join(f"{name} {value}" for name, value in versions))
        for versions, count in sorted(counts.items())
    ]
    return _markdown_table(("shards", "rendered with"), rows)


def _markdown_table(column_names: Sequence[str], table_rows: TableRows) -> str:
    lines = [column_names, ["---"] * len(column_names), *table_rows]
    cells = [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in line] for line in lines]
    return "".join(f"| {' | '.join(line)} |\n" for line in cells)


class OutputFormat(TypedDict):
    """File format of an output array, for programs that read the data set.

    A stored number `level` stands for the value (level - zero) * step. If `step` is 1 and
    `zero` is 0, values are stored unscaled.
    """

    file: str
    stored: str
    step: float
    zero: int
    unit: str
    description: str
    background: float


def output_formats(spec: Spec) -> dict[str, OutputFormat]:
    """Return the file format of each output of a spec."""
    formats: dict[str, OutputFormat] = {}
    for name in spec.stored_outputs:
        output, file = stored_output(name), file_format(name, spec.encoding)
        step, zero = (1.0, 0) if output.quantisation is None or file != "png" else output.quantisation
        formats[name] = {
            "file": file,
            "stored": storage_description(name, spec.encoding),
            "step": step,
            "zero": zero,
            "unit": output.unit,
            "description": output.description.partition(", see ")[0],  # without links to the documentation
            "background": output.background,
        }
    if spec.keep_linear:
        formats[LINEAR_PICTURE] = {
            "file": "exr",
            "stored": "OpenEXR, 16-bit floats",
            "step": 1.0,
            "zero": 0,
            "unit": "",
            "description": "linear Rec. 709 picture before the model of the sensor",
            "background": 0.0,
        }
    return formats


def label_names(spec: Spec) -> dict[str, dict[int, str]]:
    """Return, for each output of the spec that labels pixels, a dictionary from pixel value to class name."""
    by_output: dict[str, dict[int, str]] = {}
    for one in label_classes():
        levels = dict.fromkeys(_CLASS_OUTPUTS, one.number) | {_FACE_SYNTHETICS_OUTPUT: one.face_synthetics}
        for output, level in levels.items():
            if output in spec.outputs:
                names = by_output.setdefault(output, {})
                names[level] = f"{names[level]}, {one.name}" if level in names else one.name
    return {output: dict(sorted(names.items())) for output, names in by_output.items()}


def landmark_names(set_name: str, spec: Spec) -> list[str]:
    """Return the ordered names of the landmarks in a set.

    set_name : name of a preset landmark set, or of a landmark table of the spec
    """
    if set_name in LANDMARK_SETS:
        rows = read_rows("dermis.human.landmarks", set_name)
        return list(dict.fromkeys(row["landmark"] for row in rows))  # candidates share a name
    return [landmark for landmark, _ in read_landmark_table(spec.landmark_tables[set_name])]
