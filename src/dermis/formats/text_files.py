"""Decoding of mesh files that are text, parsing of their numbers into arrays, and lists of names."""

from __future__ import annotations

import codecs
import re
from collections.abc import Collection
from itertools import islice
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Bytes, Index, Mask
from dermis.base.errors import format_value

_MAX_LISTED_NAMES, _MAX_NAME_LENGTH = 8, 40
_PLAIN_NAME_PATTERN = re.compile(rf"[\w.()/ -]{{1,{_MAX_NAME_LENGTH}}}")
_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
T = TypeVar("T", np.float64, np.int64)


def decode_text(encoded_text: bytes) -> str:
    """Decode a text, with line feeds as the only line ends.

    encoded_text : UTF-8, or UTF-16 with a byte order mark; lines that are not valid UTF-8 are read as Latin-1

    Raises ValueError for damaged UTF-16.
    """
    if encoded_text.startswith(_UTF16_MARKS):
        text = encoded_text.decode("utf-16")
    else:
        encoded_text = encoded_text.removeprefix(codecs.BOM_UTF8)
        try:
            text = encoded_text.decode("utf-8")
        except UnicodeDecodeError:
            text = "\n".join(map(_decode_line, encoded_text.replace(b"\r", b"\n").split(b"\n")))
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def _decode_line(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def join_names(names: Collection[str]) -> str:
    """Return the first eight names as text for a message, with the number of further names."""
    first, more = islice(names, _MAX_LISTED_NAMES), len(names) - _MAX_LISTED_NAMES
    shown = [
        name if _PLAIN_NAME_PATTERN.fullmatch(name) else format_value(name, _MAX_NAME_LENGTH)
        for name in first
    ]
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")


def run_starts(run_mask: Mask) -> Index:
    """Return the index at which each run of consecutive True values in a mask (n,) starts."""
    first = run_mask.copy()
    first[1:] &= ~run_mask[:-1]
    return np.flatnonzero(first)


def parse_numbers(number_text: Bytes, number_count: int, dtype: type[T]) -> NDArray[T]:
    """Return the numbers in a text, separated by blanks and line feeds.

    number_text : ASCII codes
    number_count : number of words in the text

    Raises ValueError if a word is not a number.
    """
    # NumPy parses blanks alone as a number, and some versions only warn about words that are not numbers
    try:
        values = np.fromstring(number_text.tobytes(), dtype, sep=" ") if number_count else np.empty(0, dtype)
    except (ValueError, DeprecationWarning):
        values = np.empty(0, dtype)
    if len(values) != number_count:
        raise ValueError("a word is not a number")
    return values
