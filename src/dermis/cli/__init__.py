"""The command `dermis`: one module for each of its commands."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line; exit with 2 when the caller can mend what went wrong."""
    from cyclopts import App, CycloptsError

    from dermis.errors import DermisError

    app = App(
        name="dermis",
        help="Human skin: physically based, in real time, checked against the truth.",
        result_action="return_value",
    )
    app.command("dermis.cli.render:render", name="render")
    app.command("dermis.cli.doctor:doctor", name="doctor")
    app.command("dermis.cli.cite:cite", name="cite")
    try:
        sys.exit(app(exit_on_error=False) or 0)
    except DermisError as error:
        print(f"dermis: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(2)
    except CycloptsError:  # cyclopts has printed what was wrong with the words
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
