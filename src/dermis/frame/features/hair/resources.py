"""Resources of hair: tables of strands, and buffers for the picture and for shadows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.surface.record import DEFAULT_COLOUR
from dermis.frame.request import FrameRequest
from dermis.gpu import Buffer, Constants, Device, Memo, Texture, UniformRecord, make_texture
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands, quad_corners, quad_weights
from dermis.scene.settings import Settings
from dermis.specular.hair import hair_constants

TILE_PIXELS = 8
"""Side of a tile of the picture, for which strand segments are listed [pixels]."""
_GPU_CHAINS = 64  # linked lists of a tile on GPUs: one for each invocation of the tile's workgroup
DEEP_OPACITY_WIDTH = 256
"""Width of a deep opacity map, twice its height [texels]."""
DEEP_OPACITY_LAYERS = 6
"""Number of depth intervals of a deep opacity map, each with the cover of the hair within it."""
DEEP_OPACITY_HEADER_WORDS = 8
"""Number of words that precede the texels of each light's deep opacity map."""
_LINKS_PER_KNOT = 4
_MAX_LINKS = 1 << 22
# Steps to which capacities for fine strands and for knots are rounded up, so that most heads share them.
_FINE_CAPACITY_STEP, _KNOT_CAPACITY_STEP = 1 << 12, 1 << 19
_MAX_SHADOW_CASTERS = 32_000  # number of coarse strands that cast the shadows of all coarse strands
_MIN_DRAWN_STRANDS = 5_000
_DRAWN_WIDTH_PX = 0.45  # width of the drawn coarse strands [pixel]
_WIDTH_PER_COVER_PX = 0.2  # added width per unit of cover: where hair hides hair, fewer strands suffice
WINDOW_KNOTS = 1 << 12
"""Number of knots for which one workgroup of strands_window.wgsl computes bounds."""
# Row of the table of strands in strands_pose.wgsl.
_STRAND_DTYPE = np.dtype([("corner", "u4", 4), ("weight", "f4", 4), ("absorption", "f4", 4)])
_COUNT_MEMBERS = "fine", "coarse", "shadow_casters", "fine_knots", "coarse_knots"
_HAIRS_DTYPE = np.dtype([*((name, "u4") for name in _COUNT_MEMBERS), ("width_scale", "f4")])


class StrandCounts(NamedTuple):
    """Number of strands of one group (fine or coarse), and number of knots of each strand."""

    hairs: int
    knots: int

    def all_knots(self, hairs: int | None = None) -> int:
        """Return the total number of knots of the first `hairs` strands, or of all strands."""
        return (self.hairs if hairs is None else hairs) * self.knots

    def all_segments(self, hairs: int | None = None) -> int:
        """Return the number of segments between knots of the first `hairs` strands, or of all strands."""
        return (self.hairs if hairs is None else hairs) * (self.knots - 1)


class StrandCapacity(NamedTuple):
    """Number of strands and knots that the buffers of hair can hold.

    fine : strands of brows and lashes
    knots : total number of knots of fine and coarse strands
    """

    fine: int
    knots: int


@dataclass(frozen=True, eq=False)
class StrandBuffers:
    """Buffers that each frame fills: posed strands, and their knots projected to the picture."""

    posed: Buffer
    projected: Buffer


@dataclass(frozen=True, eq=False)
class StrandPicture:
    """Lists of the strand segments in each tile of the picture, and the picture with hair.

    chains : buffer of the first link of each linked list of segments, see strands_bin.wgsl
    links : buffer of the links of these lists: a segment and the next link
    result : texture of the picture with hair
    chains_per_tile : number of linked lists of a tile, which are filled and drawn in parallel
    """

    chains: Buffer
    links: Buffer
    result: Texture
    chains_per_tile: int


def strand_counts(strands: Strands | None) -> StrandCounts:
    """Return the number of strands, which is 0 for None, and the number of knots of each strand."""
    return StrandCounts(0, 2) if strands is None else StrandCounts(*strands.radius_mm.shape)


def strand_capacity(head: Head) -> StrandCapacity:
    """Return the buffer capacity for the strands of a head, rounded up so that most heads share buffers."""
    fine, coarse = map(strand_counts, (head.strands, head.hair))
    knots = fine.all_knots() + coarse.all_knots()
    step = _KNOT_CAPACITY_STEP if coarse.hairs else _FINE_CAPACITY_STEP
    return StrandCapacity(_round_up(fine.hairs, _FINE_CAPACITY_STEP), _round_up(knots, step))


def _round_up(count: int, step: int) -> int:
    return -(-count // step) * step


def make_strand_buffers(device: Device, capacity: StrandCapacity) -> StrandBuffers:
    """Allocate the buffers of posed strands and of projected knots."""
    max_hairs = capacity.knots // 2
    posed = _make_buffer(device, 4 * (capacity.knots + 2 * max_hairs))
    return StrandBuffers(posed, _make_buffer(device, 8 * capacity.knots))


def make_strand_picture(device: Device, capacity: StrandCapacity, size: tuple[int, int]) -> StrandPicture:
    """Allocate the segment lists and the texture with hair for a picture of size (width, height)."""
    across, down = (-(-side // TILE_PIXELS) for side in size)
    links = _LINKS_PER_KNOT * capacity.knots + capacity.fine * (across + down)
    links = min(links, _MAX_LINKS, device.max_storage_bytes // 8)
    per_tile = chains_per_tile(device, across * down)
    chains = _make_buffer(device, 1 + per_tile * across * down)
    result = make_texture(device, size, "rgba32float")
    return StrandPicture(chains, _make_buffer(device, 2 * links), result, per_tile)


def chains_per_tile(device: Device, tiles: int) -> int:
    """Return the number of linked lists of segments per tile of the picture.

    The number is 1 on software adapters, and where a buffer cannot hold more lists.

    tiles : number of tiles of the picture
    """
    fits = 4 * (1 + _GPU_CHAINS * tiles) <= device.max_storage_bytes
    return _GPU_CHAINS if fits and device.adapter.kind != "CPU" else 1


def make_deep_opacity(device: Device, lights: int) -> Buffer:
    """Allocate a buffer for the deep opacity maps of strands, one map for each of `lights` lights."""
    texels = (1 + DEEP_OPACITY_LAYERS) * DEEP_OPACITY_WIDTH**2 // 2
    return _make_buffer(device, (DEEP_OPACITY_HEADER_WORDS + texels) * max(1, lights))


def placeholder_strand_shadows(device: Device) -> Buffer:
    """Return a placeholder for the deep opacity maps of heads without hair."""
    return device.cached("no strand shadows", lambda: _make_buffer(device, DEEP_OPACITY_HEADER_WORDS))


def _make_buffer(device: Device, words: int) -> Buffer:
    return device.storage_buffer(4 * words)


@dataclass(frozen=True, eq=False)
class StrandTables:
    """Strands of a head in buffers, with the counts and mean values from which strands are drawn.

    strands, knots : tables of strands at rest and of their knots, see strands_pose.wgsl
    posed, projected : strands in the current pose, and knots projected to the picture
    record : uniform record of the struct Hairs in strand_knots.wgsl
    fine : number of strands and knots of brows and lashes
    coarse : number of strands and knots of the hair on head and chin
    shadow_casters : number of coarse strands that cast the shadows of all coarse strands
    centre_mm : (3,) centre of the roots of the coarse strands at rest [mm]
    mean_width_mm : mean width of the coarse strands [mm]
    mean_cover : mean over the coarse strands of `Strands.cover`, the projected area of hair per area of skin
        around the root [-]
    """

    strands: Buffer
    knots: Buffer
    posed: Buffer
    projected: Buffer
    record: UniformRecord
    fine: StrandCounts
    coarse: StrandCounts
    shadow_casters: int
    centre_mm: NDArray[np.float64]
    mean_width_mm: float
    mean_cover: float


@dataclass(frozen=True, eq=False)
class Resources:
    """Resources of the passes of hair.

    tables : strands of the head in buffers
    picture : segment lists and the texture with hair
    shadows : buffer of the deep opacity maps of all lights
    skin_albedo : (3,) mean albedo of the skin below the strands, which reflects light onto them [-]
    """

    tables: StrandTables
    picture: StrandPicture
    shadows: Buffer
    skin_albedo: tuple[float, ...]


def shader_constants() -> dict[str, float]:
    """Return the values that `//#fill` lines insert in the hair shaders, by name."""
    opacity = {"strand_window": DEEP_OPACITY_WIDTH, "strand_layers": DEEP_OPACITY_LAYERS}
    words = {"strand_window_words": DEEP_OPACITY_HEADER_WORDS, "strand_window_knots": WINDOW_KNOTS}
    return {"strand_tile": TILE_PIXELS, **opacity, **words, **hair_constants()}


def has_strands(head: Head, settings: Settings) -> bool:
    """Return whether a head has strands, and the settings show them."""
    return settings.strands and any(part is not None and len(part) > 0 for part in (head.strands, head.hair))


def strand_constants(head: Head, settings: Settings) -> Constants:
    """Return the pipeline constant that makes lighting read strand shadows; () if no strands are drawn."""
    return (("STRANDS", 1),) if has_strands(head, settings) else ()


def drawn_hair_count(tables: StrandTables, pixel_mm: float) -> int:
    """Return the number of coarse strands to draw.

    Where strands are thinner than a pixel, fewer but wider strands are drawn, which cover the same area.

    pixel_mm : side of a pixel at the depth of the strands [mm]
    """
    total_mm = tables.coarse.hairs * tables.mean_width_mm
    drawn_mm = (_DRAWN_WIDTH_PX + _WIDTH_PER_COVER_PX * tables.mean_cover) * pixel_mm
    return int(min(tables.coarse.hairs, max(_MIN_DRAWN_STRANDS, total_mm / drawn_mm)))


def make_strand_tables(device: Device, head: Head, buffers: StrandBuffers) -> StrandTables:
    """Upload the strands of a head.

    buffers : buffers that each frame fills with posed strands and projected knots

    Raises DermisError for strands that are rooted in another mesh.
    """
    both = head.strands, head.hair
    parts = [part for part in both if part is not None]
    fine, coarse = map(strand_counts, both)
    rows = np.zeros(fine.hairs + coarse.hairs, _STRAND_DTYPE)
    for part, first in zip(parts, (0, len(parts[0])), strict=False):
        _fill_rows(rows[first : first + len(part)], head, part)
    knots = np.concatenate([_knot_rows(part) for part in parts])
    casters = min(coarse.hairs, _MAX_SHADOW_CASTERS)
    width_scale = coarse.hairs / max(1, casters)
    record = np.array(
        (fine.hairs, coarse.hairs, casters, fine.knots, coarse.knots, width_scale), _HAIRS_DTYPE
    )
    hair = head.hair
    return StrandTables(
        strands=device.buffer(rows.view(np.uint32), "STORAGE"),
        knots=device.buffer(knots, "STORAGE"),
        posed=buffers.posed,
        projected=buffers.projected,
        record=record,
        fine=fine,
        coarse=coarse,
        shadow_casters=casters,
        centre_mm=np.zeros(3) if hair is None else hair.root_centre_mm(head.mesh),
        mean_width_mm=0.0 if hair is None else 2.0 * float(hair.radius_mm[:, 0].mean()),
        mean_cover=0.0 if hair is None or hair.cover is None else float(hair.cover.mean()),
    )


def _fill_rows(rows: NDArray[np.void], head: Head, strands: Strands) -> None:
    if int(strands.roots.quad.max()) >= len(head.mesh.quads):
        actual = f"its mesh has {len(head.mesh.quads)} quads"
        refuse(head.name, "hairs rooted in quads of its mesh", actual, "Leave its strands out")
    rows["corner"] = quad_corners(head.mesh, strands.roots.quad)
    rows["weight"] = quad_weights(strands.roots.position)
    rows["absorption"][:, :3] = strands.absorption
    if strands.cover is not None:
        rows["absorption"][:, 3] = strands.cover


def _knot_rows(strands: Strands) -> NDArray[np.float32]:
    """Return the positions and radii of all knots, (n k, 4) for n strands of k knots [mm]."""
    rows = np.empty((*strands.radius_mm.shape, 4), np.float32)
    rows[..., :3], rows[..., 3] = strands.knots_mm, strands.radius_mm
    return rows.reshape(-1, 4)


def mean_skin_albedo(head: Head) -> tuple[float, ...]:
    """Return the mean (3,) albedo of the colour map, or a default albedo if there is no map [-]."""
    colour = head.maps.mean_colour
    return (DEFAULT_COLOUR,) * 3 if colour is None else tuple(colour.tolist())


def make(memo: Memo, device: Device, request: FrameRequest) -> Resources | None:
    """Return the resources for the hair of the requested head, None if no strands are drawn.

    Raises DermisError for strands that are rooted in another mesh.
    """
    head, cached, layers = request.head, memo.get, request.shadow_layers
    if not has_strands(head, request.settings):
        return None
    capacity = strand_capacity(head)
    tables = cached(make_strand_tables, device, head.bare, cached(make_strand_buffers, device, capacity))
    picture = cached(make_strand_picture, device, capacity, request.settings.size)
    shadows = cached(make_deep_opacity, device, layers, caller_name=f"{layers} {request.view_name}")
    return Resources(tables, picture, shadows, cached(mean_skin_albedo, head))
