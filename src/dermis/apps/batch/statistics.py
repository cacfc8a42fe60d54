"""What was drawn for a data set, in a few numbers for each parameter."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dermis.apps.batch.index import NUMBERS, index_file
from dermis.base.extras import needed

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
