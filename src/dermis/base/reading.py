"""Safe reading of files that users name, and of the further files that these files reference.

Only regular files are read, with a limit on their size, and errors of parsers become messages that name the
file.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
import struct
import tomllib
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from dermis.base.errors import DermisError, error_text, refuse

MALFORMED_DATA_ERRORS = (LookupError, TypeError, AttributeError, ArithmeticError, struct.error)
"""Exceptions raised by code that assumes well-formed data; pass them to refuse_parse_errors."""
MAX_TEXT_BYTES = 1 << 20  # largest file with settings: scenes, lights, tables
_MIN_READ_BYTES = 1 << 16
_MAX_INTEGER_BITS = 64  # largest size of integers, as in TOML; all can be converted to float
_MAX_KEY_PARTS = 32  # parts of a dotted key: parsing time grows with the square of their number
_LONG_KEY_PATTERN = re.compile(
    r"""(?<![\w\\-])(?:(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+)"""
    f"{{{_MAX_KEY_PARTS}}}"
)
_OPEN_FLAGS = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)


def read_file(path: str | Path, expected: str, max_bytes: int, name: object = None) -> bytes:
    """Return the bytes of a regular file.

    expected : what the file should be, for error messages
    max_bytes : largest accepted size
    name : name of the file in error messages; by default the path

    Raises DermisError when the file is missing, not regular, too large or unreadable.
    """
    error_subject = path if name is None else name
    try:
        with os.fdopen(_open_regular_descriptor(path, error_subject, expected), "rb") as file:
            size = os.fstat(file.fileno()).st_size
            limit = min(
                max_bytes, max(size, _MIN_READ_BYTES)
            )  # system files such as /proc report a size of 0
            data = file.read(limit + 1) if size <= max_bytes else b""
    except (OSError, ValueError, TypeError) as fault:  # ValueError: a NUL in the name; TypeError: no name
        refuse(error_subject, expected, f"it cannot be read ({error_text(fault)})", "Check its name")
    if data is None:
        refuse(error_subject, expected, "nothing can be read from it", "Copy its contents to a file first")
    if size > max_bytes or len(data) > limit:
        actual = f"it has {_format_megabytes(size)}" if size > max_bytes else "it grows while it is read"
        refuse(
            error_subject,
            f"{expected} of at most {_format_megabytes(max_bytes)}",
            actual,
            "Check its name and size",
        )
    return data


@contextmanager
def open_regular_file(path: str | Path, expected: str) -> Iterator[BinaryIO]:
    """Open a regular file of any size; callers must limit the number of bytes per read.

    expected : what the file should be, for error messages

    Raises DermisError when the file is missing, not regular or unreadable.
    """
    try:
        descriptor = _open_regular_descriptor(path, path, expected)
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse(path, expected, f"it cannot be read ({error_text(fault)})", "Check its name")
    try:
        with os.fdopen(descriptor, "rb") as file:
            yield file
    except OSError as fault:
        refuse(path, expected, f"it cannot be read ({error_text(fault)})", "Check the disk")


def is_file(path: str | Path) -> bool:
    """Return whether a regular file exists at a path; False for names that no file can have."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):  # too long, or with a NUL
        return False


def file_stamp(path: str | Path) -> tuple[int, int] | None:
    """Return time and size of a file, which change when it is written again; None for a missing file."""
    if not is_file(path):
        return None
    status = Path(path).stat()
    return status.st_mtime_ns, status.st_size


def read_text(path: str | Path, expected: str, max_bytes: int = MAX_TEXT_BYTES) -> str:
    """Return the text of a file in UTF-8, or in UTF-16 with a byte order mark.

    A byte order mark is not part of the returned text.

    expected : what the file should be, for error messages
    max_bytes : largest accepted size of the file

    Raises DermisError as `read_file` does, and for files that are not text.
    """
    with refuse_parse_errors(path, expected):
        data = read_file(path, expected, max_bytes)
        return data.decode("utf-16" if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) else "utf-8-sig")


def read_toml(path: str | Path, expected: str = "a TOML file") -> dict[str, Any]:
    """Return the tables of a TOML file.

    Raises DermisError as `read_text` does, and for invalid TOML.
    """
    text = read_text(path, expected)
    with refuse_parse_errors(path, expected):
        if _LONG_KEY_PATTERN.search(text):
            raise ValueError(f"a key has more than {_MAX_KEY_PARTS} parts with dots between them")
        tables = tomllib.loads(text)
        _check_toml_integers(tables)
    return tables


def parse_json(json_text: str | bytes, error_subject: object, expected: str) -> Any:
    """Return the value of a JSON text; all numbers in the text must be finite.

    Raises DermisError for invalid JSON, deep nesting, and numbers that are too large.
    """
    with refuse_parse_errors(error_subject, expected):
        return json.loads(
            json_text,
            parse_constant=_refuse_json_constant,
            parse_float=_parse_finite_float,
            parse_int=_parse_bounded_int,
        )


def checked_path(file_name: object, expected: str) -> Path:
    """Convert the name of a file to a path.

    expected : what the name should denote, for the error

    Raises DermisError when the name is neither text nor a path.
    """
    if not isinstance(file_name, str | os.PathLike):
        refuse("file", f"the name of {expected}", f"got a {type(file_name).__name__}", "Pass its name")
    return Path(file_name)


@contextmanager
def refuse_parse_errors(error_subject: object, expected: str, *errors: type[Exception]) -> Iterator[None]:
    """Convert exceptions that a parser raises in a with block into a DermisError that names the file.

    error_subject : name of the file
    expected : what the file should be
    errors : exception types that the parser raises besides ValueError and OverflowError
    """
    try:
        yield
    except DermisError:
        raise
    except RecursionError:
        refuse(error_subject, expected, "it is nested too deeply", "Export it again, or correct it")
    except MemoryError:
        refuse(error_subject, expected, "it needs more memory than there is", "Make it smaller")
    except Exception as fault:
        if not isinstance(fault, (ValueError, OverflowError, *errors)):
            raise
        refuse(
            error_subject, expected, f"it cannot be understood ({_short_error(fault)})", "Check its contents"
        )


def _open_regular_descriptor(path: str | Path, error_subject: object, expected: str) -> int:
    """Open a regular file and return its descriptor; pipes and devices are refused without blocking.

    error_subject : name of the file, for the error
    expected : what the file should be, for the error
    """
    descriptor = os.open(path, os.O_RDONLY | _OPEN_FLAGS)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        refuse(error_subject, expected, "it is not a regular file", "Copy its contents to a file first")
    return descriptor


def _parse_finite_float(number_text: str) -> float:
    number = float(number_text)
    if not math.isfinite(number):
        raise ValueError(f"{number_text[:20]} is too large for a number")
    return number


def _parse_bounded_int(number_text: str) -> int:
    number = int(number_text)
    if number.bit_length() > _MAX_INTEGER_BITS:
        raise ValueError(f"{number_text[:20]}... is too large for a whole number")
    return number


def _check_toml_integers(toml_tables: dict[str, Any]) -> None:
    pending: list[Any] = [toml_tables]
    while pending:
        value = pending.pop()
        if isinstance(value, dict):
            pending.extend(value.values())
        elif isinstance(value, list):
            pending.extend(value)
        elif isinstance(value, int) and value.bit_length() > _MAX_INTEGER_BITS:
            raise ValueError(f"a whole number has {value.bit_length()} bits, more than {_MAX_INTEGER_BITS}")


def _refuse_json_constant(constant_name: str) -> NoReturn:
    raise ValueError(f"{constant_name} is not a number")


def _format_megabytes(byte_count: int) -> str:
    return f"{byte_count / 1e6:,.1f} MB" if byte_count >= 1e5 else f"{byte_count:,} bytes"


def _short_error(error: BaseException) -> str:
    """Return the text of an error, shortened to one line."""
    text = " ".join(str(error)[:1000].split())
    text = text if text and isinstance(error, ValueError) else f"{type(error).__name__}: {text}"
    return text if len(text) <= 200 else f"{text[:197]}..."
