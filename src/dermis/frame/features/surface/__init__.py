"""Surface of the skin: specular lobe, maps, painted maps, and the surface at the texels of the atlas."""

from collections.abc import Callable, Mapping, Sequence

from dermis.frame.features.surface.painting.paint import painting_constants, texture_names
from dermis.frame.features.surface.record import eye_constants, lobe_constants, lobe_shaders
from dermis.gpu.wgsl_source import Member


def shader_constants() -> Mapping[str, float]:
    """Return the constants of shaders of lobes, eyes, mouths and painted skin by their `//#fill` names."""
    return {**lobe_constants(), **eye_constants(), **painting_constants()}


def shader_lists() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """Return the lists that shaders of lobes and painted skin expand with `//#each`."""
    return {"lobes": lobe_shaders, **texture_names()}
