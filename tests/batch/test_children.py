"""Child processes that end with their parent, without messages."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from dermis.apps.batch.child_processes import start_process

FOLDER = Path(__file__).parent
DRIVER = """
import os, sys, time
sys.path.insert(0, sys.argv[1])
from dermis.apps.batch.child_processes import start_process
from test_children import send_forever
child = start_process(send_forever)
child.pipe.recv_bytes()
child.pipe.close()  # as when a process is ended
time.sleep(0.2)
os._exit(0)
"""


def send_forever(pipe: Any) -> None:
    while True:
        pipe.send_bytes(b"word")  # until nobody is there


def send_thread_count(pipe: Any) -> None:
    pipe.send(os.environ.get("OPENBLAS_NUM_THREADS"))


@pytest.mark.parametrize(("variable", "expected"), [(None, "1"), ("3", "3")])
def test_linear_algebra_uses_one_thread_by_default(
    variable: str | None, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if variable:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", variable)
    child = start_process(send_thread_count)
    try:
        assert child.pipe.recv() == expected
        assert os.environ.get("OPENBLAS_NUM_THREADS") == variable  # restored in this process
    finally:
        child.kill()


def test_child_processes_exit_silently_with_their_parent() -> None:
    command = [sys.executable, "-c", DRIVER, str(FOLDER)]
    ran = subprocess.run(command, capture_output=True, timeout=300, check=False)
    assert (ran.returncode, ran.stderr) == (0, b"")  # stderr is open until the child ends
