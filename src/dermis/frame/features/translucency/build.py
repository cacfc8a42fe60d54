"""Creation of the resources of translucency, the light that passes through thin parts of the head."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from itertools import count

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.translucency.cells import Cells, divide_into_cells
from dermis.base.progress import logged_step
from dermis.frame.features.diffusion.pyramid import MIN_WEIGHT_SUM
from dermis.frame.features.surface import record as surface_record
from dermis.frame.features.translucency.pair_search.search import (
    PairTable,
    search_pairs,
    upload_receivers,
    upload_sources,
)
from dermis.frame.features.translucency.passes import (
    RECEIVER_BYTES,
    SOURCE_BYTES,
    choose_source_level,
    make_element_buffer,
    pair_weight_bindings,
)
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.request import FrameRequest
from dermis.gpu import Bindings, Device, Memo, Texture, make_texture, mark_scratch, upload
from dermis.optics.equivalent_medium import equivalent_medium
from dermis.optics.gaussians import GaussianSum
from dermis.optics.thin_parts import ThinParts, solve_thin_parts

Floats = NDArray[np.float64]
_MAX_THICKNESS_SIGMAS, _MAX_THICKNESS_MM = (
    4.0,
    40.0,
)  # thickest part in the tables: in standard deviations, and in mm
_WIDTH_STEPS_PER_DOUBLING, _MIN_WIDTH_MM = 2, 0.5  # spacing and minimum of rounded widths
_CACHED_PAIR_SEARCH_COUNT = 4
_PACKED_UNIT_LIGHT = np.array(
    [0xFE000, 0x3F8FE000], np.uint32
)  # white light of 1, encoded as in packed_light.wgsl
_CELL_COARSENING_FACTOR = 1.5  # factor of the cell side when memory does not hold the pairs


def thin_part_tables(memo: Memo, request: FrameRequest) -> ThinParts | None:
    """Return tables of the light that thin tissue transmits, and of the light that it fails to reflect.

    Both are functions of the thickness. The light that thin tissue fails to reflect is the reflectance of
    thick tissue minus the reflectance of thin tissue. The result is None for Lambertian skin.
    """
    if request.skin.direction != "half-space":
        return None
    split, maps = request.profile_split, request.head.maps
    half_space = surface_record.mean_half_space(request.skin, maps, request.profile)
    g = request.skin.anisotropy
    levels = split.total, split.blurred_mm2, split.weight
    return memo.get(_thin_part_weights, request.profile, *half_space, g, *levels)


def _thin_part_weights(
    profile: GaussianSum,
    colour: Floats,
    eta: float,
    anisotropy: float,
    total_weight: Floats,
    variance_mm2: Floats,
    level_weight: Floats,
) -> ThinParts:
    """Return tables of the light that thin tissue transmits, and of the light that it fails to reflect.

    Both are functions of the thickness. The light that thin tissue fails to reflect is the reflectance of
    thick tissue minus the reflectance of thin tissue. For each thickness, each table holds the weights of the
    Gaussians that blur light. The weights are scaled down where the light that thin tissue fails to reflect
    would exceed the light that is blurred.

    colour : (3,) diffuse reflectance of thick skin [-]
    eta : index of refraction of skin [-]
    anisotropy : anisotropy of scattering [-]
    total_weight : (3,) sums of the weights of all Gaussians of the profile [-]
    variance_mm2 : (k,) variances of the Gaussians that blur light [mm^2]
    level_weight : (k, 3) weights of these Gaussians for red, green and blue [-]
    """
    reach = min(_MAX_THICKNESS_SIGMAS * float(np.sqrt(variance_mm2[-1])), _MAX_THICKNESS_MM)
    tables = solve_thin_parts(equivalent_medium(profile, colour, eta), variance_mm2, reach, anisotropy)
    blurred = level_weight.sum(axis=0) / np.maximum(total_weight, MIN_WEIGHT_SUM)
    scale = np.minimum(1.0, blurred / np.maximum(tables.lost.sum(axis=1), MIN_WEIGHT_SUM))[:, None]
    lost = tables.lost * scale / np.maximum(blurred, MIN_WEIGHT_SUM)
    return replace(tables, transmitted=tables.transmitted * scale * total_weight, lost=lost)


def make_translucency(
    memo: Memo,
    device: Device,
    surface_bindings: Bindings,
    rest_surface_bindings: Bindings,
    atlas: Atlas,
    variance_mm2: Floats,
    weight: Floats,
    thickness_tables: ThinParts | None,
    shares_pairs: bool,
    layout_key: str,
) -> Translucency:
    """Return the resources for light that is transmitted through thin parts of a head.

    A pair consists of a cell of the atlas where light enters a thin part, and a cell where this light leaves.

    surface_bindings : resources of geometry.wgsl and of the atlas, for the current shape
    rest_surface_bindings : the same resources for the shape that is searched for pairs
    variance_mm2 : (k,) variances of the Gaussians that blur light [mm^2]
    weight : (k, 3) weights of these Gaussians for red, green and blue [-]
    thickness_tables : transmittance of thin tissue, and how much less it reflects than thick tissue, as
        functions of its thickness; None to compute the weight of a pair from the Gaussians, at the
        straight-line distance between its cells
    shares_pairs : whether skins with similar profiles use the same pairs; true for skins that may change
        between frames
    layout_key : name of the atlas layout in the cache
    """
    widest_mm = float(np.sqrt(variance_mm2[-1]))
    widest_mm = rounded_sigma_mm(widest_mm) if shares_pairs else widest_mm
    cells = memo.get(_cached_cell_division, atlas, caller_name=layout_key)(widest_mm)
    pairs = memo.get(PairCache, device, rest_surface_bindings, atlas, caller_name=layout_key).pairs_for_cells(
        cells
    )
    buffers = memo.get(make_translucency_buffers, device, surface_bindings, pairs, caller_name=layout_key)
    return memo.get(
        with_profile_weights, device, buffers, variance_mm2, weight, thickness_tables, caller_name=layout_key
    )


def _cached_cell_division(atlas: Atlas) -> Callable[[float], Cells]:
    """Return a cached function that divides the atlas into cells.

    The parameter of the returned function is the standard deviation of the widest Gaussian [mm].
    """
    return lru_cache(_CACHED_PAIR_SEARCH_COUNT)(partial(divide_into_cells, atlas))


class PairCache:
    """Cache of the translucent pairs of a surface, for the most recent divisions of its atlas into cells.

    A pair consists of a cell of the atlas where light enters a thin part, and a cell where this light leaves.

    surface_bindings : resources of geometry.wgsl and of the atlas, for the shape that is searched for pairs
    """

    def __init__(self, device: Device, surface_bindings: Bindings, atlas: Atlas) -> None:
        self._device, self._surface, self._atlas = device, surface_bindings, atlas
        self._cache: dict[Cells, PairBuffers] = {}

    def pairs_for_cells(self, cells: Cells) -> PairBuffers:
        """Return the pairs of cells on opposite sides of thin parts of the head.

        The pairs come from the cache or from a new search.

        cells : division of the atlas into cells
        """
        pairs = self._cache.pop(cells, None)
        if pairs is None:
            while len(self._cache) >= _CACHED_PAIR_SEARCH_COUNT:
                self._cache.pop(next(iter(self._cache)))
            pairs = find_pairs(self._device, self._surface, self._atlas, cells)
        self._cache[cells] = pairs
        return pairs


def rounded_sigma_mm(widest_sigma_mm: float) -> float:
    """Round the standard deviation of the widest Gaussian to the nearest power of sqrt(2) [mm].

    The cells of the atlas depend only on the rounded value, so that skins with similar profiles share them.

    widest_sigma_mm : standard deviation before rounding [mm]
    """
    step = round(_WIDTH_STEPS_PER_DOUBLING * float(np.log2(max(widest_sigma_mm, _MIN_WIDTH_MM))))
    return float(2.0 ** (step / _WIDTH_STEPS_PER_DOUBLING))


@logged_step("finding the thin parts")
def find_pairs(device: Device, surface_bindings: Bindings, atlas: Atlas, cells: Cells) -> PairBuffers:
    """Find the pairs of cells on opposite sides of thin tissue.

    If a buffer cannot hold all pairs, coarser cells are used.

    surface_bindings : resources of geometry.wgsl and of the atlas, for the shape that is searched for pairs
    cells : division of the atlas into cells
    """
    table, times = search_pairs(device, surface_bindings, cells), count(1)
    while table is None:
        cells = divide_into_cells(atlas, cells.max_sigma_mm, _CELL_COARSENING_FACTOR ** next(times))
        table = search_pairs(device, surface_bindings, cells)
    return make_pair_buffers(device, cells, table)


def make_pair_buffers(device: Device, cells: Cells, pair_table: PairTable) -> PairBuffers:
    """Create the buffers of cell pairs that the passes of a frame read.

    pair_table : result of the search for pairs
    """
    return PairBuffers(
        cells=cells,
        receivers=upload_receivers(device, cells, pair_table.receiver),
        sources=upload_sources(device, cells, pair_table.source),
        pairs=pair_table.pairs,
        count=int(pair_table.first[-1]),
        receiver_ranges=device.buffer(_receiver_ranges(cells, pair_table), "STORAGE"),
        transmitted=mark_scratch(device, _zero_light_texture(device, cells.receiver_mask)),
        lost=_zero_light_texture(device, cells.receiver_mask),
    )


def _receiver_ranges(cells: Cells, pair_table: PairTable) -> NDArray[np.uint32]:
    """Return a table (m, 3) of the receivers, which are the cells where transmitted light leaves the skin.

    Each row holds the packed position of a receiver, and the start and end of the range of its pairs in the
    buffer of pairs. If there are no receivers, the result is one row of zeros. Receivers with many pairs come
    first, so that invocations of the same workgroup take similar time.
    """
    first, end = pair_table.first[:-1], pair_table.first[1:]
    order = np.argsort(first - end, kind="stable")
    rows = np.stack([cells.receivers[pair_table.receiver], first, end], axis=-1)[order].astype(np.uint32)
    return rows if len(rows) else np.zeros((1, 3), np.uint32)


def _zero_light_texture(device: Device, surface_mask: NDArray[np.bool_]) -> Texture:
    """Return a black texture with one texel per cell of the atlas; alpha is 1 where `surface_mask` is set."""
    light = np.zeros((*surface_mask.shape, 4), np.float32)
    light[..., 3] = surface_mask
    texture = make_texture(device, surface_mask.shape, "rgba32float")
    upload(device, texture, light)
    return texture


def with_profile_weights(
    device: Device,
    translucency: Translucency,
    variance_mm2: Floats,
    weight: Floats,
    thickness_tables: ThinParts | None = None,
) -> Translucency:
    """Return a copy of the translucency resources with the weights of a diffusion profile.

    Each pair of cells, one where light enters and one where it leaves, has one weight.

    variance_mm2 : (k,) variances of the Gaussians that blur light [mm^2]
    weight : (k, 3) weights of these Gaussians for red, green and blue [-]
    thickness_tables : transmittance of thin tissue, and how much less it reflects than thick tissue, as
        functions of its thickness; None to compute the weight of a pair from the Gaussians, at the
        straight-line distance between its cells
    """
    fraction = weight / np.maximum(weight.sum(axis=0), MIN_WEIGHT_SUM)
    transmitted = weight if thickness_tables is None else thickness_tables.transmitted
    lost = fraction if thickness_tables is None else thickness_tables.lost
    return replace(
        translucency,
        weight_bindings=pair_weight_bindings(
            device, translucency.pairs, variance_mm2, weight, thickness_tables, transmitted
        ),
        loss_bindings=pair_weight_bindings(
            device, translucency.pairs, variance_mm2, fraction, thickness_tables, lost
        ),
        gaussian_count=len(weight),
        uses_tables=thickness_tables is not None,
        source_level=choose_source_level(translucency.pairs.cells.cell_mm, variance_mm2),
    )


def make_translucency_buffers(
    device: Device, surface_bindings: Bindings, pair_buffers: PairBuffers
) -> Translucency:
    """Allocate the buffers of translucency; `with_profile_weights` adds the weights of a profile.

    surface_bindings : resources of geometry.wgsl and of the atlas, for the current shape
    """
    receivers, sources = pair_buffers.receivers[1], pair_buffers.sources[1]
    return Translucency(
        pairs=pair_buffers,
        surface=surface_bindings,
        receiver_points=mark_scratch(device, make_element_buffer(device, receivers, RECEIVER_BYTES)),
        source_points=make_element_buffer(device, sources, SOURCE_BYTES),
        weights=make_element_buffer(device, pair_buffers.count, 8),
        source_light=mark_scratch(device, make_element_buffer(device, sources, 16)),
        direction_factors=mark_scratch(device, make_element_buffer(device, sources, 8)),
        unit_light=device.buffer(np.tile(_PACKED_UNIT_LIGHT, (max(sources, 1), 2)), "STORAGE"),
    )
