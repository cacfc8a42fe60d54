"""How much device memory the process holds, and a check before asking for too much."""

from __future__ import annotations

import os

from dermis.errors import refuse
from dermis.gpu.device import Device


def held_bytes() -> int:
    """Bytes of all textures and buffers that are not yet released."""
    import wgpu

    found = wgpu.diagnostics.object_counts.get_dict()
    return int(found["total"].get("resource_mem", 0))


def check_memory(device: Device, needed: float, option: str, sizes: str) -> None:
    """Refuse sizes that do not fit into main memory, where software adapters keep textures.

    needed : bytes; the system kills a process that takes too much
    option, sizes : named in the message

    Raises DermisError.
    """
    if device.adapter.kind != "CPU" or not hasattr(os, "sysconf"):
        return
    here = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > here:
        came = f"{sizes} need {needed / 1e9:.0f} GB"
        refuse(option, f"a frame within {here / 1e9:.0f} GB", came, "Choose smaller ones")
