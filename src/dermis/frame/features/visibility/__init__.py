"""Visibility: the nearest surface in each pixel of one or more views, as visibility buffer or depth maps."""

from dermis.frame.features.visibility.layers import ViewLayers, draw

__all__ = ["ViewLayers", "draw"]
