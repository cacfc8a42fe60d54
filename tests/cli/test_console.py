"""What commands tell on a terminal while they prepare a picture."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

import dermis

SLOW = """
import sys, time
from dermis.cli import console
from dermis.base.progress import preparing

console.TOLD_AFTER_S = 0.2
with console.working_on("loading"):
    with preparing("fitting the eyes"):
        time.sleep(float(sys.argv[1]))
    with preparing("reading the mesh"):
        pass
    time.sleep(0.3)
"""


def told_on_a_terminal(seconds: float) -> str:
    """What a program with a slow step writes to stderr, where that is a terminal."""
    master, slave = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "100"}
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW, str(seconds)], stdin=slave, stderr=slave, env=environment
    )
    os.close(slave)
    found = b""
    while True:
        try:
            part = os.read(master, 1 << 16)
        except OSError:  # as Linux tells that the other end is closed
            break
        if not part:
            break
        found += part
    os.close(master)
    assert process.wait(timeout=60) == 0
    return found.decode()


def test_a_terminal_shows_what_takes_long() -> None:
    text = told_on_a_terminal(1.0)
    assert "loading: fitting the eyes (1 s)" in text
    assert "reading the mesh" not in text


def test_a_terminal_does_not_show_what_is_soon_done() -> None:
    text = told_on_a_terminal(0.0)
    assert "loading" in text
    assert "fitting" not in text


def test_nothing_is_told_elsewhere() -> None:
    made = subprocess.run([sys.executable, "-c", SLOW, "0.5"], capture_output=True, check=True, text=True)
    assert (made.stdout, made.stderr) == ("", "")


def test_loading_a_head_tells_its_steps(caplog: pytest.LogCaptureFixture, folder: Path) -> None:
    with caplog.at_level("INFO", logger="dermis"):
        dermis.load_head("head.obj", subdivide=1)
    assert caplog.messages == [
        "reading the mesh",
        "subdividing the mesh",
        "finding the regions of the face",
        "fitting the eyes",
    ]
