"""Console output of commands: results on stdout, progress and notes on stderr."""

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

SHOW_STEP_AFTER_S = 2.0


def print_json(json_value: Any) -> None:
    """Print a value as JSON to stdout; numbers that JSON cannot represent, such as NaN, become null."""
    print_lines(json.dumps(_replace_nonfinite_by_null(json_value), indent=2, allow_nan=False))


def _replace_nonfinite_by_null(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _replace_nonfinite_by_null(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_nonfinite_by_null(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_lines(*lines: str) -> None:
    """Print lines to stdout and flush the stream."""
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


def print_report(as_json: bool, report: object, make_lines: Callable[[], Iterable[str]]) -> None:
    """Print the result of a command as JSON or as text.

    as_json : whether to print `report` as JSON
    make_lines : function that returns the lines of the text; called only if the text is printed
    """
    if as_json:
        print_json(report)
    else:
        print_lines(*make_lines())


def print_note(note_text: str) -> None:
    """Print a line of text to stderr."""
    sys.stderr.write(note_text + "\n")


@contextmanager
def progress_bar(task: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar on stderr if stderr is a terminal, and yield a function that updates the bar.

    The function takes the number of finished steps and the total number of steps.

    task : text next to the bar
    """
    if not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task_id = bar.add_task(task)
        yield lambda done, total: bar.update(task_id, completed=done, total=total)


@contextmanager
def spinner(task: str) -> Iterator[None]:
    """Show a spinner on stderr if stderr is a terminal, with the task and the current preparation step."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    text, level = _SpinnerText(task), LOGGER.level
    LOGGER.addHandler(text)
    LOGGER.setLevel(logging.DEBUG)
    try:
        with Console(stderr=True).status(text):
            yield
    finally:
        LOGGER.setLevel(level)
        LOGGER.removeHandler(text)


class _SpinnerText(logging.Handler):
    """Log handler that provides the text of a spinner: the task, and the current step of the task.

    A step is shown after it has been running for two seconds.
    """

    def __init__(self, task: str) -> None:
        super().__init__()
        self._task, self._step, self._began = task, "", 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Update the current step from a record that `logged_step` logged at the start or end of a step."""
        begins = record.levelno >= logging.INFO
        self._step, self._began = record.getMessage() if begins else "", time.monotonic()

    def __rich__(self) -> str:
        seconds = time.monotonic() - self._began
        slow = self._step and seconds >= SHOW_STEP_AFTER_S
        return f"{self._task}: {self._step} ({seconds:.0f} s)" if slow else self._task
