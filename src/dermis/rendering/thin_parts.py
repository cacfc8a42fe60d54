"""What lies opposite the thin parts of a head, made or read from disk."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import Atlas
from dermis.assets.cache import cached_opposite
from dermis.assets.mesh import Mesh
from dermis.gpu import Device, download
from dermis.gpu.textures import texture_from
from dermis.rendering.layout import Layout
from dermis.rendering.stages.opposite import FORM, Opposite
from dermis.scene.settings import Settings

_WITH_TRANSMISSION = ("texture-space", "published")
_FINEST_SIDE = 1024  # texels: what comes through half a millimetre and more is smooth


def lets_through(settings: Settings) -> bool:
    """Whether light comes through thin parts."""
    return settings.transmission == "thin" and settings.technique in _WITH_TRANSMISSION


def opposite_map(
    device: Device, stage: Opposite, mesh: Mesh, atlas: Atlas, layout: Layout, widest_mm: float
) -> Any:
    """The texture that `Opposite.find` makes, of at most 1024 texels a side.

    widest_mm : standard deviation of the widest Gaussian [mm]
    """
    side = min(atlas.size, _FINEST_SIDE)

    def find() -> NDArray[np.uint32]:
        texels = layout.atlas.resources["atlas"]
        found: NDArray[np.uint32] = download(device, stage.find(mesh, layout.lit, texels, side, widest_mm))
        return found

    form = f"{FORM} {side} {widest_mm!r}"
    return texture_from(device, cached_opposite(mesh, atlas, form, find), "rgba32uint")
