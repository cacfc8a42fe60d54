"""Tables that the package ships: CSV with a header in comments (quantity, unit, source, licence)."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from importlib import resources

import numpy as np
from numpy.typing import NDArray

Rows = list[dict[str, str]]


def read_rows(package: str, name: str) -> Rows:
    """The rows of a package's table `name`.csv."""
    return parse_rows(resources.files(package).joinpath(f"{name}.csv").read_text("utf-8"))


def parse_rows(text: str) -> Rows:
    """The rows of a table by the names of their columns, without the comments after #."""
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def numbers(rows: Sequence[Mapping[str, str]], columns: str) -> NDArray[np.float64]:
    """(rows, columns) numbers of the columns named, with spaces between the names."""
    return np.array([[float(row[name]) for name in columns.split()] for row in rows])
