"""Resources of hair: buffers of the strands, the picture with hair, and deep opacity maps for shadows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.hair.skin_grid import SkinGridBuffers, make_skin_grid
from dermis.frame.lights.environment import SKY_DIRECTIONS
from dermis.frame.request import FrameRequest
from dermis.gpu import Buffer, Constants, Device, Memo, Texture, UniformRecord, make_texture
from dermis.mesh.groom import (
    ANCHORS_PER_GUIDE_KNOT,
    HIDDEN_CEILING_MM,
    KNOTS_PER_GUIDE,
    Groom,
    Guides,
    StrandRoots,
    bend_radius_mm,
)
from dermis.mesh.grown_strands import mean_hair_absorptance
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.skin_grid import skin_grid_constants
from dermis.mesh.strands import Strands, quad_corners, quad_weights
from dermis.scene.settings import Settings
from dermis.specular.hair import hair_constants

_TILE_SIDES_BY_PICTURE_PIXELS = ((2_200_000, 2), (9_000_000, 4))  # larger tiles need fewer links
_LARGEST_TILE_SIDE = 8
DEEP_OPACITY_WIDTH = 256
"""Width of a deep opacity map, twice its height [texels]."""
DEEP_OPACITY_LAYERS = 6
"""Number of depth intervals of a deep opacity map, which stores the cover by the hair in each interval."""
DEEP_OPACITY_HEADER_WORDS = 8
"""Number of words that precede the texels of each light's deep opacity map."""
SKY_CELLS = 24, 32, 24
"""Number of cells of the grid of sky transmittance, along x, y and z, see strand_sky.wgsl."""
SKY_CELLS_PER_WORKGROUP = 2
"""Number of cells of the grid for which one workgroup computes the transmittance."""
_SKY_HEADER_WORDS, _SKY_CELL_WORDS = 6, 10
VIEW_TEXEL_PIXELS = 4
"""Side of a texel of the deep opacity map of the picture, see view_map.wgsl [pixel]."""
_SEGMENT_LINKS_PER_KNOT = 8
_MAX_SEGMENT_LINKS = 1 << 24
# Steps to which capacities for fine strands and for knots are rounded up, so that most heads share them.
_FINE_CAPACITY_STEP, _KNOT_CAPACITY_STEP = 1 << 12, 1 << 19
_PROJECTED_KNOT_BYTES = 32
_MIN_DRAWN_STRANDS, _MIN_KNOTS = 5_000, 4
# Width added per unit of cover: where hair hides hair, fewer strands suffice.
_WIDTH_PER_COVER_PX, _MAX_DRAWN_COVER = 0.2, 1.0
_KEPT_STYLE_COUNT = 12  # hair styles whose buffers, of about 10 MB each, are kept for the next person
_MIN_STRANDS_PER_PIXEL = 2.0  # where all strands are short; fewer would look like dots
_HAIRY_SKIN_AREA_MM2 = 6e4  # approximate area of the skin on which scalp hair and beard grow
_MAX_KNOT_FRACTION_FOR_SHORT_HAIR = 0.4  # largest fraction of `Detail.drawn_knots` that is spent against dots
_MAX_BEND_MM = 35.0  # radius of curvature of the guides near the skin
_DETAIL_LEVELS_PER_OCTAVE = 4  # levels of detail for each doubling of the size of a pixel
KNOTS_PER_BOUNDS_WORKGROUP = 1 << 12
"""Number of knots for which one workgroup of strands_window.wgsl computes bounds."""
# Row of the table of strands in strands_pose.wgsl.
_STRAND_DTYPE = np.dtype([("corner", "u4", 4), ("weight", "f4", 4), ("absorption", "f4", 4)])
# Rows of the tables in guides_pose.wgsl and strands_grow.wgsl.
_ANCHOR_DTYPE = np.dtype([("corner", "u4", 4), ("local", "f4", 4)])
_ROOT_MEMBERS = ("corner", "u4", 4), ("weight", "f4", 4), ("guide", "u4", 4), ("guide_weight", "f4", 4)
_ROOT_DTYPE = np.dtype(
    [
        *_ROOT_MEMBERS,
        ("place", "f4", 4),
        ("clump", "u4"),
        ("part", "u4"),
        ("along_mm", "f4"),
        ("threshold", "f4"),
    ]
)
_HAIR_COUNT_MEMBERS = "fine", "coarse", "shadow_casters", "fine_knots", "coarse_knots"
_HAIRS_DTYPE = np.dtype(
    [
        *((name, "u4") for name in _HAIR_COUNT_MEMBERS),
        *((name, "f4") for name in ("width_scale", "absorptance", "pad")),
        ("dye", "f4", 4),
    ]
)


class StrandDetail(NamedTuple):
    """Limits of the detail of coarse strands (scalp hair and beard), for GPUs or for software adapters.

    drawn_knots : largest total number of knots of the drawn strands
    casters : number of strands that are drawn into shadow maps in place of all coarse strands; more if they
        have fewer than `caster_knots` knots
    caster_knots : largest number of knots of a strand in shadow maps
    width_px : least width of drawn strands [pixel]
    deviation_px : largest deviation of a curl from the segments that represent it [pixel]
    segment_px : largest length of the segments of drawn strands [pixel]
    """

    drawn_knots: int
    casters: int
    caster_knots: int
    width_px: float
    deviation_px: float
    segment_px: float


_GPU_DETAIL, _SOFTWARE_DETAIL = (
    StrandDetail(1 << 23, 9_000, 24, 0.6, 0.15, 9.0),
    StrandDetail(1 << 20, 4_500, 10, 0.9, 0.3, 14.0),
)


class StrandCounts(NamedTuple):
    """Number of strands of a group, and number of knots (end points of segments) of each strand.

    A group is for example scalp hair and beard, or brows and lashes.
    """

    hairs: int
    knots: int

    def total_knot_count(self) -> int:
        """Return the total number of knots of all strands."""
        return self.hairs * self.knots

    def total_segment_count(self) -> int:
        """Return the total number of segments of all strands."""
        return self.hairs * (self.knots - 1)


class StrandCapacity(NamedTuple):
    """Largest numbers of strands and knots that the buffers of hair can hold.

    fine : number of strands of brows and lashes
    knots : total number of knots of all strands
    """

    fine: int
    knots: int


@dataclass(frozen=True, eq=False)
class StrandBuffers:
    """Buffers filled in each frame: strands that cast shadows, drawn strands, and projected knots."""

    casters: Buffer
    drawn: Buffer
    projected: Buffer


@dataclass(frozen=True, eq=False)
class StrandPicture:
    """Picture with hair, and linked lists of the strand segments in each of its tiles.

    list_heads : buffer of the first link of each linked list of segments, see strands_bin.wgsl
    links : buffer of the links of these lists; a link consists of a segment and the index of the next link
    view_map : buffer of the deep opacity map of the picture, see view_map.wgsl
    result : texture of the picture with hair
    tile_side : side of a tile [pixel]
    """

    list_heads: Buffer
    links: Buffer
    view_map: Buffer
    result: Texture
    tile_side: int


def strand_counts(strands: Strands | None) -> StrandCounts:
    """Return the number of strands, 0 if there are none, and the number of knots of each strand."""
    return StrandCounts(0, 2) if strands is None else StrandCounts(*strands.radius_mm.shape)


def max_coarse_counts(device: Device, head: Head) -> StrandCounts:
    """Return the largest number of coarse strands to draw, and the largest number of knots of each.

    Coarse strands are scalp hair and beard. The limits depend on the device.
    """
    if head.hair is None:
        return StrandCounts(0, 2)
    fitting = device.max_storage_bytes // _PROJECTED_KNOT_BYTES - _KNOT_CAPACITY_STEP
    limit = min(fitting, adapter_strand_detail(device).drawn_knots) // head.hair.knots
    return StrandCounts(min(len(head.hair), limit), head.hair.knots)


def caster_strand_counts(device: Device, coarse_counts: StrandCounts) -> StrandCounts:
    """Return how many strands represent scalp hair and beard in shadow maps, and how many knots each has.

    coarse_counts : result of `max_coarse_counts`
    """
    detail = adapter_strand_detail(device)
    knots = min(coarse_counts.knots, detail.caster_knots)
    return StrandCounts(min(coarse_counts.hairs, detail.casters * detail.caster_knots // knots), knots)


def adapter_strand_detail(device: Device) -> StrandDetail:
    """Return the limits of the detail of scalp hair and beard for the adapter of a device."""
    return _SOFTWARE_DETAIL if device.adapter.kind == "CPU" else _GPU_DETAIL


def strand_capacity(fine_counts: StrandCounts, coarse_counts: StrandCounts) -> StrandCapacity:
    """Return the capacity that buffers of strands need, rounded up so that most heads can share buffers.

    fine_counts : number of strands of brows and lashes, and number of knots of each strand
    coarse_counts : largest number of strands of scalp hair and beard, and largest number of knots of each
    """
    knots = fine_counts.total_knot_count() + coarse_counts.total_knot_count()
    step = _KNOT_CAPACITY_STEP if coarse_counts.hairs else _FINE_CAPACITY_STEP
    return StrandCapacity(_round_up(fine_counts.hairs, _FINE_CAPACITY_STEP), _round_up(knots, step))


def _round_up(count: int, step: int) -> int:
    return -(-count // step) * step


def make_strand_buffers(
    device: Device, capacity: StrandCapacity, caster_capacity: StrandCapacity
) -> StrandBuffers:
    """Allocate the buffers of posed strands and of projected knots.

    capacity : largest numbers of strands and knots that are drawn into the picture
    caster_capacity : largest numbers of strands and knots that are drawn into shadow maps
    """
    first, second = (
        _make_word_buffer(device, 4 * (one.knots + 2 * (one.knots // 2)))
        for one in (caster_capacity, capacity)
    )
    return StrandBuffers(first, second, _make_word_buffer(device, 8 * capacity.knots))


def make_strand_picture(
    device: Device, capacity: StrandCapacity, picture_size: tuple[int, int]
) -> StrandPicture:
    """Allocate the segment lists and the texture with hair for a picture of size (width, height)."""
    tile_side = _tile_side(picture_size)
    across, down = (-(-side // tile_side) for side in picture_size)
    links = _SEGMENT_LINKS_PER_KNOT * capacity.knots + capacity.fine * (across + down) // 4
    links = min(links, _MAX_SEGMENT_LINKS, device.max_storage_bytes // 8)
    list_heads = _make_word_buffer(device, 1 + across * down)
    result = make_texture(device, picture_size, "rgba32float")
    texels = int(np.prod([-(-side // VIEW_TEXEL_PIXELS) for side in picture_size]))
    view_map = _make_word_buffer(device, (1 + DEEP_OPACITY_LAYERS) * texels)
    return StrandPicture(list_heads, _make_word_buffer(device, 2 * links), view_map, result, tile_side)


def _tile_side(picture_size: tuple[int, int]) -> int:
    """Return the side of tiles for a picture of size (width, height) [pixel]."""
    pixels = picture_size[0] * picture_size[1]
    sides = (side for most, side in _TILE_SIDES_BY_PICTURE_PIXELS if pixels <= most)
    return next(sides, _LARGEST_TILE_SIDE)


def make_deep_opacity_maps(device: Device, light_count: int) -> Buffer:
    """Allocate a buffer for the shadows of strands.

    It holds the grid of sky transmittance, then a deep opacity map for each of `light_count` lights.
    """
    texels = (1 + DEEP_OPACITY_LAYERS) * DEEP_OPACITY_WIDTH**2 // 2
    sky_words = _SKY_HEADER_WORDS + _SKY_CELL_WORDS * sky_cell_count()
    return _make_word_buffer(device, sky_words + (DEEP_OPACITY_HEADER_WORDS + texels) * max(1, light_count))


def sky_cell_count() -> int:
    """Return the number of cells of the grid of sky transmittance."""
    return int(np.prod(SKY_CELLS))


def placeholder_strand_shadows(device: Device) -> Buffer:
    """Return the buffer that is bound in place of the deep opacity maps for heads without hair."""
    return device.cached("no strand shadows", lambda: _make_word_buffer(device, DEEP_OPACITY_HEADER_WORDS))


def _make_word_buffer(device: Device, word_count: int) -> Buffer:
    return device.storage_buffer(4 * word_count)


@dataclass(frozen=True, eq=False)
class GuideTables:
    """Buffers of the guide strands of a hair style, named as in guides_pose.wgsl and strands_grow.wgsl."""

    anchors: Buffer
    guide_rest: Buffer
    guide_ceilings: Buffer
    guide_cuts: Buffer
    bound_guides: Buffer
    guides: Buffer


@dataclass(frozen=True, eq=False)
class GroomTables:
    """Buffers of a person's groom: guides of the hair style, and parameters such as length and colour.

    skin : grid by which the strands are kept outside the skin
    """

    style: GuideTables
    roots: Buffer
    parts: Buffer
    hairline: Buffer
    skin: SkinGridBuffers


@dataclass(frozen=True, eq=False)
class StrandTables:
    """Buffers of a head's strands, with the values that determine how many strands are drawn.

    Fine strands are brows and lashes; coarse strands are scalp hair and beard.

    strands : buffer of the fine strands at rest, see strands_pose.wgsl
    knots : buffer of the knots of the fine strands at rest, see strands_pose.wgsl
    buffers : buffers of posed strands and projected knots, which are filled in each frame
    fine : number of fine strands, and number of knots of each
    coarse : largest number of coarse strands to draw, and largest number of knots of each
    casters : number of strands that represent all coarse strands in shadow maps, and number of knots of each
    detail : limits of the detail of coarse strands
    groom : buffers from which coarse strands are interpolated, None if there are no coarse strands
    possible : total number of coarse strands of the person
    centre_mm : (3,) centre of the roots of the coarse strands at rest [mm]
    length_mm : length of the longer of scalp hair and beard [mm]
    bend_mm : least radius of curvature of the strands [mm]
    shortest_mm : length of the shorter of the two, at least 1 [mm]
    width_mm : width of one strand of the longer of the two [mm]
    cover : projected area of hair per area of skin, where the longer of the two grows [-]
    absorptance : fraction of diffuse light that a hair absorbs, mean of all colours [-]
    dye : (3,) absorption of dyed strands of natural width; 0 for hair that is not dyed [1/mm]
    """

    strands: Buffer
    knots: Buffer
    buffers: StrandBuffers
    fine: StrandCounts
    coarse: StrandCounts
    casters: StrandCounts
    detail: StrandDetail
    groom: GroomTables | None
    possible: int
    centre_mm: NDArray[np.float64]
    length_mm: float
    bend_mm: float
    shortest_mm: float
    width_mm: float
    cover: float
    absorptance: float
    dye: NDArray[np.float64]

    def hairs_record(self, coarse_counts: StrandCounts) -> UniformRecord:
        """Return the numbers of strands as a uniform record of the struct Hairs in strand_knots.wgsl.

        coarse_counts : number of coarse strands to draw, and number of knots of each
        """
        width_scale = self.possible / max(1, coarse_counts.hairs)
        values = (
            self.fine.hairs,
            coarse_counts.hairs,
            coarse_counts.hairs,
            self.fine.knots,
            coarse_counts.knots,
            width_scale,
            self.absorptance,
            0.0,
            (*(self.dye / max(width_scale, 1e-6)), 0.0),
        )
        return np.array(values, _HAIRS_DTYPE)


@dataclass(frozen=True, eq=False)
class Resources:
    """Resources of the passes of hair.

    tables : buffers of the strands of the head
    picture : lists of strand segments, and the texture of the picture with hair
    shadows : buffer of the deep opacity maps of all lights
    """

    tables: StrandTables
    picture: StrandPicture
    shadows: Buffer


def shader_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in the hair shaders."""
    opacity = {"strand_window": DEEP_OPACITY_WIDTH, "strand_layers": DEEP_OPACITY_LAYERS}
    words = {
        "strand_window_words": DEEP_OPACITY_HEADER_WORDS,
        "strand_window_knots": KNOTS_PER_BOUNDS_WORKGROUP,
    }
    sky: dict[str, float] = {f"sky_cells_{axis}": n for axis, n in zip("xyz", SKY_CELLS, strict=True)}
    sky |= {
        "sky_cells_per_workgroup": SKY_CELLS_PER_WORKGROUP,
        "sky_directions": SKY_DIRECTIONS,
        "sky_head_words": _SKY_HEADER_WORDS,
        "sky_cell_words": _SKY_CELL_WORDS,
    }
    guides: dict[str, float] = {
        "anchors_per_guide_knot": ANCHORS_PER_GUIDE_KNOT,
        "knots_per_guide": KNOTS_PER_GUIDE,
        "hidden_ceiling_mm": HIDDEN_CEILING_MM,
    }
    own = {**opacity, **words, "view_texel": VIEW_TEXEL_PIXELS, **sky, **guides}
    return {**own, **skin_grid_constants(), **hair_constants()}


def has_strands(head: Head, settings: Settings) -> bool:
    """Return whether a head has strands of hair that the settings do not switch off."""
    return settings.strands and any(part is not None and len(part) > 0 for part in (head.strands, head.hair))


def strand_shadow_constants(head: Head, settings: Settings) -> Constants:
    """Return the pipeline constant that enables strand shadows; an empty tuple if no strands are drawn."""
    return (("STRANDS", 1),) if has_strands(head, settings) else ()


def drawn_strand_counts(strand_tables: StrandTables, pixel_mm: float) -> StrandCounts:
    """Return the number of strands of scalp hair and beard to draw, and the number of knots of each.

    If strands are thinner than a pixel, fewer but wider strands are drawn, which cover the same area. For
    short hair, the number is increased again, because a small number of short strands looks like dots.

    pixel_mm : side of the square that a pixel covers at the depth of the strands [mm]
    """
    if not strand_tables.coarse.hairs:
        return strand_tables.coarse
    pixel_mm = 2.0 ** (np.round(_DETAIL_LEVELS_PER_OCTAVE * np.log2(pixel_mm)) / _DETAIL_LEVELS_PER_OCTAVE)
    tables, detail = strand_tables, strand_tables.detail
    drawn_px = detail.width_px + _WIDTH_PER_COVER_PX * min(tables.cover, _MAX_DRAWN_COVER)
    hairs = max(_MIN_DRAWN_STRANDS, tables.possible * tables.width_mm / (drawn_px * pixel_mm))
    segment_px = np.clip(
        np.sqrt(8.0 * detail.deviation_px * tables.bend_mm / pixel_mm), 1.0, detail.segment_px
    )
    knots = max(_MIN_KNOTS, 1 + np.ceil(tables.length_mm / (segment_px * pixel_mm)))
    crossing = _MIN_STRANDS_PER_PIXEL * _HAIRY_SKIN_AREA_MM2 / (pixel_mm * tables.shortest_mm)
    hairs = max(hairs, min(crossing, _MAX_KNOT_FRACTION_FOR_SHORT_HAIR * detail.drawn_knots / knots))
    return StrandCounts(int(min(tables.coarse.hairs, hairs)), int(min(tables.coarse.knots, knots)))


def make_strand_tables(
    device: Device, head: Head, coarse_counts: StrandCounts, buffers: StrandBuffers, groom: GroomTables | None
) -> StrandTables:
    """Upload the brows and lashes of a head, and collect the buffers of its scalp hair and beard.

    coarse_counts : result of `max_coarse_counts`
    buffers : buffers of posed strands and projected knots, which are filled in each frame
    groom : buffers from which scalp hair and beard are interpolated, None if there are none

    Raises DermisError for strands whose roots do not lie on the head's mesh.
    """
    fine, hair = head.strands, head.hair
    rows, knots = np.zeros(1, _STRAND_DTYPE), np.zeros((1, 4), np.float32)
    if fine is not None and len(fine):
        rows, knots = np.zeros(len(fine), _STRAND_DTYPE), _knot_rows(fine)
        _fill_strand_rows(rows, head, fine)
    parts = None if hair is None else hair.parameters[hair.parameters["density"] > 0.0]
    largest = None if parts is None or not len(parts) else parts[parts["length_mm"].argmax()]
    return StrandTables(
        strands=device.buffer(rows.view(np.uint32), "STORAGE"),
        knots=device.buffer(knots, "STORAGE"),
        buffers=buffers,
        fine=strand_counts(fine),
        coarse=coarse_counts,
        casters=caster_strand_counts(device, coarse_counts),
        detail=adapter_strand_detail(device),
        groom=groom,
        possible=0 if hair is None else hair.possible,
        centre_mm=np.zeros(3) if hair is None else hair.centre_mm,
        length_mm=0.0 if largest is None else float(largest["length_mm"]),
        bend_mm=_MAX_BEND_MM if parts is None else float(bend_radius_mm(parts).min(initial=_MAX_BEND_MM)),
        shortest_mm=1.0 if parts is None else max(1.0, float(parts["length_mm"].min(initial=500.0))),
        width_mm=0.0 if largest is None else 2.0 * float(largest["radius_mm"]),
        cover=0.0 if largest is None else float(largest["cover"]),
        absorptance=1.0 if hair is None else mean_hair_absorptance(hair),
        dye=np.zeros(3) if parts is None else _dye_absorption(parts),
    )


def _dye_absorption(hair_parameters: NDArray[np.void]) -> NDArray[np.float64]:
    """Return the absorption coefficients (3,) of dyed strands [1/mm]; 0 if no hair is dyed.

    hair_parameters : rows of `Groom.parameters`, for scalp hair and beard
    """
    dyed = hair_parameters[hair_parameters["dyed"] > 0.0]
    return np.asarray((dyed["dye"] / dyed["hairs_per_strand"][:, None]).sum(axis=0), np.float64)


def make_guide_tables(device: Device, guides: Guides) -> GuideTables:
    """Upload the guide strands of a hair style, and allocate buffers for the posed guides."""
    anchors = np.empty(guides.weight.shape, _ANCHOR_DTYPE)
    anchors["corner"] = guides.corner
    anchors["local"][..., :3], anchors["local"][..., 3] = guides.local_mm, guides.weight
    bound, smooth = (_make_word_buffer(device, 2 * guides.rest_mm.size) for _ in range(2))
    uploaded = guides.rest_mm, guides.ceilings_mm, guides.cut
    rest, ceilings, cuts = (device.buffer(array, "STORAGE") for array in uploaded)
    return GuideTables(device.buffer(anchors.view(np.uint32), "STORAGE"), rest, ceilings, cuts, bound, smooth)


def make_strand_roots(device: Device, roots: StrandRoots, mesh: Mesh) -> Buffer:
    """Upload the roots of all strands that a hair style can have.

    mesh : mesh of quads in which the strands are rooted
    """
    rows = np.zeros(len(roots), _ROOT_DTYPE)
    rows["corner"], rows["weight"] = quad_corners(mesh, roots.roots.quad), quad_weights(roots.roots.position)
    for name in ("guide", "guide_weight", "place", "clump", "part", "along_mm", "threshold"):
        rows[name] = getattr(roots, name)
    return device.buffer(rows.view(np.uint32), "STORAGE")


def make_groom_tables(
    device: Device, groom: Groom, guide_tables: GuideTables, roots: Buffer, skin: SkinGridBuffers
) -> GroomTables:
    """Upload the parameters of a person's groom, such as colour and length.

    guide_tables : guides of the hair style, shared by all people with that style
    roots : buffer of the strand roots of the hair style, shared by all people with that style
    skin : grid of the skin, shared by all people with the same topology
    """
    parts = device.buffer(groom.parameters.view(np.float32), "STORAGE")
    return GroomTables(guide_tables, roots, parts, device.buffer(groom.hairline_mm, "STORAGE"), skin)


def _fill_strand_rows(strand_rows: NDArray[np.void], head: Head, strands: Strands) -> None:
    if int(strands.roots.quad.max()) >= len(head.mesh.quads):
        actual = f"its mesh has {len(head.mesh.quads)} quads"
        refuse(head.name, "hairs rooted in quads of its mesh", actual, "Leave its strands out")
    strand_rows["corner"] = quad_corners(head.mesh, strands.roots.quad)
    strand_rows["weight"] = quad_weights(strands.roots.position)
    strand_rows["absorption"][:, :3] = strands.absorption
    if strands.cover is not None:
        strand_rows["absorption"][:, 3] = strands.cover


def _knot_rows(strands: Strands) -> NDArray[np.float32]:
    """Return (n k, 4) rows of position and radius [mm], one for each knot of n strands with k knots each."""
    rows = np.empty((*strands.radius_mm.shape, 4), np.float32)
    rows[..., :3], rows[..., 3] = strands.knots_mm, strands.radius_mm
    return rows.reshape(-1, 4)


def make_resources(memo: Memo, device: Device, request: FrameRequest) -> Resources | None:
    """Return the resources for the hair of the requested head, None if no strands are drawn.

    Raises DermisError for strands whose roots do not lie on the head's mesh.
    """
    head, cached, layers = request.head, memo.get, request.shadow_layers
    if not has_strands(head, request.settings):
        return None
    fine, coarse = strand_counts(head.strands), max_coarse_counts(device, head)
    capacity, casters = (strand_capacity(fine, one) for one in (coarse, caster_strand_counts(device, coarse)))
    groom = None
    if head.hair is not None:
        kept = _KEPT_STYLE_COUNT
        style = cached(make_guide_tables, device, head.hair.guides, min_cache_size=kept)
        roots = cached(
            make_strand_roots, device, head.hair.roots, head.topology_head.mesh, min_cache_size=kept
        )
        skin = cached(make_skin_grid, device, head.topology_head)
        groom = cached(make_groom_tables, device, head.hair, style, roots, skin)
    buffers = cached(make_strand_buffers, device, capacity, casters)
    tables = cached(make_strand_tables, device, head.without_maps, coarse, buffers, groom)
    picture = cached(make_strand_picture, device, capacity, request.settings.size)
    shadows = cached(make_deep_opacity_maps, device, layers, caller_name=f"{layers} {request.view_name}")
    return Resources(tables, picture, shadows)
