"""Small experiments on an adapter: how it rounds when it stores half floats."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.gpu.device import Device
from dermis.gpu.frame import Frame
from dermis.gpu.program import ComputeProgram
from dermis.gpu.textures import download, make_texture

_SIDE = 64


def half_store_rounding(device: Device) -> str:
    """ "nearest", "toward zero" or "other": how stores to rgba16float round."""
    program = ComputeProgram(device, Path(__file__).parent / "wgsl" / "store_probe.wgsl")
    texture = make_texture(device, (_SIDE, _SIDE), "rgba16float")
    frame = Frame(device)
    size = np.array([_SIDE, _SIDE, 0, 0], np.uint32)
    frame.compute("probe", program, {"size": size, "rounded": texture}, (_SIDE, _SIDE))
    frame.submit()
    stored = download(device, texture)[..., 0].astype(np.float64).ravel()
    exact = 1.0 + np.arange(_SIDE * _SIDE) / 65536.0
    if np.array_equal(stored, exact.astype(np.float16).astype(np.float64)):
        return "nearest"
    down = 1.0 + np.floor((exact - 1.0) * 1024.0) / 1024.0  # halves are 1/1024 apart above 1
    return "toward zero" if np.array_equal(stored, down) else "other"
