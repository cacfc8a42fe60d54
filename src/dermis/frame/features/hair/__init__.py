"""Hair: strands that move with the skin, cast shadows, and are shaded and drawn over the picture."""

from dermis.frame.features.hair.passes import draw, draw_guides, draw_shadows
from dermis.frame.features.hair.resources import Resources, make_resources
from dermis.frame.features.hair.resources import shader_constants as _resource_constants
from dermis.frame.features.hair.swing import swing_constants

__all__ = ["Resources", "draw", "draw_guides", "draw_shadows", "make_resources", "shader_constants"]


def shader_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in the hair shaders."""
    return {**_resource_constants(), **swing_constants()}
