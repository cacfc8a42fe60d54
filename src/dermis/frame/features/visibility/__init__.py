"""The nearest surface in each pixel of one or more views: a visibility buffer or depth maps."""

from dermis.frame.features.visibility.layers import Layers, draw

__all__ = ["Layers", "draw"]
