"""Ambient occlusion: the open share of the sky, baked for a head at rest and updated as it moves."""

from dermis.frame.features.occlusion.moving import Sky, draw

__all__ = ["Sky", "draw"]
