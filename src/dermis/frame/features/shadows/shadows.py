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
    bounds : texture of the nearest depth in each square block of a map, for several block sizes; with
        it, the shadows of area lights are computed without searching blocks that hold no occluders
    """

    layers: ViewLayers
    bounds: Texture

    @property
    def texture(self) -> Texture:
        """Return the texture array of shadow maps: z-buffer depths as seen from each light.

        A depth is 1 at the near plane, and 0 at the far plane and where there is no surface.
        """
        return self.layers.texture


def make_shadow_maps(device: Device, layer_count: int, map_side: int) -> ShadowMaps:
    """Allocate `layer_count` empty square shadow maps of `map_side` texels per side.

    Raises DermisError when the maps do not fit into memory.
    """
    needed = SHADOW_TEXEL_BYTES * layer_count * map_side**2
    check_memory(device, needed, "shadow_size", f"{layer_count} maps of {map_side} texels")
    side = _squares_per_side(map_side)
    bounds = make_texture(device, (side + side // 2, side), "r32float", layer_count=max(2, layer_count))
    return ShadowMaps(make_layers(device, (map_side, map_side), layer_count, store_triangles=False), bounds)


def draw(
    graph: Recorder, shadow_maps: ShadowMaps, views: Views, head: HeadGeometry, with_depth_bounds: bool = True
) -> None:
    """Declare the passes that draw the depth of the head as seen from each light.

    with_depth_bounds : whether to fill `ShadowMaps.bounds` too, which is needed only for area lights
    """
    if not len(views.clips):
        return
    draw_layers(graph, "shadows", shadow_maps.layers, views, head)
    if with_depth_bounds:
        bound: Bindings = {
            "maps": shadow_maps.texture,
            "maps_sampler": graph.device.sampler(),
            "bounds": shadow_maps.bounds,
        }
        groups = _squares_per_side(shadow_maps.layers.size[0]) // 16
        shader = program(graph.device, "shadows/shadow_bounds.wgsl")
        graph.dispatch("shadows", shader, bound, (groups, groups, len(views.clips)))


def _squares_per_side(map_side: int) -> int:
    """Return the number of squares of 4 x 4 texels along a side of a shadow map.

    The number is rounded up to a multiple of 16.
    """
    return 16 * -(-map_side // 64)
