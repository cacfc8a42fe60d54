"""Memory of devices and of the process: what is held, what is left, and errors where it runs out."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from dermis.base.errors import DermisError, refuse
from dermis.gpu.types import Buffer

if TYPE_CHECKING:
    from dermis.gpu.device import Device

_LISTING = 0.5e9, 0.15e9
"""Bytes of address space to load all drivers, and for each thread of Mesa's; measured with Mesa 22.3."""

_SOFTWARE = 0.9e9, 0.22e9
"""The same to open the software adapter and draw the package's human at 512x512, atlas 1024."""

_MOST_THREADS = 16  # of Mesa's software adapter

_GROUPS = Path("/sys/fs/cgroup")

_LEAST_PROBED = 1 << 20  # bytes

_SAID = "out of memory", "not enough memory"  # by the library, whose class of error differs

_RAISE_LIMIT = "Raise it: ulimit -v unlimited"

_SMALLER = "Choose smaller ones"

_SMALLER_FRAME = (
    "Lower --size, --samples or --atlas, close other programs that use the GPU, or try --adapter cpu"
)


class OutOfMemoryError(DermisError):
    """Something that does not fit onto a device.

    expected, came : sentences without a full stop, for who knows of a better remedy
    size : of what did not fit [byte]
    """

    def __init__(self, expected: str, came: str, size: float, remedy: str = _SMALLER_FRAME) -> None:
        super().__init__(f"{expected}, but {came}. {remedy}.")
        self.expected, self.came, self.size = expected, came, size


@contextlib.contextmanager
def allocation(device: str, name: str, size: float, most: float) -> Iterator[None]:
    """Tell what it was where something is not made.

    device, name : of the adapter, and of what is made
    size, most : how large it is, and how large it may be [byte]

    Raises OutOfMemoryError.
    """
    import wgpu

    expected = f"{device}: expected room for the {name}, {format_bytes(size)}"
    if size > most:
        raise OutOfMemoryError(expected, f"it takes at most {format_bytes(most)} at once", size)
    try:
        yield
    except (wgpu.GPUError, MemoryError) as error:
        if isinstance(error, wgpu.GPUError) and not any(words in str(error).lower() for words in _SAID):
            raise
        raise OutOfMemoryError(expected, "it has none left", size) from error


def allocated_bytes() -> int:
    """Bytes of all textures and buffers that are not yet released."""
    import wgpu

    found = wgpu.diagnostics.object_counts.get_dict()
    return int(found["total"].get("resource_mem", 0))


def check_memory(
    device: Device,
    needed: float,
    option: str,
    sizes: str,
    remedy: Callable[[float], str] = lambda _: _SMALLER,
) -> None:
    """Refuse sizes that do not fit into main memory, where software adapters keep textures.

    needed : bytes; the system kills a process that takes too much
    option, sizes : named in the message
    remedy : what fits into a number of bytes

    Raises DermisError.
    """
    if device.adapter.kind != "CPU":
        return
    here = available_memory()
    if needed > here:
        came = f"{sizes} need {needed / 1e9:.0f} GB"
        refuse(option, f"a frame within {here / 1e9:.0f} GB", came, remedy(here))


def probe_memory(device: Device, most: float) -> float:
    """Bytes, up to `most`, that a device has room for: found by taking them, and given back."""
    taken: list[Buffer] = []
    total, size = 0, min(int(most), device.max_storage_bytes) // 4 * 4
    while size >= _LEAST_PROBED and total < most:
        try:
            taken.append(device.space(size, "probe"))
            total += size
        except OutOfMemoryError:
            size = size // 8 * 4
    for buffer in taken:
        buffer.destroy()
    return float(total)


def check_drivers() -> None:
    """Raises DermisError where drivers could not be loaded, and tells what the software adapter takes too."""
    if _limit() < math.inf and not _has_drivers():
        _check(_bytes(_LISTING), _bytes(_SOFTWARE))


def check_software() -> None:
    """Raises DermisError where the software adapter could not draw; others are not known."""
    if _limit() < math.inf:
        _check(_bytes(_SOFTWARE))


def available_memory() -> float:
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


def format_bytes(size: float) -> str:
    """Bytes as people write them."""
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.1f} MB"


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
        refuse("address space (ulimit -v)", wanted, came, _RAISE_LIMIT)


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
