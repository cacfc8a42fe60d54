"""Index of a data set (a Parquet table with the parameters of each image), and summaries of its columns."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.face_boxes import BOX_NAMES
from dermis.apps.batch.reader import read_record, shard_files
from dermis.apps.batch.records import RECORD_SUFFIX, Record
from dermis.apps.batch.shards import list_shards, shard_exists, shard_path
from dermis.apps.batch.spec import Spec
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.base.reading import is_file

if TYPE_CHECKING:
    import pyarrow
    import pyarrow.parquet

INDEX_FILE = "index.parquet"
MATRIX_COLUMNS = {
    "camera.K": 9,
    "camera.R": 9,
    "camera.t": 3,
    "head_pose": 12,
    "gaze": 6,
    "gaze_error_deg": 2,
    **{f"box.{name}": 4 for name in BOX_NAMES},
}
"""Columns of flattened matrices (row by row), with the number of elements."""
_IDENTIFIER_COLUMNS = "number", "key", "shard"
_TEXT_COLUMNS = "split", "licence"
_MAX_LISTED_VALUES = 12

IndexRow = dict[str, object]


def write_index(dataset_folder: Path, spec: Spec) -> Path:
    """Write the index of the existing shards, with one row per image; return the path of the index.

    The columns "number", "key" and "shard" identify the image and its file; "split" is "train", "val" or
    "test", by person; "camera.K", "camera.R", "camera.t", "head_pose" and "gaze" are flattened matrices;
    "gaze_error_deg" contains a number for each eye; columns that begin with "box." contain the edges of a
    box; columns that begin with "skin_tone." describe the colour of the skin; all other columns are
    parameters, with null for images without the parameter.

    Identical shards give an identical index.

    Raises DermisError if a shard is damaged, if pyarrow is missing, or if the file cannot be written.
    """
    parquet, target = import_extra("pyarrow.parquet", "the index of a data set"), dataset_folder / INDEX_FILE
    schema = _index_schema(dataset_folder, spec)

    def write_parquet(path: Path) -> None:
        with parquet.ParquetWriter(path, schema, compression="zstd", store_schema=False) as writer:
            for rows in _rows_of_shards(dataset_folder, spec):
                writer.write_table(_arrow_table(rows, schema))

    atomic_write(target, write_parquet)
    return target


def open_index(dataset_folder: Path, purpose: str) -> pyarrow.parquet.ParquetFile:
    """Open the index of a data set and return its Parquet file, from which single columns can be read.

    purpose : task that needs the index, as a noun phrase for the error message if pyarrow is missing

    Raises DermisError if there is no index.
    """
    parquet = import_extra("pyarrow.parquet", purpose)
    if not is_file(dataset_folder / INDEX_FILE):
        refuse(
            dataset_folder,
            f"a data set with {INDEX_FILE}",
            "it is missing",
            "Run dermis batch again to write it",
        )
    return parquet.ParquetFile(dataset_folder / INDEX_FILE)


def parameter_summaries(dataset_folder: Path) -> Iterator[tuple[str, int, str]]:
    """Yield (name, number of values, text that summarises the values) for each parameter in the index.

    An image that does not use a parameter has no value of this parameter.

    Raises DermisError if there is no index.
    """
    with open_index(dataset_folder, "the statistics of a data set") as file:
        for name in file.schema_arrow.names:
            if name not in (*_IDENTIFIER_COLUMNS, *MATRIX_COLUMNS, *_TEXT_COLUMNS):
                column = file.read(columns=[name]).column(0)
                yield name, len(column) - column.null_count, _column_summary(column)


def _rows_of_shards(dataset_folder: Path, spec: Spec) -> Iterator[list[IndexRow]]:
    """Yield the index rows of each existing shard that contains images, one shard at a time."""
    for shard in list_shards(spec):
        path = shard_path(dataset_folder, shard, spec)
        if not shard_exists(dataset_folder, shard, spec):
            continue
        with shard_files(path) as images:
            rows = [
                _index_row(key, path.name, read_record(files[RECORD_SUFFIX](), path / key))
                for key, files in images.items()
                if RECORD_SUFFIX in files
            ]
        if rows:
            yield rows


def _index_row(image_key: str, shard: str, record: Record) -> IndexRow:
    matrices = {f"camera.{name}": value for name, value in record["camera"].items()}
    matrices |= {name: record.get(name) for name in ("head_pose", "gaze", "gaze_error_deg")}
    matrices |= {f"box.{name}": box for name, box in (record.get("boxes") or {}).items()}
    flat = {name: _flatten_matrix(value) for name, value in matrices.items()}
    tone = {f"skin_tone.{name}": one for name, one in (record.get("skin_tone") or {}).items()}
    tone.pop("skin_tone.statement", None)
    return {
        "number": record["number"],
        "key": image_key,
        "shard": shard,
        **{name: record.get(name) for name in _TEXT_COLUMNS},
        **record["parameters"],
        **tone,
        **flat,
    }


def _flatten_matrix(matrix: object) -> object:
    if not isinstance(matrix, list) or not matrix or not isinstance(matrix[0], list):
        return matrix
    return [one for row in matrix for one in row]


def _index_schema(dataset_folder: Path, spec: Spec) -> pyarrow.Schema:
    """Return names and types of the index columns, with the columns of parameters sorted by name."""
    arrow = import_extra("pyarrow", "the index of a data set")
    kinds: dict[str, set[type]] = {}
    for rows in _rows_of_shards(dataset_folder, spec):
        for row in rows:
            for name, value in row.items():
                kinds.setdefault(name, set()).update(() if value is None else (type(value),))
    parameters = sorted(kinds.keys() - MATRIX_COLUMNS.keys() - {*_IDENTIFIER_COLUMNS, *_TEXT_COLUMNS})
    columns = [("number", arrow.int64())]
    columns += [(name, arrow.string()) for name in _IDENTIFIER_COLUMNS[1:]]
    columns += [(name, arrow.list_(arrow.float64(), size)) for name, size in MATRIX_COLUMNS.items()]
    columns += [(name, arrow.string()) for name in _TEXT_COLUMNS]
    columns += [(name, _column_type(kinds[name])) for name in parameters]
    return arrow.schema(columns)


def _column_type(value_types: set[type]) -> pyarrow.DataType:
    arrow = import_extra("pyarrow", "the index of a data set")
    if not value_types:  # no image has a value
        return arrow.float64()
    if value_types <= {bool}:
        return arrow.bool_()
    if value_types <= {int}:
        return arrow.int64()
    if value_types <= {int, float}:
        return arrow.float64()
    return arrow.list_(arrow.float64()) if value_types <= {list} else arrow.string()


def _arrow_table(index_rows: list[IndexRow], schema: pyarrow.Schema) -> pyarrow.Table:
    arrow = import_extra("pyarrow", "the index of a data set")
    columns = []
    for field in schema:
        values = [row.get(field.name) for row in index_rows]
        if arrow.types.is_string(field.type):
            values = [None if one is None else str(one) for one in values]
        columns.append(arrow.array(values, field.type))
    return arrow.Table.from_arrays(columns, schema=schema)


def _column_summary(column: pyarrow.ChunkedArray) -> str:
    arrow = import_extra("pyarrow", "the statistics of a data set")
    compute = import_extra("pyarrow.compute", "the statistics of a data set")
    if column.null_count == len(column):
        return "unused"
    if arrow.types.is_string(column.type) or arrow.types.is_boolean(column.type):
        counts = {one["values"]: one["counts"] for one in compute.value_counts(column).to_pylist()}
        counts.pop(None, None)
        sorted_counts = sorted(counts.items(), key=lambda one: (-one[1], str(one[0])))
        listed = [f"{value} ({count:,})" for value, count in sorted_counts[:_MAX_LISTED_VALUES]]
        more = len(sorted_counts) - len(listed)
        return ", ".join(listed) + (f" and {more:,} more" if more else "")
    if arrow.types.is_list(column.type):
        return "lists of numbers"
    minimum, maximum = compute.min_max(column).as_py().values()
    if minimum == maximum:
        return _format_number(minimum)
    mean, deviation = compute.mean(column).as_py(), compute.stddev(column).as_py()
    limits = f"{_format_number(minimum)} to {_format_number(maximum)}"
    return f"{limits}, mean {mean:.4g}, standard deviation {deviation:.4g}"


def _format_number(number: float) -> str:
    return str(number) if isinstance(number, int) else f"{number:.6g}"
