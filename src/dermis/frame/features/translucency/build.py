"""Translucency of a head: pairs of places by their reach, and tables of what passes by thickness."""

from __future__ import annotations

from dataclasses import replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.translucency.cells import Cells, divide
from dermis.base.progress import preparing
from dermis.frame.features.diffusion.pyramid import LEAST_WEIGHT
from dermis.frame.features.surface import record as surface
from dermis.frame.features.translucency.pair_search.search import (
    CellTables,
    Found,
    cell_tables,
    search,
    upload_receivers,
    upload_sources,
)
from dermis.frame.features.translucency.passes import (
    RECEIVER_BYTES,
    SOURCE_BYTES,
    source_level,
    space,
    weighing,
)
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.request import FrameRequest
from dermis.gpu import Bindings, Device, Memo, Texture, make_texture, scratch, upload
from dermis.optics.flesh import medium_of
from dermis.optics.gaussians import GaussianSum
from dermis.optics.thin_parts import ThinParts, thin_parts

Floats = NDArray[np.float64]
_REACH, _FARTHEST_MM = 4.0, 40.0  # standard deviations of the widest Gaussian, beyond all pairs
_WIDTHS_TO_DOUBLE, _LEAST_SHARED_MM = 2, 0.5
_WIDTHS = 4  # whose pairs are kept
_ONE = np.array([0xFE000, 0x3F8FE000], np.uint32)  # white light of 1, as packed_light.wgsl has it
_COARSER = 1.5  # times the side of cells whose pairs memory does not hold


def thin_tables(memo: Memo, request: FrameRequest) -> ThinParts | None:
    """What passes thin parts of half-spaces, for the blurred levels; None for lambertian skin."""
    if request.skin.direction != "half-space":
        return None
    split, law = request.split, surface.half_space_of(request.skin, request.head.maps, request.profile)
    g = request.skin.anisotropy
    return memo.keep(_made, request.profile, *law, g, split.total, split.blurred_mm2, split.weight)


def _made(
    profile: GaussianSum,
    colour: Floats,
    eta: float,
    g: float,
    total: Floats,
    variance_mm2: Floats,
    weight: Floats,
) -> ThinParts:
    """Tables as weights of the blurred levels, which alone lose what passes: no more than they have."""
    reach = min(_REACH * float(np.sqrt(variance_mm2[-1])), _FARTHEST_MM)
    made = thin_parts(medium_of(profile, colour, eta), variance_mm2, reach, g)
    blurred = weight.sum(axis=0) / np.maximum(total, LEAST_WEIGHT)
    share = np.minimum(1.0, blurred / np.maximum(made.lost.sum(axis=1), LEAST_WEIGHT))[:, None]
    lost = made.lost * share / np.maximum(blurred, LEAST_WEIGHT)
    return replace(made, through=made.through * share * total, lost=lost)


def translucency_of(
    memo: Memo,
    device: Device,
    surface: Bindings,
    at_rest: Bindings,
    atlas: Atlas,
    variance_mm2: Floats,
    weight: Floats,
    thin: ThinParts | None,
    changing: bool,
    of: str,
) -> Translucency:
    """What comes through a head's thin parts, on an atlas.

    surface, at_rest : resources of geometry.wgsl and of the atlas, as the head is now and for the search
    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    thin : tables of what passes by thickness; None for Gaussians of the straight distance
    changing : whether profiles come and go, so that similar ones should share their pairs
    of : name of the atlas among several
    """
    widest = float(np.sqrt(variance_mm2[-1]))
    widest = shared_width(widest) if changing else widest
    pairs = memo.keep(PairsByWidth, device, at_rest, atlas, of=of).of(widest)
    made = memo.keep(_unweighed, device, surface, pairs, of=of)
    return memo.keep(_weighed, device, made, variance_mm2, weight, thin, of=of)


class PairsByWidth:
    """Pairs of a surface, kept for a few widths of skins that come in turn.

    surface : resources of geometry.wgsl and of the atlas, for the search
    """

    def __init__(self, device: Device, surface: Bindings, atlas: Atlas) -> None:
        self._device, self._surface, self._atlas = device, surface, atlas
        self._kept: dict[float, PairBuffers] = {}

    def of(self, widest_mm: float) -> PairBuffers:
        """Those that Gaussians of at most this standard deviation reach."""
        made = self._kept.pop(widest_mm, None)
        if made is None:
            while len(self._kept) >= _WIDTHS:
                self._kept.pop(next(iter(self._kept)))
            cells = divide(self._atlas, widest_mm)
            tables = cell_tables(self._device, cells)
            made = find_pairs(self._device, self._surface, self._atlas, cells, tables)
        self._kept[widest_mm] = made
        return made


def shared_width(widest_mm: float) -> float:
    """The nearest of a few widths [mm]: similar skins share their pairs."""
    step = round(_WIDTHS_TO_DOUBLE * float(np.log2(max(widest_mm, _LEAST_SHARED_MM))))
    return float(2.0 ** (step / _WIDTHS_TO_DOUBLE))


@preparing("finding the thin parts")
def find_pairs(
    device: Device, surface: Bindings, atlas: Atlas, cells: Cells, tables: CellTables
) -> PairBuffers:
    """The translucent pairs of a surface; of coarser cells where memory does not hold those of these."""
    found, times = search(device, surface, cells, tables), count(1)
    while found is None:
        cells = divide(atlas, cells.widest_mm, _COARSER ** next(times))
        found = search(device, surface, cells, cell_tables(device, cells))
    return pairs_from(device, cells, found)


def pairs_from(device: Device, cells: Cells, found: Found) -> PairBuffers:
    """Pairs that were found, as the frame's passes read them."""
    return PairBuffers(
        cells=cells,
        receivers=upload_receivers(device, cells, found.receiver),
        sources=upload_sources(device, cells, found.source),
        pairs=found.pairs,
        count=int(found.first[-1]),
        sums=device.buffer(_sums(cells, found), "STORAGE"),
        light=mark_scratch(device, _unlit(device, cells.surface)),
        lost=_unlit(device, cells.surface),
    )


def _sums(cells: Cells, found: Found) -> NDArray[np.uint32]:
    """(m, 3) cell, x and y packed, where its pairs begin, and where they end; one without pairs for none.

    Those with most pairs come first: invocations that run side by side, and workgroups that are left for the
    end, then have little to wait for.
    """
    first, end = found.first[:-1], found.first[1:]
    order = np.argsort(first - end, kind="stable")
    listed = np.stack([cells.taking[found.receiver], first, end], axis=-1)[order].astype(np.uint32)
    return listed if len(listed) else np.zeros((1, 3), np.uint32)


def _unlit(device: Device, surface: NDArray[np.bool_]) -> Texture:
    light = np.zeros((*surface.shape, 4), np.float32)
    light[..., 3] = surface
    texture = make_texture(device, surface.shape, "rgba32float")
    upload(device, texture, light)
    return texture


def translucency_from(
    device: Device,
    surface: Bindings,
    pairs: PairBuffers,
    variance_mm2: Floats,
    weight: Floats,
    thin: ThinParts | None = None,
) -> Translucency:
    """What a profile lets pass between pairs, and space for it."""
    return _weighed(device, _unweighed(device, surface, pairs), variance_mm2, weight, thin)


def _weighed(
    device: Device, made: Translucency, variance_mm2: Floats, weight: Floats, thin: ThinParts | None
) -> Translucency:
    share = weight / np.maximum(weight.sum(axis=0), LEAST_WEIGHT)
    passing = weight if thin is None else thin.through
    losing = share if thin is None else thin.lost
    return replace(
        made,
        weighing=weighing(device, made.pairs, variance_mm2, weight, thin, passing),
        losing=weighing(device, made.pairs, variance_mm2, share, thin, losing),
        gaussians=len(weight),
        slabs=thin is not None,
        layer=source_level(made.pairs.cells.spacing_mm, variance_mm2),
    )


def _unweighed(device: Device, surface: Bindings, pairs: PairBuffers) -> Translucency:
    receivers, sources = pairs.receivers[1], pairs.sources[1]
    return Translucency(
        pairs=pairs,
        surface=surface,
        receiver_points=mark_scratch(device, space(device, receivers, RECEIVER_BYTES)),
        source_points=space(device, sources, SOURCE_BYTES),
        weights=space(device, pairs.count, 8),
        gathered=mark_scratch(device, space(device, sources, 16)),
        slants=mark_scratch(device, space(device, sources, 8)),
        evenly=device.buffer(np.tile(_ONE, (max(sources, 1), 2)), "STORAGE"),
    )
