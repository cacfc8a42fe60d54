"""Atlas on the device: layouts, stretch maps, gutters that are stitched across seams, and blended layouts."""

from dermis.frame.features.atlas.textures import atlas_constants as shader_constants

__all__ = ["shader_constants"]
