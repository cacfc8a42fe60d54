"""CSV tables of the package, with comments above the header: quantity, unit, source and licence."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from importlib import resources

import numpy as np
from numpy.typing import NDArray

Rows = list[dict[str, str]]


def read_rows(package: str, name: str) -> Rows:
    """Return the rows of a package's table `name`.csv as dictionaries by column name."""
    return parse_rows(resources.files(package).joinpath(f"{name}.csv").read_text("utf-8"))


def parse_rows(text: str) -> Rows:
    """Return the rows of a CSV text as dictionaries by column name, without lines that start with #."""
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def float_columns(rows: Sequence[Mapping[str, str]], columns: str) -> NDArray[np.float64]:
    """Return columns of a table as floats, (rows, columns).

    columns : names of the columns, separated by spaces
    """
    return np.array([[float(row[name]) for name in columns.split()] for row in rows])
