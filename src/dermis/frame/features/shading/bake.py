"""Properties and light of the skin at texels of baked maps, computed by the same code as the picture."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Bindings, CommandList, Constants, Device, Texture, make_texture

BAKED_CHANNELS: Mapping[str, int] = MappingProxyType(
    {
        "albedo": 3,
        "normal": 3,
        "irradiance": 3,
        "scattered": 3,
        "stretch": 3,
        "roughness": 1,
        "rho_s": 1,
        "reflected": 1,
        "melanin": 1,
        "blood": 1,
        "thickness": 1,
        "curvature": 1,
    }
)
"""Number of channels of each quantity that bake.wgsl computes at a point, in the order of its results."""
BAKED_CHANNEL_COUNT = sum(BAKED_CHANNELS.values())


def bake_point_words(
    triangle_index: NDArray[np.integer], weights: NDArray[np.floating]
) -> NDArray[np.uint32]:
    """Pack surface points into (n, 4) words for bake.wgsl.

    triangle_index : (n,) indices of the triangles on which the points lie
    weights : (n, 2) barycentric weights of the second and third corner
    """
    words = np.zeros((len(triangle_index), 4), np.uint32)
    words[:, 0] = triangle_index
    words[:, 1:3] = weights.astype(np.float32).view(np.uint32)
    return words


def bake(
    device: Device,
    constants: Constants,
    bindings: Bindings,
    packed_points: NDArray[np.uint32],
    texel_side_uv: float,
    pigments: tuple[float, float] | None,
) -> NDArray[np.float32]:
    """Return (n, BAKED_CHANNEL_COUNT) properties and light of the skin at n surface points.

    `BAKED_CHANNELS` names the columns of the result.

    constants : pipeline constants of the shading
    bindings : resources of the frame that shading.wgsl and bake.wgsl read
    packed_points : (n, 4) packed surface points, from `bake_point_words`
    texel_side_uv : side of a texel in uv, which is 1 divided by the side of the map in texels [-]
    pigments : melanin and blood fractions of uniform skin [-]; None to read them from painted maps
    """
    shader = program(device, "shading/bake.wgsl", constants)
    count, size = len(packed_points), 4 * BAKED_CHANNEL_COUNT * len(packed_points)
    baked = device.storage_buffer(size, "baked")
    uniform = pigments or (0.0, 0.0)
    record = shader.make_record(
        "Baking", count=count, footprint=texel_side_uv, painted=pigments is None, uniform_pigments=uniform
    )
    own: Bindings = {"baking": record, "points": device.buffer(packed_points, "STORAGE"), "baked": baked}
    commands = CommandList(device, timed=False)
    commands.dispatch("bake", shader, {**bindings, **own}, workgroup_grid(count))
    commands.submit()
    raw = device.handle.queue.read_buffer(baked, 0, size)
    return np.frombuffer(raw, np.float32).reshape(-1, BAKED_CHANNEL_COUNT).copy()


def placeholder_thickness(device: Device) -> Texture:
    """Return a 1 x 1 placeholder for the map of tissue thickness."""
    return device.cached("no thickness", lambda: make_texture(device, (1, 1), "rgba32float"))
