"""Which share of the sky each place of the surface sees; baked once for a mesh and an atlas."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.geometry import HeadTextures
from dermis.frame.passes import SHARED_SHADERS, STAGES
from dermis.frame.passes.visibility_buffer import Nearest
from dermis.frame.projection import ShadowView, parallel_view, shadow_layers
from dermis.gpu import ComputeProgram, Device, Frame
from dermis.gpu.program import Resources
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
DIRECTIONS = 128
MAP_SIZE = 512
FORM = f"1 {DIRECTIONS} {MAP_SIZE}"
"""Differs when baking gives other results."""
_BATCH = 32  # depth maps at a time


class Occlusion:
    """Sees the mesh from all around and counts where each place is in sight.

    The shader is compiled when it is first wanted: most frames have no environment.
    """

    def __init__(self, device: Device, directions: int = DIRECTIONS, map_size: int = MAP_SIZE) -> None:
        self._device, self._map_size = device, map_size
        self._towards = fibonacci_sphere(directions)
        self._nearest = Nearest(device, triangles=False)
        self._program = ComputeProgram(device, STAGES / "occlusion.wgsl", (SHARED_SHADERS,))

    def bake(
        self, mesh: Mesh, head: HeadTextures, lit: Resources, atlas: Any, side: int
    ) -> NDArray[np.float32]:
        """(rows, side) open share of the sky, weighted by the cosine, 0 to 1; NaN where there is no surface.

        lit : what the lighting passes read
        atlas : texture of texels, of which side x side are baked, then the vertices, row by row
        """
        rows = side - (-len(mesh.positions) // side)
        sums = self._device.buffer(np.zeros((rows, side, 2), np.float32), "STORAGE")
        layers = self._nearest.make_layers((self._map_size, self._map_size), _BATCH)
        frame = Frame(self._device)
        for first in range(0, len(self._towards), _BATCH):
            views = [parallel_view(-d, mesh, self._map_size) for d in self._towards[first : first + _BATCH]]
            self._nearest.draw(frame, "occlusion", layers, shadow_layers(views), head)
            sky = self._program.record("Sky", directions=len(views), side=side, vertices=len(mesh.positions))
            bound = {
                **lit,
                "lights": self._lights(views),
                "shadow_maps": layers.texture,
                "sky": sky,
                "atlas": atlas,
                "open": sums,
            }
            frame.compute("occlusion", self._program, bound, (side, rows))
        frame.submit()
        raw = np.frombuffer(self._device.handle.queue.read_buffer(sums), np.float32).reshape(rows, side, 2)
        with np.errstate(invalid="ignore"):
            return np.asarray(raw[..., 0] / raw[..., 1])

    def _lights(self, views: list[ShadowView]) -> Any:
        record = self._program.record("Lights")
        for layer, view in enumerate(views):
            light = record["light"][layer]
            light["parallel"], light["layer"], light["half_width"] = 1, layer, 1
            light["direction"] = np.cross(view.up, view.right)
            light["to_map"], light["texel"] = view.clip.T, view.texel
        return record


def fibonacci_sphere(count: int) -> Floats:
    """(count, 3) unit vectors, each for an equal share of the sphere [Keinert2015]."""
    index = np.arange(count) + 0.5
    y = 1.0 - 2.0 * index / count
    phi = np.pi * (1.0 + np.sqrt(5.0)) * index
    r = np.sqrt(1.0 - y**2)
    return np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=-1)


def whole_map(baked: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """The baked rows as the shader reads them: the atlas without gaps, its last row again, the vertices.

    baked : (rows, side), NaN where there is no surface
    """
    from scipy.ndimage import distance_transform_edt

    texels = baked[:side]
    empty = np.isnan(texels)
    if not empty.all():
        nearest = distance_transform_edt(empty, return_distances=False, return_indices=True)
        texels = texels[tuple(nearest)]
    return np.nan_to_num(np.vstack([texels, texels[-1:], baked[side:]]), nan=1.0)
