"""A command line that cannot be read, told in the package's one form."""

from __future__ import annotations

from types import NoneType
from typing import Any, get_args

from cyclopts import CycloptsError
from cyclopts.exceptions import (
    CoercionError,
    MissingArgumentError,
    RepeatArgumentError,
    UnknownCommandError,
    UnknownOptionError,
    UnusedCliTokensError,
)

from dermis.base.errors import shortened, shown_value

_LONGEST = 400  # letters
_TYPES = {float: "a number", int: "a whole number", NoneType: ""}


def explain(error: CycloptsError) -> str:
    """What was expected on the command line, what came, and where to read on."""
    command = " ".join(("dermis", *(error.command_chain or ())))
    culprit, expected, came = (shortened(part, _LONGEST) for part in _finding(error, command))
    error.verbose = False
    hint = str(error).partition("Did you mean ")[2]
    did_you_mean = f"Did you mean {hint} " if hint else ""
    return f"{culprit}: expected {expected}, but {came}. {did_you_mean}See {command} --help."


def _finding(error: CycloptsError, command: str) -> tuple[str, str, str]:
    """Culprit, what was expected, what came."""
    left = (error.unused_tokens or ["?"])[0]
    match error:
        case UnknownOptionError():
            return error.token.keyword or error.token.value, f"an option of {command}", "it has none so named"
        case CoercionError():
            value = error.token.value if error.token else "something else"
            return _name(error), _wanted(error.target_type), f"{shown_value(value)} came"
        case MissingArgumentError():
            return error.keyword or _name(error), "a value", "there is none"
        case RepeatArgumentError():
            return _name(error), "it once", "it came twice"
        case UnknownCommandError():
            return left, f"a command of {command}", "it has none so named"
        case UnusedCliTokensError():
            return left, "options only after the first word", "this word came"
    return command, "other options", str(error).strip().rstrip(".")


def _name(error: Any) -> str:
    """The option at fault as it was written, or the argument's name."""
    token = getattr(error, "token", None)
    return str((token and token.keyword) or (error.argument and error.argument.name) or "an option")


def _wanted(kind: Any) -> str:
    """A type in words; the choices of a literal."""
    if get_args(kind):
        return " or ".join(filter(None, map(_wanted, get_args(kind))))
    return _TYPES.get(kind, str(kind))
