"""Interreflection: light that leaves skin, crosses the air and meets skin again."""

from dermis.frame.features.interreflection.interreflection import Interreflection, draw, shader_constants

__all__ = ["Interreflection", "draw", "shader_constants"]
