"""Hair: strands moved by the skin, lit at their knots, drawn over the picture, and their shadows."""

from dermis.frame.features.hair.passes import draw, draw_shadows
from dermis.frame.features.hair.resources import Resources, make
from dermis.frame.features.hair.resources import strand_numbers as shader_numbers

__all__ = ["Resources", "draw", "draw_shadows", "make", "shader_numbers"]
