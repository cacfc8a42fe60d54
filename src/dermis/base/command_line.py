"""Framework for command-line programs: commands are functions, and an error is one line on stderr."""

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

from dermis.base.errors import DermisError, DermisWarning, error_text, format_value, shorten

_MAX_TEXT_LENGTH = 400  # characters
_TEXT_OF_TYPE = {float: "a number", int: "a whole number", NoneType: ""}
_OUT_OF_MEMORY_TEXTS = (
    "failed to map segment",
    "allocate memory",
)  # parts of messages of libraries that cannot be loaded


def make_app(program_name: str, help_text: str | None) -> App:
    """Return a cyclopts app without commands.

    Its help is plain text. A call of the app returns the result of the command instead of exiting.
    """
    return App(
        name=program_name,
        help=help_text,
        help_format="plaintext",
        version_flags=(),
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )


def run_app(cyclopts_app: App, arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit status: 2 for invalid input, with a message on stderr.

    arguments : words after the program's name; by default, the arguments of this process
    """
    name = cyclopts_app.name[0]
    try:
        with warnings.catch_warnings():
            _show_warnings_as_notes()
            tokens = sys.argv[1:] if arguments is None else arguments
            return int(cyclopts_app(tokens, exit_on_error=False, print_error=False) or 0)
    except DermisError as error:
        return print_failure(name, str(error))
    except CycloptsError as error:
        return print_failure(name, usage_message(error, name))
    except (MemoryError, ImportError) as error:
        if isinstance(error, ImportError) and not any(text in str(error) for text in _OUT_OF_MEMORY_TEXTS):
            raise
        return print_failure(name, f"memory: expected more, but none is left ({error}). Request less.")


def run_script(
    function_or_commands: Callable[..., int | None] | Mapping[str, tuple[str, str]],
    program_name: str | None = None,
) -> NoReturn:
    """Run a script as a command-line program, with its docstring as help, and exit.

    function_or_commands : function of the program; for a program with several commands, a mapping from the
        name of each command to its function, as "module:function", and its summary
    program_name : name of the program; by default the name of the script's file
    """
    program_name, help_text = program_name or Path(sys.argv[0]).name, reflow(sys.modules["__main__"].__doc__)
    if isinstance(function_or_commands, Mapping):
        app = make_app(program_name, help_text)
        for command_name, (function_path, summary) in function_or_commands.items():
            add_command(app, command_name, function_path, summary)
    else:
        app = make_app(program_name, help_text)
        app.default(function_or_commands)
    try:
        code = run_app(app)
    except OSError as error:
        reason = f"expected a usable file, but {error_text(error)}"
        code = print_failure(program_name, f"{error.filename}: {reason}. Name another.")
    sys.exit(code)


def add_command(app: App, command_name: str, function_path: str, summary: str) -> None:
    """Add a command to an app; the module of the command is imported only when a user runs the command.

    command_name : word that selects the command on the command line
    function_path : function of the command, as "module:function"
    summary : text in the list of commands
    """
    chosen = sys.argv[1:2] == [command_name]
    if chosen:
        module, _, function = function_path.partition(":")
        command = getattr(import_module(module), function)
        command.__doc__ = reflow(command.__doc__)
    app.command(function_path, name=command_name, help=None if chosen else summary, version_flags=())


def print_failure(program_name: str, message: str) -> int:
    """Print "name: message" to stderr and return the exit status 2."""
    sys.stderr.write(f"{program_name}: {message}\n")
    return 2


def _show_warnings_as_notes() -> None:
    """Show each `DermisWarning` in a with block once, as a note on stderr; show other warnings as usual."""
    default, shown = warnings.showwarning, set[str]()

    def show_once(message: Warning | str, category: type[Warning], *args: Any, **kwargs: Any) -> None:
        if not issubclass(category, DermisWarning):
            default(message, category, *args, **kwargs)
        elif str(message) not in shown:
            shown.add(str(message))
            sys.stderr.write(f"note: {message}\n")

    warnings.simplefilter("always", DermisWarning)
    warnings.showwarning = show_once


def usage_message(error: CycloptsError, program_name: str) -> str:
    """Return the error message for an invalid command line: what was expected and given, and how to get help.

    program_name : name of the program, for the advice "See PROGRAM_NAME --help"
    """
    command = " ".join((program_name, *(error.command_chain or ())))
    error_subject, expected, actual = (
        shorten(part, _MAX_TEXT_LENGTH) for part in _describe_error(error, command)
    )
    error.verbose = False
    hint = str(error).partition("Did you mean ")[2]
    did_you_mean = f"Did you mean {hint} " if hint else ""
    return f"{error_subject}: expected {expected}, but {actual}. {did_you_mean}See {command} --help."


def _describe_error(error: CycloptsError, command: str) -> tuple[str, str, str]:
    """Return the invalid argument or option, what was expected, and what was given instead.

    command : program and command, as the user writes them
    """
    unused = (error.unused_tokens or ["?"])[0]
    match error:
        case UnknownOptionError():
            option = error.token.keyword or error.token.value
            return option, f"an option of {command}", "it has none of this name"
        case CoercionError():
            value = error.token.value if error.token else "something else"
            return _invalid_option_name(error), _type_text(error.target_type), f"got {format_value(value)}"
        case MissingArgumentError():
            return error.keyword or _invalid_option_name(error), "a value", "there is none"
        case RepeatArgumentError():
            return _invalid_option_name(error), "one value", "it is given twice"
        case UnknownCommandError():
            return unused, f"a command of {command}", "it has none of this name"
        case UnusedCliTokensError():
            return unused, "only options after the first argument", "got this argument"
    return command, "valid options", str(error).strip().rstrip(".")


def _invalid_option_name(error: Any) -> str:
    """Return the invalid option as the user wrote it, or the name of the invalid positional argument."""
    token = getattr(error, "token", None)
    return str((token and token.keyword) or (error.argument and error.argument.name) or "an option")


def _type_text(annotation: Any) -> str:
    """Return a type in words, such as "a number", or the choices of a `Literal`."""
    if get_args(annotation):
        return " or ".join(filter(None, map(_type_text, get_args(annotation))))
    return _TEXT_OF_TYPE.get(annotation, str(annotation))


def reflow(docstring: str | None) -> str:
    """Join the lines of each paragraph of a docstring, so that the terminal can wrap it."""
    paragraphs: list[str] = []
    for line in cleandoc(docstring or "").splitlines():
        if paragraphs and _continues_paragraph(paragraphs[-1], line):
            paragraphs[-1] += f" {line.strip()}"
        else:
            paragraphs.append(line)
    return "\n".join(paragraphs)


def _continues_paragraph(previous_line: str, line: str) -> bool:
    """Return whether `line` belongs to the same paragraph as `previous_line`, the line above it.

    Blank lines, changes of indent and underlines end a paragraph.
    """
    if (
        not previous_line.strip()
        or not line.strip()
        or {*previous_line.strip()} == {"-"}
        or {*line.strip()} == {"-"}
    ):
        return False
    return _indent_width(previous_line) == _indent_width(line)


def _indent_width(line: str) -> int:
    return len(line) - len(line.lstrip())
