"""Reading of the CSV tables of the package.

Comments above the header of a table state the quantity, unit, source and licence.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

Rows = list[dict[str, str]]


def read_rows(package: str, table_name: str) -> Rows:
    """Return the rows of a CSV table in a package, each as a dictionary from column name to text.

    package : name of the package, such as "dermis.environment"
    table_name : path of the table in the package, without .csv
    """
    return parse_rows(resources.files(package).joinpath(f"{table_name}.csv").read_text("utf-8"))


def parse_rows(csv_text: str) -> Rows:
    """Parse each row of a CSV text as a dictionary from column name to text.

    Lines that start with # are comments.
    """
    return list(csv.DictReader(line for line in csv_text.splitlines() if not line.startswith("#")))


def column_separator(table_line: str) -> str:
    """Return the separator of a line of a table: a tab if the line has one, else a semicolon, else a comma.

    In lines with tabs or semicolons, commas are decimal signs.
    """
    return next((mark for mark in "\t;" if mark in table_line), ",")


@lru_cache(4096)
def plain_key(key_or_column: str) -> str:
    """Return a key or column name in lower case without punctuation, such as timestampms for timestamp_ms."""
    return re.sub(r"[\W_]", "", key_or_column).casefold()


def float_columns(table_rows: Sequence[Mapping[str, str]], column_names: str) -> NDArray[np.float64]:
    """Return selected columns of a table as an array of floats (rows, columns).

    table_rows : rows of the table, each a mapping from column name to text
    column_names : names of the columns, separated by spaces
    """
    return np.array([[float(row[name]) for name in column_names.split()] for row in table_rows])
