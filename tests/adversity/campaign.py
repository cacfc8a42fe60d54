"""Campaign of many inputs in several processes; each failure is stored and can be repeated."""

from __future__ import annotations

import gc
import json
import multiprocessing
import os
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from itertools import islice
from multiprocessing.connection import Connection, wait
from pathlib import Path

from adversity.case import ACCEPTED, HANG, REFUSED, Outcome, Plan
from adversity.child import Limits, outcome_of
from adversity.kind import Kind

_CASE = "case.json"
_INPUT = "input"
_MOST_KEPT = 3  # of failures at one place

Job = tuple[str, int]
"""A kind's name and the number of an input."""


@dataclass
class Tally:
    """Results of all inputs.

    counts : number of inputs by kind and outcome
    places : stored failures by kind, outcome and location, at most `_MOST_KEPT` each
    """

    counts: dict[str, Counter[str]] = field(default_factory=dict)
    places: dict[tuple[str, str, str], list[str]] = field(default_factory=dict)

    def add(self, outcome: Outcome, kept: str = "") -> None:
        """Count an outcome."""
        self.counts.setdefault(outcome.kind, Counter())[outcome.outcome] += 1
        if outcome.failed:
            found = self.places.setdefault((outcome.kind, outcome.outcome, outcome.place), [])
            found += [kept] * bool(kept)

    def wants(self, outcome: Outcome) -> bool:
        """Return whether one more failure at this location is stored."""
        return len(self.places.get((outcome.kind, outcome.outcome, outcome.place), [])) < _MOST_KEPT

    @property
    def failures(self) -> int:
        """Return the number of inputs on which the package failed."""
        both = (ACCEPTED, REFUSED)
        return sum(n for one in self.counts.values() for outcome, n in one.items() if outcome not in both)


def rounds(kinds: Mapping[str, Kind], until: float) -> Iterator[Job]:
    """Yield inputs of all kinds, each with its frequency, until a time (`time.monotonic`)."""
    number = 0
    while True:
        for name, kind in kinds.items():
            for k in range(kind.share):
                if time.monotonic() > until:
                    return
                yield name, number * kind.share + k
        number += 1


def run(
    kinds: Mapping[str, Kind],
    jobs: Callable[[], Iterable[Job]],
    seed: int,
    keep: Path,
    workers: int = 1,
    limits: Limits | None = None,
    told: Callable[[Tally], None] = lambda _: None,
) -> Tally:
    """Run inputs and return their tally.

    jobs : function that returns the same inputs in the same order; each worker takes its part of them
    keep : folder for failures
    limits : limits for all kinds; those of each kind if omitted
    told : function called after each input
    """
    tally, ways = Tally(), []
    start = multiprocessing.get_context("fork")
    gc.freeze()  # so that processes share what is here
    for worker in range(workers):
        way, far = start.Pipe(duplex=False)
        args = (kinds, jobs, seed, (worker, workers), limits, far)
        process = start.Process(target=_work, args=args)
        process.start()
        far.close()
        ways.append((way, process))
    for outcome in _coming([way for way, _ in ways]):
        kept = _keep(keep, outcome, kinds[outcome.kind]) if outcome.failed and tally.wants(outcome) else ""
        tally.add(outcome, kept)
        told(tally)
    gc.unfreeze()
    for _, process in ways:
        process.join()
        if process.exitcode:
            raise RuntimeError(f"a worker ended with {process.exitcode}")
    return tally


def _coming(ways: list[Connection]) -> Iterator[Outcome]:
    """Yield the outcomes of all workers until the last one has finished."""
    left = list(ways)
    while left:
        for way in wait(left):
            assert isinstance(way, Connection)
            try:
                yield way.recv()
            except EOFError:
                left.remove(way)


def _work(
    kinds: Mapping[str, Kind],
    jobs: Callable[[], Iterable[Job]],
    seed: int,
    share: tuple[int, int],
    limits: Limits | None,
    way: Connection,
) -> None:
    """Run every n-th input in a folder of its own, in a worker process."""
    for name, number in islice(jobs(), share[0], None, share[1]):
        way.send(tried(kinds[name], seed, number, limits))
    way.close()


def tried(kind: Kind, seed: int, number: int, limits: Limits | None = None) -> Outcome:
    """Return the outcome of an input; one that was too slow is repeated."""
    for attempt in range(2):
        with _folder() as folder:
            plan = kind.make(folder, seed, number)
            outcome = _outcome(kind, plan, folder, limits)
        if outcome.outcome != HANG or attempt:
            break
    return replace(outcome, seed=seed, number=number)


def tried_again(kinds: Mapping[str, Kind], kept: Path, limits: Limits | None = None) -> Outcome:
    """Return the outcome of a stored failure."""
    told = json.loads((kept / _CASE).read_text("utf-8"))
    with _folder() as folder:
        if (kept / _INPUT).exists():
            shutil.copytree(kept / _INPUT, folder, dirs_exist_ok=True)
        outcome = _outcome(kinds[told["kind"]], told["plan"], folder, limits)
    return replace(outcome, seed=told["seed"], number=told["number"])


def _outcome(kind: Kind, plan: Plan, folder: Path, limits: Limits | None) -> Outcome:
    outcome, place, last = outcome_of(kind, plan, folder, limits or Limits(cpu_s=kind.cpu_s))
    return Outcome(kind.name, 0, 0, outcome, place, last, plan)


def _keep(keep: Path, outcome: Outcome, kind: Kind) -> str:
    """Store the input of a failure and its description in a folder, and return the name of the folder."""
    name = f"{outcome.kind}-{outcome.seed}-{outcome.number}".replace(" ", "-")
    folder = keep / name
    shutil.rmtree(folder, ignore_errors=True)
    (folder / _INPUT).mkdir(parents=True)
    kind.make(folder / _INPUT, outcome.seed, outcome.number)
    (folder / _CASE).write_text(json.dumps(asdict(outcome), indent=2), "utf-8")
    return name


@contextmanager
def _folder() -> Iterator[Path]:
    """Yield a folder for one input, made readable again before it is removed."""
    folder = Path(tempfile.mkdtemp(prefix="adversity-"))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def caches(folder: Path) -> Iterator[None]:
    """Use a cache folder of the campaign inside the block."""
    before = os.environ.get("DERMIS_CACHE")
    os.environ["DERMIS_CACHE"] = str(folder)
    try:
        yield
    finally:
        os.environ.pop("DERMIS_CACHE") if before is None else os.environ.update(DERMIS_CACHE=before)
