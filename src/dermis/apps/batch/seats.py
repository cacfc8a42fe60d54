"""Where workers sit: on which adapter each of them draws, with how many threads and encoders."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from dermis.apps.batch.processes import Seat
from dermis.gpu.adapters import Adapter, alike_adapters

_MOST_ENCODERS = 8  # of a worker: more wait for what it draws


@dataclass(frozen=True)
class Seating:
    """What was asked for; None where the machine decides.

    adapter : "auto", "cpu", part of a name: all that are alike are used; or one by its number, as "#1"
    numbers : of adapters, in their place
    workers : in all
    workers_per_gpu : of each adapter, where `workers` says nothing
    encoders : of each worker
    """

    adapter: str = "auto"
    numbers: tuple[int, ...] = ()
    workers: int | None = None
    workers_per_gpu: int = 1
    encoders: int | None = None

    def adapters(self) -> list[Adapter]:
        """Those that are used.

        Raises DermisError when one of them is not there.
        """
        if not self.numbers:
            return alike_adapters(self.adapter)
        return [alike_adapters(f"#{number}")[0] for number in self.numbers]

    def seats(self) -> tuple[list[Seat], int]:
        """A seat for each worker, in turn on each adapter; and the number of encoders of each.

        A software adapter shares the cores with Python and the encoders: there is a worker for each two
        cores, with as many threads, and it encodes by itself.
        """
        adapters, cores = self.adapters(), available_cores()
        return _laid_out(adapters, cores, self)


def available_cores() -> int:
    """That this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _laid_out(adapters: Sequence[Adapter], cores: int, asked: Seating) -> tuple[list[Seat], int]:
    software = adapters[0].kind == "CPU"
    usual = max(1, cores // 2) if software else len(adapters) * asked.workers_per_gpu
    workers = asked.workers or usual
    threads = max(1, cores // workers) if software else 0
    encoders = 0 if software else min(_MOST_ENCODERS, max(1, cores // workers - 1))
    if asked.encoders is not None:
        encoders = asked.encoders
    seats = [Seat(f"#{adapters[turn % len(adapters)].number}", threads) for turn in range(workers)]
    return seats, encoders
