"""Shadow maps: one layer for each light that casts shadows [Williams1978]."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.features.visibility.layers import Layers, draw_layers, make_layers
from dermis.frame.programs import program
from dermis.frame.projection import Views
from dermis.gpu import Bindings, Device, Recorder, Texture, make_texture
from dermis.gpu.memory import check_memory

SHADOW_BYTES = 4


@dataclass(frozen=True, eq=False)
class ShadowMaps:
    """A depth layer for each light.

    bounds : texture of the nearest depths in ever larger squares of each layer, for area lights
    """

    layers: Layers
    bounds: Texture

    @property
    def texture(self) -> Texture:
        """Depth from each light: 1 near, 0 nothing."""
        return self.layers.texture


def make_shadow_maps(device: Device, layers: int, size: int) -> ShadowMaps:
    """Empty maps, `size` texels a side.

    Raises DermisError when they do not fit into memory.
    """
    needed = SHADOW_BYTES * layers * size**2
    check_memory(device, needed, "shadow_size", f"{layers} maps of {size} texels")
    side = _squares(size)
    bounds = make_texture(device, (side + side // 2, side), "r32float", layers=max(2, layers))
    return ShadowMaps(make_layers(device, (size, size), layers, triangles=False), bounds)


def draw(graph: Recorder, maps: ShadowMaps, views: Views, head: HeadResources, bounded: bool = True) -> None:
    """Draw the depth that each light sees.

    bounded : whether there are area lights, which read the bounds
    """
    if not len(views.clips):
        return
    draw_layers(graph, "shadows", maps.layers, views, head)
    if bounded:
        bound: Bindings = {
            "maps": maps.texture,
            "maps_sampler": graph.device.sampler(),
            "bounds": maps.bounds,
        }
        groups = _squares(maps.layers.size[0]) // 16
        shader = program(graph.device, "shadows/shadow_bounds.wgsl")
        graph.dispatch("shadows", shader, bound, (groups, groups, len(views.clips)))


def _squares(size: int) -> int:
    """Number of squares of 4 texels along a side of the map, rounded up to whole squares of 64."""
    return 16 * -(-size // 64)
