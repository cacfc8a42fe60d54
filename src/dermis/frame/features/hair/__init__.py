"""Hair: strands that follow the skin, cast shadows, are shaded at their knots and drawn over the picture."""

from dermis.frame.features.hair.passes import draw, draw_shadows
from dermis.frame.features.hair.resources import Resources, make, shader_constants

__all__ = ["Resources", "draw", "draw_shadows", "make", "shader_constants"]
