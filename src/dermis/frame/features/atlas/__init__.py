"""Atlas on the device: layout, stretch maps, stitched gutters, and blending of two layouts."""

from dermis.frame.features.atlas.textures import atlas_constants as shader_constants

__all__ = ["shader_constants"]
