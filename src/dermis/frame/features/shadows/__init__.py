"""Shadow maps: one layer for each light that casts shadows."""

from dermis.frame.features.shadows.shadows import ShadowMaps, draw

__all__ = ["ShadowMaps", "draw"]
