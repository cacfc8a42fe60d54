"""What the package raises when the input, the machine or the disk is at fault."""

from __future__ import annotations

import warnings
from typing import NoReturn


class DermisError(Exception):
    """The caller can mend this: the message says what was expected, what came and what to do.

    The command line prints it without a traceback and exits with 2.
    """


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
    raise DermisError(f"{culprit}: expected {expected}, but {came}. {remedy}.")
