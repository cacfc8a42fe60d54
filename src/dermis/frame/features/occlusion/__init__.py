"""Ambient occlusion: the visible fraction of the sky, baked for a head at rest and updated as it moves."""

from dermis.frame.features.occlusion.moving import VertexSkyVisibility, draw

__all__ = ["VertexSkyVisibility", "draw"]
