"""The atlas as textures: layout, stretch, stitched gutters, and blending of two layouts."""

from dermis.frame.features.atlas.textures import atlas_numbers as shader_numbers

__all__ = ["shader_numbers"]
