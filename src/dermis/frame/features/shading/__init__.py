"""The image: every sample of the visibility buffer shaded, and the same at places of the maps."""

from dermis.frame.features.shading.bake import baking_numbers as shader_numbers
from dermis.frame.features.shading.shade import draw

__all__ = ["draw", "shader_numbers"]
