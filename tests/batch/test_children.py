"""Processes that end with the one that started them, and say nothing of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
DRIVER = """
import os, sys, time
sys.path.insert(0, sys.argv[1])
from dermis.batch.children import start
from test_children import talk
child = start(talk)
child.pipe.recv_bytes()
child.pipe.close()  # as a process that is ended lets go of one thing after the other
time.sleep(0.2)
os._exit(0)
"""


def talk(pipe: Any) -> None:
    while True:
        pipe.send_bytes(b"word")  # until nobody is there


def test_whose_driver_is_gone_ends_in_silence() -> None:
    command = [sys.executable, "-c", DRIVER, str(FOLDER)]
    ran = subprocess.run(command, capture_output=True, timeout=60, check=False)
    assert (ran.returncode, ran.stderr) == (0, b"")  # which the child holds open until it has ended
