"""Command lines: functions as commands, wrong input as one message and exit status 2, no traceback."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from inspect import cleandoc
from pathlib import Path
from types import NoneType
from typing import Any, NoReturn, get_args

from cyclopts import App, CycloptsError
from cyclopts.exceptions import (
    CoercionError,
    MissingArgumentError,
    RepeatArgumentError,
    UnknownCommandError,
    UnknownOptionError,
    UnusedCliTokensError,
)

from dermis.base.atomic_write import reason
from dermis.base.errors import DermisError, DermisWarning, shortened, shown_value

_LONGEST = 400  # letters
_TYPES = {float: "a number", int: "a whole number", NoneType: ""}
_NO_MEMORY = "failed to map segment", "allocate memory"  # messages of a library that cannot be loaded


def make_app(name: str, help_text: str | None) -> App:
    """Return an empty command line that returns exit statuses and prints plain help."""
    return App(
        name=name,
        help=help_text,
        help_format="plaintext",
        version_flags=(),
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )


def run_app(app: App, words: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit status: 2, with a message on stderr, for wrong input.

    words : of the command line; those of the process when left out
    """
    name = app.name[0]
    try:
        with warnings.catch_warnings():
            _show_notes()
            given = sys.argv[1:] if words is None else words
            return int(app(given, exit_on_error=False, print_error=False) or 0)
    except DermisError as error:
        return failed(name, str(error))
    except CycloptsError as error:
        return failed(name, explain(error, name))
    except (MemoryError, ImportError) as error:
        if isinstance(error, ImportError) and not any(words in str(error) for words in _NO_MEMORY):
            raise
        lack = f"memory: expected enough for this, but there is no more ({error}). Ask for less."
        return failed(name, lack)


def run_script(run: Callable[..., int | None] | Mapping[str, str], name: str | None = None) -> NoReturn:
    """Run the command line of a script, whose docstring is the help, and exit.

    run : function; or summaries of commands by "module:function"
    name : of the script; that of its file when left out
    """
    name, help_text = name or Path(sys.argv[0]).name, reflowed(sys.modules["__main__"].__doc__)
    if isinstance(run, Mapping):
        app = make_app(name, help_text)
        for place, summary in run.items():
            add_command(app, place.partition(":")[2].replace("_", "-"), place, summary)
    else:
        app = make_app(name, help_text)
        app.default(run)
    try:
        code = run_app(app)
    except OSError as error:
        code = failed(name, f"{error.filename}: expected a usable file, but {reason(error)}. Name another.")
    sys.exit(code)


def add_command(app: App, name: str, place: str, summary: str) -> None:
    """Add a command by the "module:function" it is, which is imported only when it is chosen."""
    chosen = sys.argv[1:2] == [name]
    if chosen:
        module, _, function = place.partition(":")
        command = getattr(import_module(module), function)
        command.__doc__ = reflowed(command.__doc__)
    app.command(place, name=name, help=None if chosen else summary, version_flags=())


def failed(name: str, message: str) -> int:
    """Print what a program failed by, and return the exit status 2."""
    sys.stderr.write(f"{name}: {message}\n")
    return 2


def _show_notes() -> None:
    """Print the package's own warnings as notes, each once."""
    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
        if issubclass(category, DermisWarning):
            sys.stderr.write(f"note: {message}\n")
        else:
            usual(message, category, *more, **named)

    warnings.simplefilter("default", DermisWarning)
    warnings.showwarning = show


def explain(error: CycloptsError, name: str) -> str:
    """Return what was expected on the command line of a program, what came, and where to read on."""
    command = " ".join((name, *(error.command_chain or ())))
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


def reflowed(docstring: str | None) -> str:
    """The text with each paragraph on a line of its own, as a terminal wraps it."""
    made: list[str] = []
    for line in cleandoc(docstring or "").splitlines():
        if made and _goes_on(made[-1], line):
            made[-1] += f" {line.strip()}"
        else:
            made.append(line)
    return "\n".join(made)


def _goes_on(before: str, line: str) -> bool:
    """Whether a line belongs to the paragraph before it: blank lines, indents and underlines part them."""
    if not before.strip() or not line.strip() or {*before.strip()} == {"-"} or {*line.strip()} == {"-"}:
        return False
    return _indent(before) == _indent(line)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())
