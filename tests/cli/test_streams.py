"""Standard streams that are full, closed, abandoned by the reader, or of a small encoding."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import child_process
import pytest

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a shell and a full device")

HELP, CITE = "render --help", "cite"
FAILS = "dermis: stdout: expected writable output, but writing failed ({}). Redirect it.\n"
SINKS = {
    "full": (">/dev/full", 2, FAILS.format("No space left on device")),
    "closed": (">&-", 2, FAILS.format("Bad file descriptor")),
    "nothing is open": (">&- 2>&- <&-", 2, ""),
    "stderr is closed": ("2>&- >/dev/null", 0, ""),
    "stderr is full": ("2>/dev/full >/dev/full", 2, ""),
    "stdin is closed": ("<&- >/dev/null", 0, ""),
}


class Ended(NamedTuple):
    """Exit status and output of a shell command."""

    code: int
    stdout: str
    stderr: str


def _shell(line: str, folder: Path, **more: str) -> Ended:
    """Run a shell command line in which `dermis` is the command."""
    line = line.replace("dermis ", f"'{sys.executable}' -m dermis ")
    ran = subprocess.run(["/bin/sh", "-c", line], capture_output=True, env=os.environ | more, cwd=folder)
    return Ended(ran.returncode, ran.stdout.decode("latin-1"), ran.stderr.decode("latin-1"))


@pytest.mark.parametrize("words", [HELP, CITE])
@pytest.mark.parametrize("sink", SINKS)
def test_a_failed_write_is_reported_once(words: str, sink: str, tmp_path: Path) -> None:
    where, code, said = SINKS[sink]
    assert _shell(f"dermis {words} {where}", tmp_path) == (code, "", said)


@pytest.mark.parametrize("words", ["--help", HELP, CITE, "cite nobody"])
def test_a_closed_pipe_is_not_an_error(words: str, tmp_path: Path) -> None:
    wrong = 2 * (words == "cite nobody")
    ended = _shell(f"{{ dermis {words}; echo $? >code; }} | true", tmp_path)
    assert (ended.code, ended.stdout) == (0, "") and (tmp_path / "code").read_text() == f"{wrong}\n"
    assert ended.stderr.count("\n") == bool(wrong)


def test_unencodable_characters_are_escaped(tmp_path: Path) -> None:
    lines = _shell("dermis cite Kienle1998", tmp_path, PYTHONIOENCODING="utf-8").stdout
    plain = _shell("dermis cite Kienle1998", tmp_path, PYTHONIOENCODING="ascii", LANG="C")
    assert (plain.code, plain.stderr) == (0, "") and plain.stdout.isascii()
    assert plain.stdout.count("\n") == lines.count("\n")
    assert _shell("dermis --help", tmp_path, PYTHONIOENCODING="latin-1").code == 0


SMALL = "head.obj --size 32x32 --atlas 64 --adapter cpu"


def test_descriptors_of_closed_streams_are_reserved(folder: Path) -> None:
    """Otherwise libraries would print into it."""
    assert _shell(f"dermis render {SMALL} -o a.png >&- 2>&- <&-", folder).code == 2
    data = (folder / "a.png").read_bytes()
    assert data.startswith(b"\x89PNG") and data.endswith(b"IEND\xaeB`\x82")


def test_an_undecodable_file_name_is_printed(tmp_path: Path) -> None:
    ended = _shell("dermis head -o $(printf 'a\\377.json')", tmp_path)
    assert ended.code == 0 and ended.stdout.startswith("a\\udcff.json  ") and ended.stderr == ""
    assert (tmp_path / os.fsdecode(b"a\xff.json")).exists()


def test_a_progress_bar_survives_its_terminal() -> None:
    master, slave = os.openpty()
    code = """
import sys
from dermis.base.console import progress_bar, spinner
from dermis.cli.process import StandardStreams
with StandardStreams():
    with spinner("loading"), progress_bar("drawing") as report:
        sys.stdin.readline()
        report(1, 2)
sys.stdout.write("done")
"""
    command = [sys.executable, "-c", code]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=slave, text=True) as ran:
        os.close(slave)
        os.read(master, 1)  # the bar is there
        os.close(master)
        assert ran.communicate("gone\n", timeout=120) == ("done", None)
    assert ran.returncode == 0


def test_a_full_non_blocking_stream_receives_all_data() -> None:
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    code = """
import sys
from dermis.cli.process import StandardStreams
with StandardStreams() as streams:
    sys.stdout.write("x" * 300_000)
    assert streams.stdout_error() is None
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=writing) as ran:
        os.close(writing)
        with os.fdopen(reading, "rb") as file:
            assert len(file.read()) == 300_000
    assert ran.returncode == 0


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX's")
def test_a_blocked_reader_does_not_delay_the_exit() -> None:
    code = """
import dermis.cli, sys
from dermis.base.console import print_lines
dermis.cli._run = lambda: print_lines("x" * 300_000)
dermis.cli.main()
"""
    pipe = subprocess.PIPE
    with child_process.start([sys.executable, "-c", code], stdout=pipe, stderr=pipe) as ran:
        assert ran.stdout is not None and ran.stderr is not None
        assert ran.stdout.read(1) == b"x"
        ran.terminate()
        assert ran.wait(timeout=120) == 143 and ran.stderr.read() == b""
