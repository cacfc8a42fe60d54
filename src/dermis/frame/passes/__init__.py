"""The frame's stages: each a Python file that records it and a WGSL file of the same name."""

from pathlib import Path

from dermis.frame.lights import light_numbers
from dermis.frame.lights.kind import light_shaders
from dermis.frame.surface import lobe_shaders, surface_numbers
from dermis.gpu.wgsl_source import ShaderFolder

STAGES = Path(__file__).parent
SHARED_SHADERS = ShaderFolder(
    STAGES.parent / "wgsl",
    lists={"lights": light_shaders, "lobes": lobe_shaders},
    numbers=lambda: {**light_numbers(), **surface_numbers()},
)
TILE = 16
"""Side of workgroups that do little: smaller ones are done before the H200 has started the next."""
_LEVELS = STAGES / "levels"
SOURCE_SHADERS = {"rgba32float": _LEVELS / "loaded", "rgba16float": _LEVELS / "filtered"}
"""Shaders that read blurred light, by its format."""
STORE_SHADERS = {"rgba32float": _LEVELS / "floats", "rgba16float": _LEVELS / "halves"}
"""Shaders that store it."""
