"""Shadow maps: one layer for each light that casts shadows [Williams1978]."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.visibility.layers import ViewLayers, draw_layers, make_layers
from dermis.frame.programs import program
from dermis.frame.projection import Views
from dermis.gpu import Bindings, Device, Recorder, Texture, make_texture
from dermis.gpu.memory import check_memory

SHADOW_TEXEL_BYTES = 4
"""Size of a texel of a shadow map [bytes]."""


@dataclass(frozen=True, eq=False)
class ShadowMaps:
    """Shadow maps of all lights.

    layers : depth map of each light
    bounds : texture of the nearest depth in squares of each map, for several sizes of squares; area lights
        read it to skip squares without occluders
    """

    layers: ViewLayers
    bounds: Texture

    @property
    def texture(self) -> Texture:
        """Return the texture of z-buffer depths seen from each light, 1 near and 0 empty."""
        return self.layers.texture


def make_shadow_maps(device: Device, layers: int, size: int) -> ShadowMaps:
    """Allocate `layers` empty shadow maps of size x size texels.

    Raises DermisError when the maps do not fit into memory.
    """
    needed = SHADOW_TEXEL_BYTES * layers * size**2
    check_memory(device, needed, "shadow_size", f"{layers} maps of {size} texels")
    side = _square_count(size)
    bounds = make_texture(device, (side + side // 2, side), "r32float", layer_count=max(2, layers))
    return ShadowMaps(make_layers(device, (size, size), layers, triangles=False), bounds)


def draw(
    graph: Recorder, maps: ShadowMaps, views: Views, head: HeadGeometry, with_bounds: bool = True
) -> None:
    """Declare the passes that draw the depths seen from each light.

    with_bounds : whether the scene has area lights, which read the bounds
    """
    if not len(views.clips):
        return
    draw_layers(graph, "shadows", maps.layers, views, head)
    if with_bounds:
        bound: Bindings = {
            "maps": maps.texture,
            "maps_sampler": graph.device.sampler(),
            "bounds": maps.bounds,
        }
        groups = _square_count(maps.layers.size[0]) // 16
        shader = program(graph.device, "shadows/shadow_bounds.wgsl")
        graph.dispatch("shadows", shader, bound, (groups, groups, len(views.clips)))


def _square_count(size: int) -> int:
    """Return the number of squares of 4 x 4 texels along a shadow map, rounded up to a multiple of 16."""
    return 16 * -(-size // 64)
