"""What the commands print: results on stdout, progress and notes on stderr."""

from __future__ import annotations

import json
import logging
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from dermis.base.progress import LOGGER

TOLD_AFTER_S = 2.0


def print_json(value: Any) -> None:
    """One JSON value and nothing else on stdout; numbers that JSON cannot have, such as NaN, are null."""
    print_lines(json.dumps(_finite(value), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_lines(*lines: str) -> None:
    """Lines of a result on stdout, at once."""
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


def print_report(as_json: bool, report: object, lines: Callable[[], Iterable[str]]) -> None:
    """Print a report as one JSON object, or as the lines that `lines` makes of it."""
    if as_json:
        print_json(report)
    else:
        print_lines(*lines())


def note(text: str) -> None:
    """A remark on stderr."""
    sys.stderr.write(text + "\n")


@contextmanager
def progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr, moved by how much is done of how much; silent when stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, of: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what)
        yield lambda done, of: bar.update(task, completed=done, total=of)


@contextmanager
def working_on(what: str) -> Iterator[None]:
    """A spinner on stderr, with what is being prepared; silent when stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    told, before = _Told(what), LOGGER.level
    LOGGER.addHandler(told)
    LOGGER.setLevel(logging.DEBUG)
    try:
        with Console(stderr=True).status(told):
            yield
    finally:
        LOGGER.setLevel(before)
        LOGGER.removeHandler(told)


class _Told(logging.Handler):
    """A spinner's text: what is done, and what of it has been prepared for two seconds or more."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self._what, self._step, self._began = what, "", 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Note that a step begins, or that it has ended."""
        begins = record.levelno >= logging.INFO
        self._step, self._began = record.getMessage() if begins else "", time.monotonic()

    def __rich__(self) -> str:
        seconds = time.monotonic() - self._began
        long = self._step and seconds >= TOLD_AFTER_S
        return f"{self._what}: {self._step} ({seconds:.0f} s)" if long else self._what
