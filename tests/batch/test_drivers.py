"""The command as a process: ended at any moment it leaves nothing running, and goes on where it was."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import child_process
import held_worker
import pytest
from small_set import SHARDS, contents

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are listed by /proc")
_LONGEST_S = 200.0
Files = dict[str, bytes]


def started(
    spec: Path, out: Path, gate: Path | None = None, start: Callable[..., Any] = child_process.start
) -> subprocess.Popen[bytes]:
    """Start the command in a session of its own, by which its workers are found.

    gate : file until which workers hold once a shard is whole
    """
    words = f"batch {spec} -o {out} --adapter cpu --workers 2 --encoders 1".split()
    held = (
        f"import sys; sys.path.append({str(Path(__file__).parent)!r}); import held_worker; held_worker.main()"
    )
    program = ["-m", "dermis"] if gate is None else ["-c", held]
    environment, pipe = os.environ | {held_worker.GATE: str(gate)}, subprocess.PIPE
    command = [sys.executable, *program, *words]
    return start(command, stdout=pipe, stderr=pipe, env=environment, start_new_session=True)


def session(number: int) -> list[int]:
    """Its processes that are still running."""
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, of = place.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(of) == number and state != "Z":
            found.append(int(place.parent.name))
    return found


def wait_for_shards(out: Path, count: int, driver: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + _LONGEST_S
    while len(list(out.glob("shard-*.tar"))) < count:
        assert driver.poll() is None, "the driver ended before its shards came"
        assert time.monotonic() < end, "the shards never come"
        time.sleep(0.01)


def wait_until_all_left(number: int) -> None:
    end = time.monotonic() + _LONGEST_S
    while session(number) and time.monotonic() < end:
        time.sleep(0.02)
    assert session(number) == []


def besides_progress(notes: bytes) -> list[bytes]:
    """Lines of stderr but for those that a slow machine gets every half minute."""
    return [line for line in notes.splitlines() if b" images/s, " not in line]


def test_a_killed_driver_leaves_nobody_and_is_gone_on_with(
    small_folder: Path, undisturbed: Files, tmp_path: Path
) -> None:
    rng, skipped = random.Random(5), 0
    for shards in (0, 2):
        driver = started(small_folder / "spec.toml", tmp_path)
        wait_for_shards(tmp_path, shards, driver)
        time.sleep(rng.uniform(0.0, 1.0))
        driver.kill()
        driver.communicate()
        wait_until_all_left(driver.pid)
    skipped = len(list(tmp_path.glob("shard-*.tar")))
    last = started(small_folder / "spec.toml", tmp_path)
    said, notes = last.communicate()
    assert (last.returncode, besides_progress(notes)) == (0, []) and session(last.pid) == []
    assert f"({skipped} were there)".encode() in said and 2 <= skipped <= SHARDS
    assert contents(tmp_path) == undisturbed


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_one_that_is_asked_to_end_keeps_what_is_whole(
    small_folder: Path, undisturbed: Files, tmp_path: Path, number: signal.Signals
) -> None:
    driver = started(small_folder / "spec.toml", tmp_path / "out", tmp_path / "never")
    wait_for_shards(tmp_path / "out", 1, driver)
    # Ctrl-C reaches all that the terminal has started, not the driver alone.
    os.killpg(driver.pid, number) if number == signal.SIGINT else driver.send_signal(number)
    said, notes = driver.communicate()
    assert (driver.returncode, said, besides_progress(notes)) == (128 + number, b"", [])
    wait_until_all_left(driver.pid)
    assert set(contents(tmp_path / "out")) < set(undisturbed)


def test_under_nohup_a_hangup_ends_nothing(small_folder: Path, undisturbed: Files, tmp_path: Path) -> None:
    """Ctrl-C neither, as a shell's background job ignores it; each reaches the workers too."""
    with child_process.ignored_signals():
        driver = started(small_folder / "spec.toml", tmp_path / "out", tmp_path / "gate", subprocess.Popen)
    wait_for_shards(tmp_path / "out", 1, driver)
    for number in (signal.SIGHUP, signal.SIGINT):
        os.killpg(driver.pid, number)
    (tmp_path / "gate").touch()
    _, notes = driver.communicate()
    assert (driver.returncode, besides_progress(notes)) == (0, [])
    assert contents(tmp_path / "out") == undisturbed
