"""The words for the surface's models; apart, so that a command's help needs no numbers."""

from __future__ import annotations

from typing import Literal

ModelName = Literal[
    "kelemen",
    "torrance-sparrow",
    "torrance-sparrow-smith",
    "blinn-phong",
    "blinn-phong-plain",
    "phong",
    "phong-plain",
    "two-lobe",
    "kelemen-direct",
]
SpecularName = Literal[ModelName, "none"]
FresnelName = Literal["schlick", "exact"]
EnergyName = Literal["none", "published", "full"]
