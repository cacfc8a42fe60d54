"""Index of a data set: the sampled parameters of each image as a table, and statistics of its columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.reader import record_of, shard_files
from dermis.apps.batch.records import RECORD
from dermis.apps.batch.shards import is_there, shard_path, shards_of
from dermis.apps.batch.spec import Spec
from dermis.base.errors import refuse
from dermis.base.extras import needed
from dermis.base.reading import is_file

INDEX = "index.parquet"
NUMBERS = {"camera.K": 9, "camera.R": 9, "camera.t": 3, "head_pose": 12, "gaze": 6}
"""Columns that are lists, row by row of their matrix, and how long."""
_FIRST = "number", "key", "shard"

Row = dict[str, Any]


def write_index(out: Path, spec: Spec) -> Path:
    """Write the index of the shards that are there, a row for each image by its number.

    number, key, shard : which image it is, and in which file it lies
    camera.K, camera.R, camera.t, head_pose, gaze : matrices, row by row
    the others : parameters by name, null where an image has none

    The same shards give the same bytes. Raises DermisError for damaged shards, where pyarrow is missing, and
    where nothing can be written.
    """
    parquet, target = needed("pyarrow.parquet", "the index of a data set"), out / INDEX
    schema = _schema(out, spec)

    def write(path: Path) -> None:
        with parquet.ParquetWriter(path, schema, compression="zstd", store_schema=False) as writer:
            for rows in _rows_of_shards(out, spec):
                writer.write_table(_table(rows, schema))

    atomic_write(target, write)
    return target


def index_file(out: Path, purpose: str) -> Any:
    """The index of a data set, open to be read column by column.

    Raises DermisError where there is none.
    """
    parquet = needed("pyarrow.parquet", purpose)
    if not is_file(out / INDEX):
        refuse(out, f"a data set with {INDEX}", "it is missing", "Run dermis batch again")
    return parquet.ParquetFile(out / INDEX)


def _rows_of_shards(out: Path, spec: Spec) -> Iterator[list[Row]]:
    """Rows of each shard that is there and holds images; one of them is held at a time."""
    for shard in shards_of(spec):
        path = shard_path(out, shard, spec)
        if not is_there(out, shard, spec):
            continue
        with shard_files(path) as images:
            rows = [
                _row(key, path.name, record_of(files[RECORD](), path / key))
                for key, files in images.items()
                if RECORD in files
            ]
        if rows:
            yield rows


def _row(key: str, shard: str, record: Mapping[str, Any]) -> Row:
    camera = {f"camera.{name}": _flat(value) for name, value in record["camera"].items()}
    poses = {name: _flat(record[name]) for name in ("head_pose", "gaze")}
    return {"number": record["number"], "key": key, "shard": shard, **record["parameters"], **camera, **poses}


def _flat(value: Any) -> Any:
    if value is None or not value or not isinstance(value[0], list):
        return value
    return [one for row in value for one in row]


def _schema(out: Path, spec: Spec) -> Any:
    """Columns with their kinds; those of parameters by name."""
    arrow = needed("pyarrow", "the index of a data set")
    kinds: dict[str, set[type]] = {}
    for rows in _rows_of_shards(out, spec):
        for row in rows:
            for name, value in row.items():
                if value is not None:
                    kinds.setdefault(name, set()).add(type(value))
    parameters = sorted(kinds.keys() - NUMBERS.keys() - set(_FIRST))
    columns = [("number", arrow.int64()), ("key", arrow.string()), ("shard", arrow.string())]
    columns += [(name, arrow.list_(arrow.float64(), size)) for name, size in NUMBERS.items()]
    columns += [(name, _column_kind(arrow, kinds[name])) for name in parameters]
    return arrow.schema(columns)


def _column_kind(arrow: Any, kinds: set[type]) -> Any:
    if kinds <= {bool}:
        return arrow.bool_()
    if kinds <= {int}:
        return arrow.int64()
    if kinds <= {int, float}:
        return arrow.float64()
    return arrow.list_(arrow.float64()) if kinds <= {list} else arrow.string()


def _table(rows: list[Row], schema: Any) -> Any:
    arrow = needed("pyarrow", "the index of a data set")
    columns = []
    for field in schema:
        values = [row.get(field.name) for row in rows]
        if arrow.types.is_string(field.type):
            values = [None if one is None else str(one) for one in values]
        columns.append(arrow.array(values, field.type))
    return arrow.Table.from_arrays(columns, schema=schema)


_MOST_NAMED = 12
_NO_PARAMETERS = frozenset(("number", "key", "shard", *NUMBERS))


def statistics(out: Path) -> Iterator[tuple[str, int, str]]:
    """Name, number of images that have it, and values of each parameter in the index of a data set.

    Raises DermisError where there is no index.
    """
    with index_file(out, "the statistics of a data set") as file:
        for name in file.schema_arrow.names:
            if name not in _NO_PARAMETERS:
                column = file.read(columns=[name]).column(0)
                yield name, len(column) - column.null_count, _values(column)


def _values(column: Any) -> str:
    arrow = needed("pyarrow", "the statistics of a data set")
    compute = needed("pyarrow.compute", "the statistics of a data set")
    if arrow.types.is_string(column.type) or arrow.types.is_boolean(column.type):
        counts = {one["values"]: one["counts"] for one in compute.value_counts(column).to_pylist()}
        counts.pop(None, None)
        sorted_counts = sorted(counts.items(), key=lambda one: (-one[1], str(one[0])))
        named = [f"{value} ({count:,})" for value, count in sorted_counts[:_MOST_NAMED]]
        more = len(sorted_counts) - len(named)
        return ", ".join(named) + (f" and {more:,} more" if more else "")
    if arrow.types.is_list(column.type):
        return "lists of numbers"
    ends = compute.min_max(column).as_py()
    if ends["min"] == ends["max"]:
        return _number(ends["min"])
    mean, spread = compute.mean(column).as_py(), compute.stddev(column).as_py()
    return (
        f"{_number(ends['min'])} to {_number(ends['max'])}, mean {mean:.4g}, standard deviation {spread:.4g}"
    )


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.6g}"
