"""Fabric: weave, relief and sheen of cloth, which the shading pass evaluates procedurally."""

from __future__ import annotations

from typing import Literal, NamedTuple

Weave = Literal["jersey", "plain", "twill", "rib"]
WEAVES: tuple[Weave, ...] = ("jersey", "plain", "twill", "rib")
"""Weaves and knits, in the order of their numbers in fabric.wgsl."""

MM_PER_UV = 1000.0
"""Length on the cloth per unit of uv [mm]."""


class Fabric(NamedTuple):
    """Parameters of procedural cloth.

    weave : structure of the cloth
    thread_mm : distance between threads, stitches or ribs [mm]
    relief : slope of the threads' relief [-]
    contrast : relative difference of brightness between the two directions of threads [-]
    sheen : strength of the scattering by upright fibres at grazing angles, [EstevezKulla2017] [-]
    crumple : slope of small wrinkles that are finer than the mesh [-]
    """

    weave: Weave
    thread_mm: float
    relief: float
    contrast: float
    sheen: float
    crumple: float
