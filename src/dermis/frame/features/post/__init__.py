"""Post-processing of radiance: exposure meter, background, bloom, tone curve and encoding."""

from dermis.frame.features.post.meter import shader_constants
from dermis.frame.features.post.resources import Resources, draw, make_resources

__all__ = ["Resources", "draw", "make_resources", "shader_constants"]
