"""The thin parts of a head: which places lie opposite each other, and space for what passes between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import Atlas
from dermis.assets.cache import cached_links, links_key
from dermis.assets.mesh import Mesh
from dermis.gpu import Device
from dermis.rendering.stages.opposite import Opposite, Pairs, source_level, upload_pairs
from dermis.rendering.stages.transmission import Thin
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
_WITH_TRANSMISSION = ("texture-space", "published")
_WIDTHS_TO_DOUBLE, _LEAST_SHARED_MM = 2, 0.5


def lets_through(settings: Settings) -> bool:
    """Whether light comes through thin parts."""
    return settings.transmission == "thin" and settings.technique in _WITH_TRANSMISSION


def shared_width(widest_mm: float) -> float:
    """The nearest of a few widths [mm]: skins that differ little share what lies opposite."""
    step = round(_WIDTHS_TO_DOUBLE * float(np.log2(max(widest_mm, _LEAST_SHARED_MM))))
    return float(2.0 ** (step / _WIDTHS_TO_DOUBLE))


def pairs_of(device: Device, mesh: Mesh, atlas: Atlas, widest_mm: float, *, changing: bool) -> Pairs:
    """The places that lie opposite each other, made or read from disk.

    widest_mm : standard deviation of the widest Gaussian [mm]
    changing : whether profiles come and go, so that it is not worth while to keep what each lets pass
    """
    key = "" if changing else links_key(mesh, atlas, widest_mm)
    return upload_pairs(device, cached_links(mesh, atlas, widest_mm), key)


def thin_of(device: Device, stage: Opposite, pairs: Pairs, variance_mm2: Floats, weight: Floats) -> Thin:
    """What a profile lets pass between pairs, and space for it.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    """
    gathered = device.buffer(np.zeros((pairs.source_count, 2), np.uint32), "STORAGE")
    links = stage.weigh(pairs, variance_mm2, weight)
    return Thin(pairs, links, source_level(pairs, variance_mm2), gathered)
