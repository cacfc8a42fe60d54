"""The frame's stages: each a Python file that records it and a WGSL file of the same name."""

from pathlib import Path

STAGES = Path(__file__).parent
SHARED_SHADERS = Path(__file__).parent.parent / "wgsl"
TILE = 16
"""Side of workgroups that do little: smaller ones are done before the H200 has started the next."""
_LEVELS = STAGES / "levels"
SOURCE_SHADERS = {"rgba32float": _LEVELS / "loaded", "rgba16float": _LEVELS / "filtered"}
"""Shaders that read blurred light, by its format."""
STORE_SHADERS = {"rgba32float": _LEVELS / "floats", "rgba16float": _LEVELS / "halves"}
"""Shaders that store it."""
