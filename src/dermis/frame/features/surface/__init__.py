"""Surface of the skin: specular lobes, maps from files, painted maps, and properties at atlas texels."""

from collections.abc import Callable, Mapping, Sequence

from dermis.frame.features.surface.painting.paint import painting_constants, painting_shader_lists
from dermis.frame.features.surface.record import eye_constants, lobe_constants, lobe_shaders
from dermis.gpu.wgsl_source import ShaderListMember


def shader_constants() -> Mapping[str, float]:
    """Return the named values that the shader preprocessor inserts into shaders of the surface.

    It inserts them at `//#fill` directives in shaders of specular lobes, eyes, mouths and painted skin.
    """
    return {**lobe_constants(), **eye_constants(), **painting_constants()}


def shader_lists() -> Mapping[str, Callable[[], Sequence[ShaderListMember]]]:
    """Return the lists over which the shader preprocessor loops, such as the list of specular lobes.

    It loops at `//#each` directives.
    """
    return {"lobes": lobe_shaders, **painting_shader_lists()}
