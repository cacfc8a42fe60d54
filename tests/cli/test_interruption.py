"""Ctrl-C, SIGTERM and SIGHUP at the worst moment: no partial files remain, and the exit status is right."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import child_process
import pytest
from rigged_head import write_rigged_head, write_take
from small_head import without_colour_note

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are POSIX's")

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
START = """
import os, signal, sys, time
from pathlib import Path

def asked(number):
    os.kill(os.getpid(), number)
    time.sleep(60)  # what follows is raised in here

{}
from dermis.cli import main
sys.argv[0] = "dermis"
main()
"""
AT_THE_END = """
usual = Path.replace
def replace(path, target):  # a file that is whole takes its name
    if not path.suffix == ".part":
        asked(signal.{0})
    return usual(path, target)
Path.replace = replace
"""
IN_THE_CACHE = AT_THE_END.replace("if not path", "if path")
AT_A_FRAME = """
import dermis.mesh.pose as module
usual, drawn = module.merge_poses, []
def merge_poses(*given):
    drawn.append(1)
    if len(drawn) == 3:
        asked(signal.{0})
    return usual(*given)
module.merge_poses = merge_poses
"""
SMALL = "--size 32x32 --atlas 64 --adapter cpu"


def _interrupted(folder: Path, moment: str, number: signal.Signals, words: str) -> tuple[int, str]:
    """Return exit status and stderr of a command that receives a signal at a given moment."""
    code = START.format(moment.format(number.name))
    environment = os.environ | {"DERMIS_CACHE": str(folder / "cache")}
    command, pipe = [sys.executable, "-c", code, *words.split()], subprocess.PIPE
    with child_process.start(
        command, stdout=pipe, stderr=pipe, cwd=folder, env=environment, text=True
    ) as ran:
        said, notes = ran.communicate()
    assert said == ""
    return ran.returncode, without_colour_note(notes)


def _left(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*") if path.is_file() and path.suffix != ".arrays"}


@pytest.mark.parametrize("number", SIGNALS)
def test_the_exit_status_encodes_the_signal(tmp_path: Path, number: signal.Signals) -> None:
    assert _interrupted(tmp_path, AT_THE_END, number, "head -o person.json") == (128 + number, "")
    assert not _left(tmp_path)


def test_a_picture_is_complete_or_unchanged(folder: Path) -> None:
    (folder / "a.png").write_bytes(b"of yesterday")
    words = f"render head.obj -o a.png {SMALL}"
    assert _interrupted(folder, AT_THE_END, signal.SIGTERM, words) == (143, "")
    assert _left(folder) == {"a.png", "head.obj"} and (folder / "a.png").read_bytes() == b"of yesterday"


def test_a_cache_file_is_complete_or_absent(folder: Path) -> None:
    words = f"render head.obj -o a.png {SMALL}"
    assert _interrupted(folder, IN_THE_CACHE, signal.SIGTERM, words) == (143, "")
    assert _left(folder) == {"head.obj"} and not list((folder / "cache").rglob("*.arrays"))


@pytest.mark.parametrize("output", ["a.mp4", "frames/%d.png"])
def test_a_movie_is_complete_or_absent(folder: Path, output: str) -> None:
    write_rigged_head(folder / "face.glb")
    write_take(folder / "take.csv", 0.0, 0.5, 1.0, 0.5, 0.0)
    words = f"animate face.glb --motion take.csv -o {output} {SMALL}"
    code, said = _interrupted(folder, AT_A_FRAME, signal.SIGTERM, words)
    assert code == 143 and "Traceback" not in said
    left = _left(folder) - {"face.glb", "take.csv", "head.obj"}
    assert not [name for name in left if name.startswith(".dermis") or name.endswith(".mp4")]


def test_a_person_file_is_complete_or_absent(tmp_path: Path) -> None:
    words = "head --size 256 --subdivide 0 --adapter cpu -o a.glb"
    assert _interrupted(tmp_path, AT_THE_END, signal.SIGTERM, words) == (143, "")
    assert not _left(tmp_path)


def test_a_gallery_contains_complete_pictures(folder: Path) -> None:
    words = "gallery --only gaussians --head head.obj --size 32 --adapter cpu -o out"
    assert _interrupted(folder, AT_THE_END, signal.SIGTERM, words) == (143, "")
    assert _left(folder) == {"head.obj"}


BODY = """
import os, signal, sys, time
from dermis.cli.process import Interruption

with Interruption() as interruption:
    try:
        {}
    except KeyboardInterrupt:
        sys.stdout.write("raised\\n")
        sys.stdout.flush()
    {}
sys.exit(interruption.code)
"""


def _start(
    body: str, after: str = "pass", start: Callable[..., Any] = child_process.start
) -> subprocess.Popen[str]:
    code = BODY.format(body.replace("\n", "\n        "), after)
    pipe = subprocess.PIPE
    return start([sys.executable, "-c", code], stdout=pipe, stderr=pipe, text=True)


def test_a_second_signal_ends_the_process_immediately() -> None:
    """Also during cleanup, and in a library that blocks the main thread."""
    slow = "import hashlib; hashlib.pbkdf2_hmac('sha256', b'', b'', 10**9)"  # minutes
    with _start("sys.stdout.write('ready\\n'); sys.stdout.flush(); time.sleep(60)", slow) as ran:
        assert ran.stdout is not None
        assert ran.stdout.readline() == "ready\n"
        ran.send_signal(signal.SIGTERM)
        assert ran.stdout.readline() == "raised\n"
        assert _ends_when_asked_again(ran) == 143
        assert ran.communicate()[1] == ""


def _ends_when_asked_again(ran: subprocess.Popen[str]) -> int:
    """Return the exit status of a process that receives SIGTERM every 0.7 s.

    Two signals within 0.5 s count as one.
    """
    for _ in range(100):
        time.sleep(0.7)
        if ran.poll() is not None:
            return int(ran.returncode)
        ran.send_signal(signal.SIGTERM)
    raise AssertionError("the process does not end")


def test_a_repeated_signal_of_an_intermediate_program_counts_once() -> None:
    with _start("sys.stdout.write('ready\\n'); sys.stdout.flush(); time.sleep(60)", "time.sleep(0.3)") as ran:
        assert ran.stdout is not None
        assert ran.stdout.readline() == "ready\n"
        ran.send_signal(signal.SIGTERM)
        assert ran.stdout.readline() == "raised\n"
        ran.send_signal(signal.SIGTERM)
        assert (ran.wait(timeout=120), *ran.communicate()) == (143, "", "")


LOST = {
    "a destructor": """
class Lost:
    def __del__(self): os.kill(os.getpid(), signal.SIGTERM); time.sleep(0.1)
Lost()
time.sleep(60)""",
    "a task of a loop": """
import asyncio
async def drawn():
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(0.1)
async def shown():
    task = asyncio.create_task(drawn())
    await asyncio.sleep(60)
asyncio.run(shown())""",
    "a module half imported": """
import importlib.abc, importlib.util
class Swallows(importlib.abc.Loader):
    def exec_module(self, module):
        try: os.kill(os.getpid(), signal.SIGTERM); time.sleep(0.1)
        except BaseException: pass
importlib._bootstrap._load(importlib.util.spec_from_loader("swallows", Swallows()))
time.sleep(60)""",
    "a driver's callback": """
space = {"__name__": "wgpu.native", "os": os, "signal": signal, "time": time}
exec("def callback():\\n try: os.kill(os.getpid(), signal.SIGTERM); time.sleep(0.1)\\n"
     " except BaseException: pass", space)
space["callback"]()
time.sleep(60)""",
}


@pytest.mark.parametrize("place", LOST)
def test_an_interruption_that_would_be_swallowed_is_repeated(place: str) -> None:
    with _start(LOST[place]) as ran:
        assert (*ran.communicate(timeout=120), ran.returncode) == ("raised\n", "", 143)


@pytest.mark.parametrize("number", SIGNALS)
def test_ignored_signals_stay_ignored(number: signal.Signals) -> None:
    """As by nohup for SIGHUP, and by a shell for SIGINT in the background."""
    with child_process.ignored_signals():
        ran = _start(f"os.kill(os.getpid(), {int(number)}); time.sleep(0.1)", start=subprocess.Popen)
    with ran:
        assert (*ran.communicate(timeout=120), ran.returncode) == ("", "", 0)


def test_signal_handlers_are_restored() -> None:
    from dermis.cli.process import Interruption

    with child_process.default_signals():
        before = [signal.getsignal(number) for number in SIGNALS], sys.unraisablehook
        with Interruption():
            assert not {signal.getsignal(number) for number in SIGNALS} & set(before[0])
        assert ([signal.getsignal(number) for number in SIGNALS], sys.unraisablehook) == before
