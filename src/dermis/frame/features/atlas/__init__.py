"""Atlas on the device: its layouts, their blend, stretch maps, and gutters that are stitched across seams."""

from dermis.frame.features.atlas.textures import atlas_constants as shader_constants

__all__ = ["shader_constants"]
