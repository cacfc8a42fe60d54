"""How much device memory the process holds, and whether there is room for more."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from dermis.base.errors import refuse
from dermis.gpu.address_space import room
from dermis.gpu.device import Device
from dermis.gpu.no_room import NoRoomError

_LEAST_PROBED = 1 << 20  # bytes
_SMALLER = "Choose smaller ones"


def held_bytes() -> int:
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
    here = room()
    if needed > here:
        came = f"{sizes} need {needed / 1e9:.0f} GB"
        refuse(option, f"a frame within {here / 1e9:.0f} GB", came, remedy(here))


def found_room(device: Device, most: float) -> float:
    """Bytes, up to `most`, that a device has room for: found by taking them, and given back."""
    taken: list[Any] = []
    total, size = 0, min(int(most), device.max_storage_bytes) // 4 * 4
    while size >= _LEAST_PROBED and total < most:
        try:
            taken.append(device.space(size, "probe"))
            total += size
        except NoRoomError:
            size = size // 8 * 4
    for buffer in taken:
        buffer.destroy()
    return float(total)
