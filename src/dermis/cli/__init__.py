"""The command line program `dermis`, with one module per subcommand."""

from __future__ import annotations

import dermis

COMMANDS = {
    "render": "Render a head to a PNG (sRGB) or EXR (linear float) image.",
    "animate": "Render a moving head as a movie or as numbered images.",
    "batch": "Render a data set of people with ground truth, on one or many machines.",
    "view": "Show a head in an interactive window or web page.",
    "profile": "Compute the diffusion profile of a skin and fit Gaussians to it.",
    "head": "Create a person of the parametric human and write it as glTF.",
    "export": "Export a skin or a head to another program and report the error.",
    "correspondences": "Write a person's vertices that are landmarks of other face models.",
    "unmix": "Estimate melanin and blood from a skin colour map, and recolour it.",
    "fit": "Estimate the light and the skin in a photograph of a head.",
    "lights": "Print a lighting rig as a TOML file to start from.",
    "compare": "Compare techniques with a reference, or the specular models.",
    "gallery": 'Render the comparisons of the talk "Advanced Skin Rendering" (2007), with explanations.',
    "bench": "Measure the frame times on this machine.",
    "doctor": "Report what this machine supports and render a test frame.",
    "cite": "Print the BibTeX entries of the works behind a picture.",
}
_EXIT_INTERRUPTED = 130


def main() -> None:
    """Run the command line and exit the process.

    The exit status is 2 for errors that the user can correct and for a failed write to stdout, 130 after
    Ctrl-C, 143 after SIGTERM and 129 after SIGHUP. A closed pipe on stdout is not an error.
    """
    from dermis.base.background import exit_process
    from dermis.cli.process import Interruption, StandardStreams

    with StandardStreams() as streams, Interruption() as interruption:
        try:
            code = _run()
            if (error := streams.stdout_error()) and not code:
                from dermis.base.command_line import print_failure

                reason = f"writing failed ({error.strerror})"
                message = f"stdout: expected writable output, but {reason}. Redirect it."
                code = print_failure("dermis", message)
        except KeyboardInterrupt:
            code = _EXIT_INTERRUPTED
            streams.discard_stdout()
        except Exception:  # some libraries raise their own error after an interruption
            if not (code := interruption.code):
                raise
    exit_process(interruption.code or code)


def _run() -> int:
    """Run the subcommand that the command line names, and return its exit status."""
    from dermis.base.command_line import add_command, make_app, run_app

    app = make_app("dermis", "Physically based rendering of human skin in real time.")
    app.version = lambda: dermis.__version__
    app.version_flags = ("--version",)
    for name, summary in COMMANDS.items():
        add_command(app, name, f"dermis.cli.{name}:{name}", summary)
    return run_app(app)
