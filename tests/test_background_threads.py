"""A process can exit with its own status while a function still runs in a background thread."""

from __future__ import annotations

import subprocess
import sys

import pytest

from dermis.base.background import run_in_thread

CODE = """
import atexit, sys, threading
from dermis.base.background import exit_process, run_in_thread

atexit.register(print, "shut down")
gate = threading.Event()
future = run_in_thread(lambda: gate.wait(60) and 5)
if {finished}:
    gate.set()
    print(future.result(60))
    [thread.join() for thread in threading.enumerate() if thread.daemon]
sys.stdout.write("last words")
exit_process(3)
"""


@pytest.mark.parametrize(("finished", "output"), [(True, "5\nlast wordsshut down\n"), (False, "last words")])
def test_python_is_shut_down_unless_a_thread_still_runs(finished: bool, output: str) -> None:
    command = [sys.executable, "-c", CODE.format(finished=finished)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=50)
    assert (ended.returncode, ended.stdout, ended.stderr) == (3, output, "")


def test_future_raises_the_exception_of_the_function() -> None:
    with pytest.raises(ZeroDivisionError):
        run_in_thread(lambda: 1 // 0).result(60)
