"""Terminal output of commands during preparation."""

from __future__ import annotations

import contextlib
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

import dermis

PREPARES = """
import sys
from types import SimpleNamespace
from dermis.base.progress import logged_step
from dermis.base import console

now = 0.0
console.time = SimpleNamespace(monotonic=lambda: now)
with console.spinner("loading"):
    for step, seconds in (("fitting the eyes", float(sys.argv[1])), ("reading the mesh", 0.0)):
        with logged_step(step):
            now += seconds
            sys.stdin.readline()
"""
TIMES = 5


def shown_on_a_terminal(seconds: float) -> list[str]:
    """Return what a spinner shows TIMES during each of two steps.

    seconds : that the first step has taken by the spinner's clock; the second has just begun
    """
    master, slave = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "100"}
    command = [sys.executable, "-c", PREPARES, str(seconds)]
    shown = []
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stderr=slave, env=environment, text=True
    ) as process:
        os.close(slave)
        assert process.stdin is not None
        for _ in range(2):
            text = ""
            while text.count("loading") < TIMES:
                text += os.read(master, 1 << 16).decode(errors="replace")
            shown.append(text)
            process.stdin.write("\n")
            process.stdin.flush()
        with contextlib.suppress(OSError):  # as Linux tells that the other end is closed
            while os.read(master, 1 << 16):
                pass
    os.close(master)
    assert process.returncode == 0
    return shown


def test_a_terminal_shows_slow_steps() -> None:
    first, second = shown_on_a_terminal(3.0)
    assert "loading: fitting the eyes (3 s)" in first
    assert "reading the mesh" not in second


def test_a_terminal_hides_fast_steps() -> None:
    assert not any("fitting" in text or "reading" in text for text in shown_on_a_terminal(1.0))


def test_no_progress_is_shown_without_a_terminal() -> None:
    command = [sys.executable, "-c", PREPARES, "3"]
    made = subprocess.run(command, input="\n\n", capture_output=True, check=True, text=True)
    assert (made.stdout, made.stderr) == ("", "")


def test_loading_a_head_logs_its_steps(caplog: pytest.LogCaptureFixture, folder: Path) -> None:
    with caplog.at_level("INFO", logger="dermis"):
        dermis.load_head("head.obj", subdivide=1)
    assert caplog.messages == [
        "reading the mesh",
        "subdividing the mesh",
        "finding the regions of the face",
        "fitting the eyes",
    ]
