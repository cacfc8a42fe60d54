"""Surface of the skin: specular lobe, maps from files, painted maps, and the surface at atlas texels."""

from collections.abc import Callable, Mapping, Sequence

from dermis.frame.features.surface.painting.paint import painting_constants, texture_names
from dermis.frame.features.surface.record import eye_constants, lobe_constants, lobe_shaders
from dermis.gpu.wgsl_source import ShaderListMember


def shader_constants() -> Mapping[str, float]:
    """Return the values that `//#fill` lines insert in shaders of lobes, eyes, mouths and painted skin."""
    return {**lobe_constants(), **eye_constants(), **painting_constants()}


def shader_lists() -> Mapping[str, Callable[[], Sequence[ShaderListMember]]]:
    """Return the names of lobes and of layers of painted skin, which `//#each` lines of shaders expand."""
    return {"lobes": lobe_shaders, **texture_names()}
