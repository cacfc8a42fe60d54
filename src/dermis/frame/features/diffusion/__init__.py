"""Diffusion of light over the atlas: a pyramid of Gaussian blurs, its weighted sum, and blended profiles."""

from dermis.frame.features.diffusion.resources import Resources, make

__all__ = ["Resources", "make"]
