"""Light from skin to skin through the air."""

from dermis.frame.features.interreflection.interreflection import Interreflection, draw
from dermis.frame.features.interreflection.interreflection import link_numbers as shader_numbers

__all__ = ["Interreflection", "draw", "shader_numbers"]
