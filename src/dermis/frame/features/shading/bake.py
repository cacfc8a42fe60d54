"""The skin as numbers at places of its maps, by the shading of the picture."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import each, program
from dermis.gpu import Bindings, CommandList, Constants, Device, Texture, make_texture

CHANNELS: Mapping[str, int] = MappingProxyType(
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
COUNT = sum(CHANNELS.values())


def baking_numbers() -> dict[str, int]:
    """Numbers that bake.wgsl fills in."""
    return {"baked_numbers": COUNT}


def places_of(triangle: NDArray[np.integer], weights: NDArray[np.floating]) -> NDArray[np.uint32]:
    """(n, 4) words of places as bake.wgsl reads them.

    weights : (n, 2) of the triangle's second and third corner
    """
    words = np.zeros((len(triangle), 4), np.uint32)
    words[:, 0] = triangle
    words[:, 1:3] = weights.astype(np.float32).view(np.uint32)
    return words


def bake(
    device: Device,
    constants: Constants,
    bound: Bindings,
    places: NDArray[np.uint32],
    footprint: float,
    pigments: tuple[float, float] | None,
) -> NDArray[np.float32]:
    """(n, COUNT) numbers of each place, in the order of `baked_numbers`.

    bound : what shading.wgsl and bake.wgsl read of the frame
    footprint : of a texel, as a share of the maps' side
    pigments : shares of melanin and blood of skin that is alike everywhere; None for painted maps
    """
    shader, space = (
        program(device, "shading/bake.wgsl", constants),
        device.space(4 * COUNT * len(places), "baked"),
    )
    given = {"count": len(places), "footprint": footprint, "painted": pigments is None}
    record = shader.record("Baking", **given, everywhere=pigments or (0.0, 0.0))
    listed = device.buffer(places, "STORAGE")
    frame = CommandList(device, timed=False)
    here = {**bound, "baking": record, "places": listed, "baked": space}
    frame.dispatch("bake", shader, here, each(len(places)))
    frame.submit()
    raw = device.handle.queue.read_buffer(space, 0, 4 * COUNT * len(places))
    return np.frombuffer(raw, np.float32).reshape(-1, COUNT).copy()


def no_thickness(device: Device) -> Texture:
    """Placeholder for the map of thickness where nothing measures it."""
    return device.shared("no thickness", lambda: make_texture(device, (1, 1), "rgba32float"))
