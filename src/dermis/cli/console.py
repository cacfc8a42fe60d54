"""What the commands print: results on stdout, progress and notes on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def print_json(value: Any) -> None:
    """One JSON value and nothing else on stdout."""
    sys.stdout.write(json.dumps(value, indent=2) + "\n")


def print_lines(*lines: str) -> None:
    """Lines of a result on stdout."""
    sys.stdout.write("\n".join(lines) + "\n")


@contextmanager
def working_on(what: str) -> Iterator[None]:
    """A spinner on stderr while something takes its time; silent when stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(what):
        yield
