"""Atlas on the device: its textures, stretch maps and gutters, and the blend of two atlas layouts."""

from dermis.frame.features.atlas.textures import atlas_constants as shader_constants

__all__ = ["shader_constants"]
