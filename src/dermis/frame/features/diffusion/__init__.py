"""Diffusion of light over the atlas: a pyramid of Gaussian blurs, its weighted sum, and blended profiles."""

from dermis.frame.features.diffusion.resources import Resources, make_resources

__all__ = ["Resources", "make_resources"]
