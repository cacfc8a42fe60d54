"""Hair: strands that move with the skin, cast shadows, and are shaded and drawn over the picture."""

from dermis.frame.features.hair.passes import draw, draw_shadows
from dermis.frame.features.hair.resources import Resources, make_resources, shader_constants

__all__ = ["Resources", "draw", "draw_shadows", "make_resources", "shader_constants"]
