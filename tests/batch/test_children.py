"""Processes that end with the one that started them, and say nothing of it."""

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
from test_children import talk
child = start_process(talk)
child.pipe.recv_bytes()
child.pipe.close()  # as a process that is ended lets go of one thing after the other
time.sleep(0.2)
os._exit(0)
"""


def talk(pipe: Any) -> None:
    while True:
        pipe.send_bytes(b"word")  # until nobody is there


def tell_threads(pipe: Any) -> None:
    pipe.send(os.environ.get("OPENBLAS_NUM_THREADS"))


@pytest.mark.parametrize(("asked", "had"), [(None, "1"), ("3", "3")])
def test_linear_algebra_has_one_thread_unless_the_user_says(
    asked: str | None, had: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if asked:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", asked)
    child = start_process(tell_threads)
    try:
        assert child.pipe.recv() == had
        assert os.environ.get("OPENBLAS_NUM_THREADS") == asked  # of this process, as it was
    finally:
        child.kill()


def test_whose_driver_is_gone_ends_in_silence() -> None:
    command = [sys.executable, "-c", DRIVER, str(FOLDER)]
    ran = subprocess.run(command, capture_output=True, timeout=300, check=False)
    assert (ran.returncode, ran.stderr) == (0, b"")  # which the child holds open until it has ended
