"""The command as a process: when it is ended, no process remains, and it can be continued."""

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
from small_set import COUNT, PARTS, SHARD_SIZE, SHARDS, contents

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are listed by /proc")
_TIMEOUT_S = 200.0
Files = dict[str, bytes]


def started(
    spec: Path, out: Path, gate: Path | None = None, start: Callable[..., Any] = child_process.start
) -> subprocess.Popen[bytes]:
    """Start the command in its own session, by which its workers are found.

    gate : file until which workers wait once a part is complete
    """
    arguments = f"batch {spec} -o {out} --adapter cpu --workers 2 --encoders 1".split()
    script = (
        f"import sys; sys.path.append({str(Path(__file__).parent)!r}); import held_worker; held_worker.main()"
    )
    program = ["-m", "dermis"] if gate is None else ["-c", script]
    environment, pipe = os.environ | {held_worker.GATE: str(gate)}, subprocess.PIPE
    command = [sys.executable, *program, *arguments]
    return start(command, stdout=pipe, stderr=pipe, env=environment, start_new_session=True)


def session_processes(number: int) -> list[int]:
    """Return the running processes of a session."""
    found = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session_id = file.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session_id) == number and state != "Z":
            found.append(int(file.parent.name))
    return found


def wait_for(out: Path, pattern: str, count: int, driver: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + _TIMEOUT_S
    while len(list(out.glob(pattern))) < count:
        assert driver.poll() is None, "the driver ended before its files were written"
        assert time.monotonic() < end, "no files were written"
        time.sleep(0.01)


def wait_until_ended(number: int) -> None:
    end = time.monotonic() + _TIMEOUT_S
    while session_processes(number) and time.monotonic() < end:
        time.sleep(0.02)
    assert session_processes(number) == []


def besides_progress(notes: bytes) -> list[bytes]:
    """Return the lines of stderr without the progress lines of slow machines, and without notes."""
    return [line for line in notes.splitlines() if b" images/s, " not in line and b"note: " not in line]


def test_a_killed_driver_leaves_nobody_and_is_gone_on_with(
    small_folder: Path, undisturbed: Files, tmp_path: Path
) -> None:
    rng, skipped = random.Random(5), 0
    for shards in (0, 2):
        driver = started(small_folder / "spec.toml", tmp_path)
        wait_for(tmp_path, "shard-*.tar", shards, driver)
        time.sleep(rng.uniform(0.0, 1.0))
        driver.kill()
        driver.communicate()
        wait_until_ended(driver.pid)
    skipped = len(list(tmp_path.glob("shard-*.tar")))
    last = started(small_folder / "spec.toml", tmp_path)
    output, notes = last.communicate()
    wait_until_ended(last.pid)
    assert (last.returncode, besides_progress(notes)) == (0, []) and session_processes(last.pid) == []
    assert f"({skipped} reused)".encode() in output and 2 <= skipped <= SHARDS
    assert contents(tmp_path) == undisturbed


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_one_that_is_asked_to_end_keeps_its_parts(
    small_folder: Path, undisturbed: Files, tmp_path: Path, number: signal.Signals
) -> None:
    driver = started(small_folder / "spec.toml", tmp_path / "out", tmp_path / "never")
    wait_for(tmp_path / "out", "part-*.tar", 1, driver)
    # Ctrl-C reaches all that the terminal has started, not the driver alone.
    os.killpg(driver.pid, number) if number == signal.SIGINT else driver.send_signal(number)
    output, notes = driver.communicate()
    assert (driver.returncode, output, besides_progress(notes)) == (128 + number, b"", [])
    wait_until_ended(driver.pid)
    kept = {path.name for path in (tmp_path / "out").glob("part-*.tar")}
    joined = [int(path.stem[6:]) for path in (tmp_path / "out").glob("shard-*.tar")]  # by the first two parts
    assert (kept or joined) and set(contents(tmp_path / "out")) - kept <= set(undisturbed)
    resumed = started(small_folder / "spec.toml", tmp_path / "out")
    output, _ = resumed.communicate()
    images = int(output.split(b" images in ")[0].split()[-1])
    assert resumed.returncode == 0 and images <= COUNT - sum(
        stop - first
        for first, stop in PARTS
        if f"part-{first:09d}.tar" in kept or first // SHARD_SIZE in joined
    )
    assert contents(tmp_path / "out") == undisturbed


def test_under_nohup_a_hangup_ends_nothing(small_folder: Path, undisturbed: Files, tmp_path: Path) -> None:
    """Like Ctrl-C, which background jobs of a shell ignore; both signals reach the workers too."""
    with child_process.ignored_signals():
        driver = started(small_folder / "spec.toml", tmp_path / "out", tmp_path / "gate", subprocess.Popen)
    wait_for(tmp_path / "out", "part-*.tar", 1, driver)
    for number in (signal.SIGHUP, signal.SIGINT):
        os.killpg(driver.pid, number)
    (tmp_path / "gate").touch()
    _, notes = driver.communicate()
    assert (driver.returncode, besides_progress(notes)) == (0, [])
    assert contents(tmp_path / "out") == undisturbed
