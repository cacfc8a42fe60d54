"""Blurs over the atlas: Gaussian levels, their weighted sum, and profiles that a map mixes."""

from dermis.frame.features.diffusion.resources import Resources, make

__all__ = ["Resources", "make"]
