"""Reading of CSV files of numbers, such as recordings and spectra."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.reading import checked_path, read_text
from dermis.base.tables import column_separator

_MAX_FILE_BYTES = 64 << 20


def read_number_table(
    file_name: str | Path, expected: str, column_counts: Collection[int], rows: str
) -> NDArray[np.float64]:
    """Return the numbers (n, c) of a CSV file; comments and a header line are skipped.

    expected : description of the file for errors
    column_counts : numbers of columns that are accepted
    rows : description of a line for errors, such as "two numbers in each line"

    Raises DermisError for a file that cannot be read, and for lines with another number of columns.
    """
    path = checked_path(file_name, expected)
    text = read_text(path, expected, _MAX_FILE_BYTES)
    lines = [line for line in text.splitlines() if line.strip() and line[0] != "#"]
    found = [_numbers(line) for line in lines]
    if found and found[0] is None:
        lines, found = lines[1:], found[1:]
    for line, row in zip(lines, found, strict=True):
        if row is None or len(row) != len(found[0] or ()) or len(row) not in column_counts:
            refuse(path, rows, f"got {format_value(line)}", "Correct it")
    if not found:
        refuse(path, expected, "it is empty", "Correct it")
    return np.array(found, np.float64)


def _numbers(line: str) -> list[float] | None:
    """Return the numbers in a line of a table; None if it contains anything but finite numbers."""
    mark = column_separator(line)
    texts = line.split(mark) if mark == "," else line.replace(",", ".").split(mark)
    try:
        numbers = [float(text) for text in texts]
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None
