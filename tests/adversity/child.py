"""Processing of an input in a separate process under limits of time and memory."""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import re
import select
import signal
import sys
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from adversity import case
from adversity.case import FoundError, Plan
from adversity.hostile import NAMES, NUMBERS, PIPE
from adversity.kind import Kind

from dermis.base.errors import DermisError

FORM = re.compile(r".+?: expected .+, but .+\. \S.+[.?]", re.DOTALL)
_CACHE = "cache"
_TOLD, _PRINTED = ".told.json", ".printed"
_UNFINISHED = re.compile(r"\.dermis-|\.part$")
_LIGHT = re.compile(r"light \d+$")  # of a preset, within a head that a file made too large
_HELD = tuple(one for one in (*NAMES, *NUMBERS) if one.strip())
_LOOK_S = 0.02
_OWN = str(Path(__file__).parent)


@dataclass(frozen=True)
class Limits:
    """Limits for the processing of an input.

    cpu_s : CPU time [s]
    stalled_s : time without any activity [s]
    bytes : memory in addition to that of the parent process
    """

    cpu_s: float = 10.0
    stalled_s: float = 10.0
    bytes: int = 2 << 30


def outcome_of(kind: Kind, plan: Plan, folder: Path, limits: Limits) -> tuple[str, str, str]:
    """Return outcome, location and last lines of an input whose files are in a folder."""
    os.mkfifo(folder / PIPE)
    before = _listed(folder)
    idle, held_open = os.pipe()  # standard input that never ends
    process = os.fork()
    if process == 0:
        _take(kind, plan, folder, idle)
    os.close(idle)
    try:
        died = _watch(process, limits)
    finally:
        os.close(held_open)
    told = folder / _TOLD
    printed = (folder / _PRINTED).read_text("utf-8", "replace") if (folder / _PRINTED).exists() else ""
    last = "\n".join(printed[-4000:].splitlines()[-12:])
    if died or not told.exists():
        return died or case.SIGNAL, _place_of_dump(printed), last
    outcome, place, what = json.loads(told.read_text())
    left = _left_behind(outcome, plan, before, _listed(folder))
    if left:
        return case.HALF_WRITTEN, "left behind", f"{left} lie there after: {outcome}\n{what}"
    return outcome, place, "\n".join(filter(None, (what, last)))


def _take(kind: Kind, plan: Plan, folder: Path, idle: int) -> None:
    """Process the input in the child, report the outcome, and end."""
    try:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        printed = os.open(folder / _PRINTED, os.O_WRONLY | os.O_CREAT)
        for target, source in enumerate((idle, printed, printed)):
            os.dup2(source, target)
        sys.stdin, sys.stdout = open(0), open(1, "w", 1)  # noqa: SIM115
        sys.stderr = open(2, "w", 1, errors="backslashreplace")  # noqa: SIM115
        os.chdir(folder)
        faulthandler.enable(all_threads=False)
        np.seterr(all="warn", under="ignore")  # as users have it, and not tests
        warnings.simplefilter("default")
        told = _told(kind, plan)
        Path(_TOLD).write_text(json.dumps(told))
    finally:
        os._exit(0)


def _told(kind: Kind, plan: Plan) -> tuple[str, str, str]:
    """Return outcome, location and message."""
    try:
        kind.take(plan)
    except DermisError as refusal:
        return _of_refusal(refusal, plan)
    except FoundError as found:
        return found.outcome, re.split(r"[. ]", str(found))[0], str(found)
    except BaseException as fault:
        text = "".join(traceback.format_exception(fault, limit=-40))
        return case.TRACEBACK, _place(fault), text[-3000:]
    return case.ACCEPTED, "", ""


def _of_refusal(refusal: DermisError, plan: Plan) -> tuple[str, str, str]:
    """Check that a refusal has the package's form and begins with a file of the input or a name in it."""
    message = str(refusal)
    error_subject = message.partition(": expected ")[0]
    names = any(one in error_subject for one in plan["error_subjects"]) or _is_held(
        error_subject.strip("'\"")
    )
    names |= bool(_LIGHT.match(error_subject))
    if FORM.fullmatch(message) and (names or not plan["error_subjects"]):
        return case.REFUSED, "", message[:300]
    what = "names no file" if FORM.fullmatch(message) else "has another form"
    return case.UNCLEAR, f"{what}: {_place(refusal)}", message[:3000]


def _is_held(error_subject: str) -> bool:
    """Return whether a damaged file may contain the name, complete or shortened."""
    begin, shortened, _ = error_subject.partition(" ... ")
    if shortened:
        return any(begin in one for one in _HELD)
    return not error_subject.strip() or error_subject.endswith(
        (*_HELD, *(one.replace("//", "/") for one in _HELD))
    )


def _place(fault: BaseException) -> str:
    """Return the last line of the package in the traceback, and the kind of the error."""
    frames = [one for one in traceback.extract_tb(fault.__traceback__) if not one.filename.startswith(_OWN)]
    ours = [one for one in frames if "/dermis/" in one.filename and one.name != "refuse"]
    last = next(reversed(ours or frames), None)
    where = f"{last.filename.rpartition('/dermis/')[2]}:{last.lineno} {last.name}" if last else "?"
    return f"{type(fault).__name__} at {where}"


def _place_of_dump(printed: str) -> str:
    """Return the innermost line of the package in the output of `faulthandler`."""
    found = re.search(r'File ".*?/dermis/([^"]+)", line (\d+) in (\w+)', printed)
    return f"{found[1]}:{found[2]} {found[3]}" if found else ""


def _watch(process: int, limits: Limits) -> str:
    """Wait for a child and return the limit that it exceeded, empty for none."""
    watched, used, moved = os.pidfd_open(process), 0.0, time.monotonic()
    with contextlib.closing(os.fdopen(watched)):
        base = max(_state(process)[1], _state(os.getpid())[1])  # a child loads what its parent had as well
        while not select.select([watched], [], [], _LOOK_S)[0]:
            now, (cpu_s, held, runs) = time.monotonic(), _state(process)
            if cpu_s > used or runs:
                used, moved = cpu_s, now
            broken = case.MEMORY if held - base > limits.bytes else ""
            if cpu_s > limits.cpu_s or now - moved > limits.stalled_s:
                broken = case.HANG
            if broken:
                return _end(process, broken)
    _, ended, used_in_all = os.wait4(process, 0)
    if used_in_all.ru_maxrss * 1024 - base > limits.bytes:
        return case.MEMORY
    return "" if ended == 0 else case.SIGNAL


def _end(process: int, broken: str) -> str:
    """Make a child write its traceback, and kill it."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGABRT)
        time.sleep(0.1)
        os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return broken


def _state(process: int) -> tuple[float, int, bool]:
    """Return CPU time [s], resident bytes, and whether a process is running."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except (OSError, ProcessLookupError):
        return 0.0, 0, True
    cpu_s = (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")
    return cpu_s, int(stat[21]) * os.sysconf("SC_PAGE_SIZE"), stat[0] in "RD"


def _listed(folder: Path) -> set[str]:
    """Return the names of all files in a folder except those of the campaign."""
    found = (str(one.relative_to(folder)) for one in folder.rglob("*") if not one.is_dir())
    return {one for one in found if one not in (_TOLD, _PRINTED)}


def _left_behind(outcome: str, plan: Plan, before: set[str], after: set[str]) -> list[str]:
    """Return files that should not exist: incomplete ones, and any beside a refusal."""
    new = {one for one in after - before if not one.startswith(_CACHE)}
    allowed = tuple(plan.get("outputs" if outcome == case.ACCEPTED else "kept", ()))
    left = {one for one in new if _UNFINISHED.search(Path(one).name) or not one.startswith(allowed)}
    return sorted(left) if outcome in (case.ACCEPTED, case.REFUSED) else []
