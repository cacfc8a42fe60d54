"""Shading of the picture, sample by sample of the visibility buffer, and of points of the maps."""

from dermis.frame.features.shading.bake import shader_constants
from dermis.frame.features.shading.shade import draw

__all__ = ["draw", "shader_constants"]
