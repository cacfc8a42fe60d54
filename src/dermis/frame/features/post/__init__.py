"""Post-processing of radiance: exposure meter, background, bloom, tone curve and encoding."""

from dermis.frame.features.post import background, meter
from dermis.frame.features.post.resources import Resources, draw, make_resources

__all__ = ["Resources", "draw", "make_resources", "shader_constants"]


def shader_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in these shaders."""
    return meter.shader_constants() | background.shader_constants()
