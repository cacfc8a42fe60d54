"""The surface of the skin: its numbers, maps and lobe, painted maps, and the surface at the atlas' texels."""

from collections.abc import Callable, Mapping, Sequence

from dermis.frame.features.surface.painting.paint import painting_numbers, texture_names
from dermis.frame.features.surface.record import eye_numbers, lobe_shaders, surface_numbers
from dermis.gpu.wgsl_source import Member


def shader_numbers() -> Mapping[str, float]:
    """Return the numbers that the shaders of lobes, eyes, mouths and painted skin fill in."""
    return {**surface_numbers(), **eye_numbers(), **painting_numbers()}


def shader_lists() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """Return the lobes, and the textures of painted skin."""
    return {"lobes": lobe_shaders, **texture_names()}
