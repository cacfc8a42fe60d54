"""The numbers that are baked of each place of the skin, in the order of bake.wgsl."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

CHANNELS: Mapping[str, int] = MappingProxyType(
    {
        "albedo": 3,
        "normal": 3,
        "irradiance": 3,
        "scattered": 3,
        "stretch": 3,
        "roughness": 1,
        "rho_s": 1,
        "reflected": 1,
        "melanin": 1,
        "blood": 1,
        "thickness": 1,
        "curvature": 1,
    }
)
COUNT = sum(CHANNELS.values())


def baking_numbers() -> dict[str, int]:
    """Numbers that bake.wgsl fills in."""
    return {"baked_numbers": COUNT}
