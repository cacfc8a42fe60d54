"""The command `dermis`: one module for each of its commands."""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from typing import Any

COMMANDS = {
    "render": "Render a head to a PNG (sRGB) or EXR (linear float) image.",
    "animate": "Draw a head that moves, as a movie or as numbered pictures.",
    "batch": "Draw a data set of many people, with ground truth, on one machine or many.",
    "view": "Turn a head, its skin and its light in a window or a web page.",
    "profile": "Compute how light spreads below a skin, and fit Gaussians to it.",
    "head": "Make a person of the parametric human and write it as glTF.",
    "export": "Write a skin or a head for another program, and say how wrong it will be there.",
    "unmix": "Find the melanin and blood of a picture of skin, and recolour it.",
    "fit": "Find the light and the skin of a photograph of a head.",
    "lights": "Print a rig of lights as a file to start from.",
    "compare": "Compare techniques with the truth, or the models of the surface.",
    "gallery": "Draw every comparison of the talk, and a page that explains them.",
    "bench": "Measure how fast frames are on this machine.",
    "doctor": "Show what this machine can do and render a test frame.",
    "cite": "Print BibTeX entries of the works behind a picture.",
}
_NO_MEMORY = "failed to map segment", "allocate memory"  # of a library that is loaded
_INTERRUPTED = 130


def main() -> None:
    """Run the command line; exit with 2 when the caller can mend what went wrong.

    130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP; 2 also when stdout could not be written to, but
    not when its reader left.
    """
    from dermis.cli.interruption import Interruption
    from dermis.cli.streams import Streams

    with Streams() as streams, Interruption() as interruption:
        try:
            code = _run()
            if (fault := streams.fault()) and not code:
                came = f"it fails ({fault.strerror})"
                code = _fail(f"stdout: expected a place to write to, but {came}. Write it elsewhere.")
        except KeyboardInterrupt:
            code = _INTERRUPTED
            streams.drop()
        except Exception:  # some libraries make one of their own of it
            if not (code := interruption.code):
                raise
    sys.exit(interruption.code or code)


def _run() -> int:
    """The exit status of the command that was typed."""
    from cyclopts import App, CycloptsError

    from dermis.base.errors import DermisError
    from dermis.cli.help_text import reflowed
    from dermis.cli.misuse import explain

    app = App(
        name="dermis",
        help="Human skin: physically based, in real time, checked against the truth.",
        help_format="plaintext",
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    if (chosen := next(iter(sys.argv[1:]), "")) in COMMANDS:
        command = getattr(import_module(f"dermis.cli.{chosen}"), chosen)
        command.__doc__ = reflowed(command.__doc__)
    for name, summary in COMMANDS.items():
        # The list of commands must not import them; a command's own help is its docstring.
        shown = None if sys.argv[1:2] == [name] else summary
        app.command(f"dermis.cli.{name}:{name}", name=name, help=shown, version_flags=())
    try:
        with warnings.catch_warnings():
            _show_notes()
            return int(app(sys.argv[1:], exit_on_error=False, print_error=False) or 0)
    except DermisError as error:
        return _fail(str(error))
    except CycloptsError as error:
        return _fail(explain(error))
    except (MemoryError, ImportError) as error:
        if isinstance(error, ImportError) and not any(words in str(error) for words in _NO_MEMORY):
            raise
        return _fail(f"memory: expected enough for this, but there is no more ({error}). Ask for less.")


def _show_notes() -> None:
    """Print the package's own warnings as notes, each once."""
    from dermis.base.errors import DermisWarning

    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
        if issubclass(category, DermisWarning):
            sys.stderr.write(f"note: {message}\n")
        else:
            usual(message, category, *more, **named)

    warnings.simplefilter("default", DermisWarning)
    warnings.showwarning = show


def _fail(message: str) -> int:
    sys.stderr.write(f"dermis: {message}\n")
    return 2
