"""Memory of devices and of the process: allocated and free bytes, and errors when it runs out."""

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

_DRIVER_BASE_AND_THREAD_BYTES = 0.5e9, 0.15e9
"""Address space for loading all drivers of Mesa 22.3, and extra space per thread of its adapter [byte]."""

_RENDERING_BASE_AND_THREAD_BYTES = 0.9e9, 0.22e9
"""Address space for rendering the package's human in software, and extra space per thread [byte].

Measured at 512x512 with an atlas of 1024.
"""

_MAX_SOFTWARE_THREADS = 16  # largest number of threads of Mesa's software adapter

_CGROUP_FOLDER = Path("/sys/fs/cgroup")

_MIN_PROBE_BYTES = 1 << 20

_OUT_OF_MEMORY_WORDS = "out of memory", "not enough memory"  # words in wgpu's errors, whose classes differ

_ADDRESS_SPACE_ADVICE = "Raise it: ulimit -v unlimited"

_SMALLER_SIZES_ADVICE = "Choose smaller ones"

_SMALLER_FRAME_ADVICE = (
    "Lower --size, --samples or --atlas, close other programs that use the GPU, or try --adapter cpu"
)


class OutOfMemoryError(DermisError):
    """Error for a resource that does not fit into the memory of a device.

    expected : first part of the message, which says what needs memory
    actual : second part of the message, which says why it does not fit
    size : size of the resource [byte]

    The message also contains advice. Callers can replace the advice: they catch the error, and raise a new
    one with the same `expected` and `actual`.
    """

    def __init__(self, expected: str, actual: str, size: float, advice: str = _SMALLER_FRAME_ADVICE) -> None:
        super().__init__(f"{expected}, but {actual}. {advice}.")
        self.expected, self.actual, self.size = expected, actual, size


@contextlib.contextmanager
def checked_allocation(
    adapter_name: str, resource_name: str, resource_bytes: float, max_bytes: float
) -> Iterator[None]:
    """Raise OutOfMemoryError if the resource that is created in this context does not fit into memory.

    adapter_name : name of the adapter, for the message
    resource_name : name of the resource, for the message
    resource_bytes : size of the resource [byte]
    max_bytes : largest size that the device allows [byte]
    """
    import wgpu

    expected = f"{adapter_name}: expected room for the {resource_name}, {format_bytes(resource_bytes)}"
    if resource_bytes > max_bytes:
        raise OutOfMemoryError(
            expected, f"it takes at most {format_bytes(max_bytes)} at once", resource_bytes
        )
    try:
        yield
    except (wgpu.GPUError, MemoryError) as error:
        text = str(error).lower()
        if isinstance(error, wgpu.GPUError) and not any(words in text for words in _OUT_OF_MEMORY_WORDS):
            raise
        raise OutOfMemoryError(expected, "it has none left", resource_bytes) from error


def allocated_bytes() -> int:
    """Return the total size of all textures and buffers that are not released [byte]."""
    import wgpu

    found = wgpu.diagnostics.object_counts.get_dict()
    return int(found["total"].get("resource_mem", 0))


def check_memory(
    device: Device,
    needed_bytes: float,
    option_name: str,
    sizes_text: str,
    advice_for_bytes: Callable[[float], str] = lambda _: _SMALLER_SIZES_ADVICE,
) -> None:
    """Raise DermisError if textures and buffers on a software adapter would not fit into main memory.

    The operating system would otherwise kill the process.

    needed_bytes : size of the textures and buffers [byte]
    option_name : name of the option that sets the sizes, for the message
    sizes_text : description of these sizes, for the message
    advice_for_bytes : function that returns advice, given the number of available bytes
    """
    if device.adapter.kind != "CPU":
        return
    available = available_memory()
    if needed_bytes > available:
        actual = f"{sizes_text} need {needed_bytes / 1e9:.0f} GB"
        refuse(option_name, f"a frame within {available / 1e9:.0f} GB", actual, advice_for_bytes(available))


def probe_memory(device: Device, max_bytes: float) -> float:
    """Measure the free memory of a device, up to `max_bytes`, by allocating and freeing buffers [byte]."""
    buffers: list[Buffer] = []
    total, size = 0, min(int(max_bytes), device.max_storage_bytes) // 4 * 4
    while size >= _MIN_PROBE_BYTES and total < max_bytes:
        try:
            buffers.append(device.storage_buffer(size, "probe"))
            total += size
        except OutOfMemoryError:
            size = size // 8 * 4
    for buffer in buffers:
        buffer.destroy()
    return float(total)


def check_driver_address_space() -> None:
    """Raise DermisError if the address space limit (ulimit -v) is too low to load the graphics drivers."""
    if _address_space_limit() < math.inf and not _has_loaded_drivers():
        _check_address_space(
            _bytes_for_software_threads(_DRIVER_BASE_AND_THREAD_BYTES),
            _bytes_for_software_threads(_RENDERING_BASE_AND_THREAD_BYTES),
        )


def check_software_address_space() -> None:
    """Raise DermisError if the address space limit (ulimit -v) is too low to render in software."""
    if _address_space_limit() < math.inf:
        _check_address_space(_bytes_for_software_threads(_RENDERING_BASE_AND_THREAD_BYTES))


def available_memory() -> float:
    """Return the memory that this process can still allocate [byte].

    The memory is limited by the address space, the memory of the machine, and the control group.
    """
    return min(_address_space_limit() - _address_space_used(), main_memory())


def main_memory() -> float:
    """Return the memory of the machine, or the limit of the process's control group if lower [byte].

    The result is infinite if neither is known.
    """
    known = [math.inf]
    with contextlib.suppress(AttributeError, ValueError):  # on Windows
        known.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError):
        known += _cgroup_limits()
    return min(known)


def format_bytes(byte_count: float) -> str:
    """Return a size in bytes as text in MB or GB."""
    return f"{byte_count / 1e9:.1f} GB" if byte_count >= 1e8 else f"{byte_count / 1e6:.1f} MB"


def _cgroup_limits() -> list[float]:
    """Return the memory limits of the process's Linux control groups, versions 1 and 2 [byte]."""
    own = [_CGROUP_FOLDER / name for name in _control_group_paths()]
    folders = [
        folder for one in own for folder in (one, *one.parents) if folder.is_relative_to(_CGROUP_FOLDER)
    ]
    files = [
        *(folder / "memory.max" for folder in folders),
        _CGROUP_FOLDER / "memory" / "memory.limit_in_bytes",
    ]
    texts = [file.read_text().strip() for file in files if file.is_file()]
    return [float(text) for text in texts if text.isdigit()]


def _control_group_paths() -> list[str]:
    lines = Path("/proc/self/cgroup").read_text().splitlines()
    return [line.removeprefix("0::").lstrip("/") for line in lines if line.startswith("0::")]


def _check_address_space(needed_bytes: float, needed_later_bytes: float = 0.0) -> None:
    limit, used = _address_space_limit(), _address_space_used()
    if used + needed_bytes > limit:
        total = format_bytes(math.ceil((used + needed_bytes + needed_later_bytes) / 1e8) * 1e8)
        expected = f"at least {total} for graphics drivers and a frame in software"
        actual = f"the limit is {format_bytes(limit)}, of which {format_bytes(used)} are taken"
        refuse("address space (ulimit -v)", expected, actual, _ADDRESS_SPACE_ADVICE)


def _has_loaded_drivers() -> bool:
    """Return whether this process has already loaded the Vulkan loader, and with it the drivers."""
    try:
        return "libvulkan" in Path("/proc/self/maps").read_text()
    except OSError:  # not on Linux
        return False


def _bytes_for_software_threads(fixed_and_per_thread_bytes: tuple[float, float]) -> float:
    return fixed_and_per_thread_bytes[0] + fixed_and_per_thread_bytes[1] * _software_threads()


def _address_space_limit() -> float:
    """Return the limit of the process's address space (ulimit -v), infinite if there is none [byte]."""
    try:
        import resource
    except ImportError:  # on Windows
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return math.inf if limit == resource.RLIM_INFINITY else float(limit)


def _address_space_used() -> float:
    try:
        return float(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:  # not on Linux
        return 0.0


def _software_threads() -> int:
    """Return the number of threads of Mesa's software adapter."""
    threads = os.environ.get("LP_NUM_THREADS", "")
    return int(threads) if threads.isdigit() else min(os.cpu_count() or 1, _MAX_SOFTWARE_THREADS)
