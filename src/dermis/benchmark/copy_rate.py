"""How many bytes a second the device moves when it does nothing else."""

from __future__ import annotations

import statistics
from pathlib import Path
from typing import Any

from dermis.errors import DermisError
from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.gpu.textures import texel_bytes

_SIDE, _SIDE_ON_CPU = 4096, 1024  # beyond what caches hold
_COPIES, _REPEATS, _WARMING = 8, 5, 20


def copy_rate(device: Device) -> float:
    """Bytes read and written a second by a pass that copies a texture, median of some frames [byte/s].

    Raises DermisError when the device cannot tell how long a pass took.
    """
    software = device.adapter.kind == "CPU"
    side = _SIDE_ON_CPU if software else _SIDE
    program = ComputeProgram(device, Path(__file__).parent / "copy.wgsl")
    textures = [make_texture(device, (side, side), "rgba32float") for _ in range(2)]
    times = [_copy(device, program, textures) for _ in range(_REPEATS + (0 if software else _WARMING))]
    moved = 2 * _COPIES * side * side * texel_bytes(textures[0])
    return moved / (1e-3 * statistics.median(times[-_REPEATS:]))


def _copy(device: Device, program: ComputeProgram, textures: list[Any]) -> float:
    """Time of copying back and forth [ms]."""
    frame, (one, other) = Frame(device), textures
    for source, copied in ((one, other), (other, one)) * (_COPIES // 2):
        frame.compute("copy", program, {"source": source, "copied": copied}, one.size[:2])
    frame.submit()
    frame.wait()
    times = frame.stage_ms()
    if times is None:
        raise DermisError(
            f"{device.adapter.name}: expected timestamps of its passes, but it has none. "
            "Choose another adapter, such as --adapter cpu."
        )
    return times["total"]
