"""How much memory the process may still take: graphics drivers end it where they get none."""

from __future__ import annotations

import contextlib
import math
import os
from pathlib import Path

from dermis.base.errors import refuse

_GROUPS = Path("/sys/fs/cgroup")
_LISTING = 0.5e9, 0.15e9
"""Bytes of address space to load all drivers, and for each thread of Mesa's; measured with Mesa 22.3."""
_SOFTWARE = 0.9e9, 0.22e9
"""The same to open the software adapter and draw the package's human at 512x512, atlas 1024."""
_MOST_THREADS = 16  # of Mesa's software adapter
_REMEDY = "Raise it: ulimit -v unlimited"


def check_listing() -> None:
    """Raises DermisError where drivers could not be loaded, and tells what the software adapter takes too."""
    if _limit() < math.inf and not _has_drivers():
        _check(_bytes(_LISTING), _bytes(_SOFTWARE))


def check_software() -> None:
    """Raises DermisError where the software adapter could not draw; others are not known."""
    if _limit() < math.inf:
        _check(_bytes(_SOFTWARE))


def room() -> float:
    """Bytes that the process may still take: of its address space, main memory and its group's share."""
    return min(_address_room(), main_memory())


def main_memory() -> float:
    """Bytes of the machine, or of the process's group where it has less; infinite where that is unknown."""
    known = [math.inf]
    with contextlib.suppress(AttributeError, ValueError):  # on Windows
        known.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError):
        known += _group_limits()
    return min(known)


def _group_limits() -> list[float]:
    """What control groups allow (cgroup v2 and v1)."""
    own = [_GROUPS / name for name in _own_groups()]
    folders = [folder for one in own for folder in (one, *one.parents) if folder.is_relative_to(_GROUPS)]
    files = [*(folder / "memory.max" for folder in folders), _GROUPS / "memory" / "memory.limit_in_bytes"]
    texts = [file.read_text().strip() for file in files if file.is_file()]
    return [float(text) for text in texts if text.isdigit()]


def _own_groups() -> list[str]:
    lines = Path("/proc/self/cgroup").read_text().splitlines()
    return [line.removeprefix("0::").lstrip("/") for line in lines if line.startswith("0::")]


def _check(needed: float, later: float = 0.0) -> None:
    """Refuse a limit below what is needed.

    later : bytes that are needed after these
    """
    limit, taken = _limit(), _taken()
    if taken + needed > limit:
        whole = _gigabytes(math.ceil((taken + needed + later) / 1e8) * 1e8)
        wanted = f"at least {whole} for graphics drivers and a frame in software"
        came = f"the limit is {_gigabytes(limit)}, of which {_gigabytes(taken)} are taken"
        refuse("address space (ulimit -v)", wanted, came, _REMEDY)


def _has_drivers() -> bool:
    """Whether this process has loaded drivers before."""
    try:
        return "libvulkan" in Path("/proc/self/maps").read_text()
    except OSError:  # not on Linux
        return False


def _bytes(needed: tuple[float, float]) -> float:
    return needed[0] + needed[1] * _threads()


def _address_room() -> float:
    return _limit() - _taken()


def _limit() -> float:
    """Of the process's address space [bytes]."""
    try:
        import resource
    except ImportError:  # on Windows
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return math.inf if limit == resource.RLIM_INFINITY else float(limit)


def _taken() -> float:
    """Bytes of address space."""
    try:
        return float(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:  # not on Linux
        return 0.0


def _threads() -> int:
    """Of Mesa's software adapter."""
    asked = os.environ.get("LP_NUM_THREADS", "")
    return int(asked) if asked.isdigit() else min(os.cpu_count() or 1, _MOST_THREADS)


def _gigabytes(count: float) -> str:
    return f"{count / 1e9:.1f} GB"
