"""Runs another program and everything that it starts, for so long and no longer."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import IO

from dermis.base.console import note
from dermis.base.errors import DermisError

LONGEST_S = 150.0


def lasted_s(words: list[str], longest_s: float = LONGEST_S) -> float:
    """How long a program ran, whose notes are passed on.

    Raises DermisError when it failed or took too long, with what it said last.
    """
    started, name = time.perf_counter(), " ".join([Path(words[1]).name, words[2]])
    last: deque[str] = deque(["it said nothing"], maxlen=1)
    with subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as program:
        assert program.stderr is not None
        listener = threading.Thread(target=_pass_on, args=(program.stderr, last))
        listener.start()
        try:
            failed = program.wait(longest_s)
        except subprocess.TimeoutExpired as fault:
            came = f"expected it to end within {longest_s:g} s, but it did not. Last words: {last[0]}"
            raise DermisError(f"{name}: {came}") from fault
        finally:
            with suppress(ProcessLookupError):  # and what it has started
                os.killpg(program.pid, signal.SIGKILL)
            listener.join()
    if failed:
        raise DermisError(f"{name}: {last[0]}")
    return time.perf_counter() - started


def _pass_on(said: IO[str], last: deque[str]) -> None:
    for line in said:
        if line.strip():
            last.append(line.strip())
            note(line.rstrip())
