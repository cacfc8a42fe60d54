"""The thin parts of a head: their translucent pairs, and space for the light that passes between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.cached import cached_pairs, pairs_key
from dermis.frame.atlas_layout import PairBuffers, Translucency
from dermis.frame.passes.translucency_weights import source_level, upload_pairs, weigh
from dermis.gpu import Device, Memo, scratch
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
_WIDTHS_TO_DOUBLE, _LEAST_SHARED_MM = 2, 0.5


def translucency_of(
    memo: Memo,
    device: Device,
    head: Head,
    atlas: Atlas,
    variance_mm2: Floats,
    weight: Floats,
    changing: bool,
    of: str,
) -> Translucency:
    """Light through a head's thin parts, on an atlas.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    changing : whether profiles change too often for their weights to be worth keeping on disk
    of : name of the atlas among several
    """
    widest = float(np.sqrt(variance_mm2[-1]))
    widest = shared_width(widest) if changing else widest
    pairs = memo.meanwhile(
        device.executor, pairs_of, device, head.mesh, atlas, widest, changing, alike=(head, atlas), of=of
    )
    return memo.keep(translucency_from, device, pairs, variance_mm2, weight, of=of)


def shared_width(widest_mm: float) -> float:
    """The width rounded to one of a few [mm], so that similar skins share their pairs."""
    step = round(_WIDTHS_TO_DOUBLE * float(np.log2(max(widest_mm, _LEAST_SHARED_MM))))
    return float(2.0 ** (step / _WIDTHS_TO_DOUBLE))


def pairs_of(device: Device, mesh: Mesh, atlas: Atlas, widest_mm: float, changing: bool) -> PairBuffers:
    """The translucent pairs of a mesh, searched for or read from disk.

    widest_mm : standard deviation of the widest Gaussian [mm]
    """
    key = "" if changing else pairs_key(mesh, atlas, widest_mm)
    return upload_pairs(device, cached_pairs(mesh, atlas, widest_mm), key)


def translucency_from(
    device: Device, pairs: PairBuffers, variance_mm2: Floats, weight: Floats
) -> Translucency:
    """A profile's weights of the pairs, and buffers for the light."""
    gathered = scratch(device, device.buffer(np.zeros((pairs.source_count, 2), np.uint32), "STORAGE"))
    weights = weigh(device, pairs, variance_mm2, weight)
    return Translucency(pairs, weights, source_level(pairs, variance_mm2), gathered)
