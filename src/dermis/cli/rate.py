"""How fast images come and when all will be there, on stderr: a bar on a terminal, lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from dermis.base.console import note

_EVERY_S = 30.0  # between lines of a log
_WINDOW_S = 60.0  # that the rate is taken over


@contextmanager
def rate_of_images() -> Iterator[Callable[[int, int], None]]:
    """What is told how many images are done, of how many."""
    if not sys.stderr.isatty():
        yield Lines(note).tell
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("drawing images"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with Progress(*columns, console=Console(stderr=True), speed_estimate_period=_WINDOW_S) as bar:
        task = bar.add_task("", rate="", total=None)
        pace = Pace()

        def tell(done: int, of: int) -> None:
            bar.update(task, completed=done, total=of, rate=f"{pace.at(done):.3g} images/s")

        yield tell


class Pace:
    """Images a second over the last minute.

    clock : seconds
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._seen = deque([(clock(), 0)])

    def at(self, done: int) -> float:
        """The pace with so many images done by now."""
        now = self._clock()
        self._seen.append((now, done))
        while len(self._seen) > 2 and now - self._seen[1][0] >= _WINDOW_S:
            self._seen.popleft()
        began, before = self._seen[0]
        return (done - before) / (now - began) if now > began else 0.0


class Lines:
    """A line every half minute, for logs.

    write : takes a line
    """

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._write, self._clock = write, clock
        self._pace, self._last = Pace(clock), clock()

    def tell(self, done: int, of: int) -> None:
        """So many images are done."""
        pace, now = self._pace.at(done), self._clock()
        if now - self._last < _EVERY_S:
            return
        self._last = now
        left = f"{(of - done) / pace / 60:.0f} min left" if pace else "no time known"
        self._write(f"{done:,} of {of:,} images, {pace:.3g} images/s, {left}")
