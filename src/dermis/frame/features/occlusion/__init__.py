"""Ambient occlusion: the visible fraction of the sky, baked for a head at rest and updated as it moves."""

from dermis.frame.features.occlusion.moving import VertexSky, draw

__all__ = ["VertexSky", "draw"]
