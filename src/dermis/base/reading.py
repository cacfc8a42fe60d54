"""The one door for bytes that others wrote: files that a user names, and files that those name in turn.

Only regular files are opened, no more is read than the kind may have, and what a parser says of text that it
cannot take becomes a sentence that names the file.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
import struct
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from dermis.base.errors import DermisError, refuse

BROKEN = (LookupError, TypeError, AttributeError, ArithmeticError, struct.error)
"""What code raises that trusts the form of what it is given, see `understood`."""
MOST_TEXT = 1 << 20  # bytes of settings: scenes, lights, tables
_PAGE = 1 << 16
_MOST_BITS = 64  # of a whole number, as in TOML; any of them is a float as well
_DEEPEST = 32  # parts of a key with dots: the parser's time grows with their square
_DEEP = re.compile(
    r"""(?<![\w\\-])(?:(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+)"""
    f"{{{_DEEPEST}}}"
)
_NONBLOCKING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)


def read_file(path: str | Path, expected: str, most: int, name: object = None) -> bytes:
    """All bytes of a regular file.

    expected : what it should be, for messages
    most : bytes that such a file may have
    name : what messages call it, the path where None
    DermisError : it is missing, no regular file, larger, or cannot be read
    """
    culprit = path if name is None else name
    try:
        with os.fdopen(_open_regular(path, culprit, expected), "rb") as file:
            told = os.fstat(file.fileno()).st_size
            most_now = min(most, max(told, _PAGE))  # a file of the system tells no size
            data = file.read(most_now + 1) if told <= most else b""
    except (OSError, ValueError, TypeError) as fault:  # a NUL in the name; what is no name
        refuse(culprit, expected, f"it cannot be read ({_reason_of(fault)})", "Check its name")
    if data is None:
        refuse(culprit, expected, "nothing can be read from it", "Copy its contents to a file first")
    if told > most or len(data) > most_now:
        came = f"it has {_megabytes(told)}" if told > most else "it grows while it is read"
        refuse(culprit, f"{expected} of at most {_megabytes(most)}", came, "Check its name or its size")
    return data


@contextmanager
def opened(path: str | Path, expected: str) -> Iterator[BinaryIO]:
    """A regular file of any size, of which the caller takes no more at a time than it checked.

    expected : what it should be, for messages
    DermisError : it is missing, no regular file, or cannot be read
    """
    try:
        descriptor = _open_regular(path, path, expected)
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse(path, expected, f"it cannot be read ({_reason_of(fault)})", "Check its name")
    try:
        with os.fdopen(descriptor, "rb") as file:
            yield file
    except OSError as fault:
        refuse(path, expected, f"it cannot be read ({_reason_of(fault)})", "Check the disk")


def is_file(path: str | Path) -> bool:
    """Whether a regular file of this name is there; none is of a name that no file can have."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):  # too long, or with a NUL
        return False


def read_text(path: str | Path, expected: str, most: int = MOST_TEXT) -> str:
    """A file's text, UTF-8 with or without a mark of its order.

    DermisError : as for `read_file`, or it is not text
    """
    with understood(path, expected):
        return read_file(path, expected, most).decode("utf-8-sig")


def read_toml(path: str | Path, expected: str = "a TOML file") -> dict[str, Any]:
    """A TOML file's tables.

    DermisError : as for `read_text`, or it is not TOML
    """
    text = read_text(path, expected)
    with understood(path, expected):
        if _DEEP.search(text):
            raise ValueError(f"a key has more than {_DEEPEST} parts with dots between them")
        tables = tomllib.loads(text)
        _check_whole_numbers(tables)
    return tables


def parse_json(text: str | bytes, culprit: object, expected: str) -> Any:
    """What a JSON text says; all its numbers are finite.

    DermisError : it is not JSON, nested too deeply, or holds a number beyond floats
    """
    with understood(culprit, expected):
        return json.loads(text, parse_constant=_no_number, parse_float=_finite, parse_int=_whole)


def named_path(name: object, expected: str) -> Path:
    """The path of a name.

    DermisError : it is neither a text nor a path
    """
    if not isinstance(name, str | os.PathLike):
        refuse("file", f"the name of {expected}", f"a {type(name).__name__} came", "Write its name")
    return Path(name)


@contextmanager
def understood(culprit: object, expected: str, *more: type[Exception]) -> Iterator[None]:
    """Refuse the file where a parser inside gives up.

    more : errors that it raises besides the usual ones
    """
    try:
        yield
    except DermisError:
        raise
    except RecursionError:
        refuse(culprit, expected, "it is nested too deeply", "Export it again, or correct it")
    except MemoryError:
        refuse(culprit, expected, "it asks for more memory than there is", "Make it smaller")
    except Exception as fault:
        if not isinstance(fault, (ValueError, OverflowError, *more)):
            raise
        refuse(culprit, expected, f"it cannot be understood ({_reason(fault)})", "Check its contents")


def _open_regular(path: str | Path, culprit: object, expected: str) -> int:
    """A descriptor of the file; a pipe or a device is never waited for."""
    descriptor = os.open(path, os.O_RDONLY | _NONBLOCKING)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        refuse(culprit, expected, "it is no regular file", "Copy its contents to a file first")
    return descriptor


def _reason_of(fault: Exception) -> str:
    return getattr(fault, "strerror", None) or str(fault)


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text[:20]} is beyond what a number may be")
    return number


def _whole(text: str) -> int:
    number = int(text)
    if number.bit_length() > _MOST_BITS:
        raise ValueError(f"{text[:20]}... is beyond what a whole number may be")
    return number


def _check_whole_numbers(tables: dict[str, Any]) -> None:
    waiting: list[Any] = [tables]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            waiting.extend(value.values())
        elif isinstance(value, list):
            waiting.extend(value)
        elif isinstance(value, int) and value.bit_length() > _MOST_BITS:
            raise ValueError(f"a whole number has {value.bit_length()} bits, more than {_MOST_BITS}")


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a number")


def _megabytes(size: int) -> str:
    return f"{size / 1e6:,.1f} MB" if size >= 1e5 else f"{size:,} bytes"


def _reason(fault: BaseException) -> str:
    """What a fault says, short enough for one line."""
    text = " ".join(str(fault)[:1000].split())
    text = text if text and isinstance(fault, ValueError) else f"{type(fault).__name__}: {text}"
    return text if len(text) <= 200 else f"{text[:197]}..."
