"""Errors and warnings for invalid input, unsuitable machines and full disks."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

_MAX_NAME_LENGTH, _MAX_TEXT_LENGTH = 300, 400  # characters in a message


class DermisError(Exception):
    """Error that the caller can fix; the message says what was expected, what was received and what to do.

    The command line prints the message without a traceback and exits with status 2.

    Examples
    --------
    >>> from dermis import DermisError, load_profile
    >>> try:
    ...     load_profile("granite")
    ... except DermisError as error:
    ...     print("expected a preset" in str(error))
    True
    """


@contextmanager
def error_context(error_subject: object) -> Iterator[None]:
    """Put the name of a file, option or object before the messages of errors raised in a with block.

    Messages that already contain the name are unchanged.
    """
    try:
        yield
    except DermisError as error:
        if str(error_subject) in str(error):
            raise
        raise DermisError(f"{error_subject}: {error}") from error


class DermisWarning(UserWarning):
    """Warning that a result may differ from the user's intention; the message says why and what to do."""


def notify(message: str) -> None:
    """Issue a `DermisWarning`; the command line prints the warning as a note."""
    warnings.warn(message, DermisWarning, stacklevel=3)


def refuse(error_subject: object, expected: str, actual: str, advice: str) -> NoReturn:
    """Raise a `DermisError` that says what was expected, what was received and what to do.

    The message is "ERROR_SUBJECT: expected EXPECTED, but ACTUAL. ADVICE."

    error_subject : file, option or object at fault
    expected : phrase after "expected"
    actual : clause after "but", such as "got 3" or "it has none"
    advice : what to do, without a full stop
    """
    name, actual = shorten(str(error_subject), _MAX_NAME_LENGTH), shorten(actual, _MAX_TEXT_LENGTH)
    end = "" if advice.endswith("?") else "."
    raise DermisError(f"{name}: expected {expected}, but {actual}. {advice}{end}")


def format_value(value: object, max_length: int = 60) -> str:
    """Return the repr of a value for an error message; a long repr is shortened, or replaced by the type.

    max_length : longest repr [characters]
    """
    if isinstance(value, type):
        return f"the class {value.__name__}"
    try:
        text = f"{value!r}"
    except Exception:  # such as an integer of thousands of digits
        return f"something too long to print ({type(value).__name__})"
    if len(text) <= max_length:
        return text
    is_plain = isinstance(value, str | bytes | int | list | tuple | dict)
    return f"{text[:max_length]} ..." if is_plain else f"a {type(value).__name__}"


def error_text(error: Exception) -> str:
    """Return the first line of an error's message; the path in an OSError is left out, as callers add it."""
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return text.splitlines()[0].rstrip(".")


def shorten(text: str, max_length: int) -> str:
    """Return a text, without its middle part if it is longer than `max_length` characters."""
    half = (max_length - 5) // 2
    return text if len(text) <= max_length else f"{text[:half]} ... {text[-half:]}"
