"""Ambient occlusion: visible fraction of the sky, baked for a head at rest and updated when it moves."""

from dermis.frame.features.occlusion.moving import VertexSky, draw

__all__ = ["VertexSky", "draw"]
