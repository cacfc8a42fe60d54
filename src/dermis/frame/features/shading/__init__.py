"""Shading of the samples of the picture, and of the surface points of baked maps."""

from dermis.frame.features.shading.bake import shader_constants
from dermis.frame.features.shading.shade import draw

__all__ = ["draw", "shader_constants"]
