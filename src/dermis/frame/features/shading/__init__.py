"""Shading of the samples of the picture, and of the surface points of baked maps."""

from dermis.frame.features.shading.bake import BAKED_CHANNEL_COUNT
from dermis.frame.features.shading.shade import draw
from dermis.mesh.fabric import MM_PER_UV

__all__ = ["draw", "shader_constants"]


def shader_constants() -> dict[str, float]:
    """Return the values that the shader preprocessor inserts at `//#fill` in bake.wgsl and fabric.wgsl."""
    return {"baked_numbers": BAKED_CHANNEL_COUNT, "fabric_mm_per_uv": MM_PER_UV}
