"""The command `dermis`: one module for each of its commands."""

from __future__ import annotations

import sys

import dermis

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
_INTERRUPTED = 130


def main() -> None:
    """Run the command line; exit with 2 for faults that the caller can correct.

    130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP; 2 also when stdout could not be written to, but
    not when its reader left.
    """
    from dermis.cli.process import Interruption, StandardStreams

    with StandardStreams() as streams, Interruption() as interruption:
        try:
            code = _run()
            if (fault := streams.fault()) and not code:
                from dermis.base.command_line import failed

                came = f"it fails ({fault.strerror})"
                code = failed(
                    "dermis", f"stdout: expected a place to write to, but {came}. Write it elsewhere."
                )
        except KeyboardInterrupt:
            code = _INTERRUPTED
            streams.drop()
        except Exception:  # some libraries raise their own error for an interruption
            if not (code := interruption.code):
                raise
    sys.exit(interruption.code or code)


def _run() -> int:
    """Return the exit status of the command that was typed."""
    from dermis.base.command_line import add_command, make_app, run_app

    app = make_app("dermis", "Human skin: physically based, in real time, checked against the truth.")
    app.version = lambda: dermis.__version__
    app.version_flags = ("--version",)
    for name, summary in COMMANDS.items():
        add_command(app, name, f"dermis.cli.{name}:{name}", summary)
    return run_app(app)
