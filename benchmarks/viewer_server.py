"""`dermis view --browser` in a process of its own."""

from __future__ import annotations

import selectors
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

from viewer_clock import Clock
from viewer_input import PIGMENTED, Plan

_START_S = 120.0


@contextmanager
def served(plan: Plan, clock: Clock) -> Iterator[tuple[str, int]]:
    """The address of `dermis view --browser`, and its process."""
    size = "x".join(map(str, plan.size))
    words = ["view", plan.head, "--browser", "--port", "0", "--size", size, "--atlas", str(plan.atlas)]
    words += ["--profile", PIGMENTED, "--samples", str(plan.samples), "--adapter", plan.adapter]
    words = [sys.executable, "-m", "dermis", *words]
    with (
        tempfile.TemporaryFile("w+", encoding="utf-8") as said,
        subprocess.Popen(words, stdout=subprocess.PIPE, stderr=said, text=True) as server,
    ):
        try:
            assert server.stdout is not None
            yield _address(server.stdout, min(_START_S, clock.left_s)), server.pid
        except Exception as fault:
            raise RuntimeError(
                f"{fault or type(fault).__name__}; dermis view: {_last_words(said)}"
            ) from fault
        finally:
            _ended(server)


def _address(told: IO[str], patience_s: float) -> str:
    """The page's, which is all that the server tells."""
    with selectors.DefaultSelector() as waiting:
        waiting.register(told, selectors.EVENT_READ)
        words = told.readline().split() if waiting.select(patience_s) else []
    if not words:
        raise RuntimeError("it tells no address")
    return words[0]


def _last_words(said: IO[str]) -> str:
    said.seek(0)
    lines = said.read().strip().splitlines()
    return lines[-1] if lines else "it said nothing"


def _ended(server: subprocess.Popen[str], patience_s: float = 10.0) -> None:
    server.terminate()
    try:
        server.wait(patience_s)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
