"""What the package raises when the input, the machine or the disk is at fault."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

_LONGEST_NAME, _LONGEST_TEXT = 300, 400  # letters of a message


class DermisError(Exception):
    """The caller can mend this: the message says what was expected, what came and what to do.

    The command line prints it without a traceback and exits with 2.
    """


@contextmanager
def about(culprit: object) -> Iterator[None]:
    """Say of what is refused inside what it is about, unless that is said already."""
    try:
        yield
    except DermisError as error:
        if str(culprit) in str(error):
            raise
        raise DermisError(f"{culprit}: {error}") from error


class DermisWarning(UserWarning):
    """The picture may not be what was meant: the message says why and what to do."""


def notify(message: str) -> None:
    """Warn with a `DermisWarning`; the command line prints it as a note."""
    warnings.warn(message, DermisWarning, stacklevel=3)


def refuse(culprit: object, expected: str, came: str, remedy: str) -> NoReturn:
    """Raise a `DermisError` in the package's one form.

    culprit : the file, option or object at fault, named first
    expected, came, remedy : sentences without a full stop
    """
    named, what = shortened(str(culprit), _LONGEST_NAME), shortened(came, _LONGEST_TEXT)
    end = "" if remedy.endswith("?") else "."
    raise DermisError(f"{named}: expected {expected}, but {what}. {remedy}{end}")


def shown_value(value: object, most: int = 60) -> str:
    """What came, short: a class by its name, other things as they print or by their kind.

    most : letters that it may take
    """
    if isinstance(value, type):
        return f"the class {value.__name__}"
    try:
        text = f"{value!r}"
    except Exception:  # a whole number of thousands of digits, say
        return f"something too long to print ({type(value).__name__})"
    if len(text) <= most:
        return text
    is_plain = isinstance(value, str | bytes | int | list | tuple | dict)
    return f"{text[:most]} ..." if is_plain else f"a {type(value).__name__}"


def shortened(text: str, most: int) -> str:
    """A text without its middle where it is too long for a message."""
    half = (most - 5) // 2
    return text if len(text) <= most else f"{text[:half]} ... {text[-half:]}"
