"""Textures of the atlas on the device, for a chosen stretch correction and seam method."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER_TEXELS, MAX_SHEAR, Atlas
from dermis.atlas.stitched.geodesics import INNER_POINT_WEIGHTS, START_SHIFT_FRACTION
from dermis.base.disk import cached_arrays
from dermis.frame.seams import FEATHER_WIDTH_MM, SEAM_METHODS, SeamMethod
from dermis.gpu import Buffer, Constants, Device, Texture, make_texture, mark_scratch
from dermis.gpu.textures import texture_from_array

_HALVING_CACHE_KEY = (
    "halved 2"  # key of the disk cache: increase the number when `halve_mip` changes its results
)
MAX_ATLAS_HALVINGS = 3
"""Number of coarser resolutions of an atlas that blurs may use."""
GUTTER_ENTRY_BYTES = 16
"""Size of an entry in the buffer of gutter texels, see gutter.wgsl [bytes]."""
_ATLAS_TEXTURE_NAME = "map of the atlas"
_GUTTER_LIGHT_BYTES = 16  # size of the light of a gutter texel
_GUTTER_BIT = 1 << 15  # bit of the first component of reach_map that marks gutter texels, see reach.wgsl
MAX_SAME_SOURCE_DISTANCE_TEXELS = 4.0
"""Distance along x or y below which sources of gutter texels are averaged at half the resolution [texels].

A source is the position from which a gutter texel copies light. In each square of 2 x 2 texels, sources that
are farther from the first source are ignored as outliers.
"""


def atlas_constants() -> dict[str, int | float]:
    """Return the named values that the shader preprocessor inserts into shaders that read the atlas.

    It inserts them at `//#fill` directives.
    """
    _, inner_b, inner_c = INNER_POINT_WEIGHTS
    tracing = {
        "inward": START_SHIFT_FRACTION,
        "inner_b": inner_b,
        "inner_c": inner_c,
        "same_source": MAX_SAME_SOURCE_DISTANCE_TEXELS,
    }
    return {"gutter_bit": _GUTTER_BIT, "max_shear": MAX_SHEAR, **tracing}


@dataclass(frozen=True, eq=False)
class AtlasTextures:
    """Textures and buffers of an atlas.

    resources : dictionary from names in shaders to textures: atlas, stretch_map (filled by `draw_stretch`),
        reach_map (`AtlasMip.reach`) and, for two layouts or feathered seams, edge_map; coarser resolutions
        have only stretch_map and reach_map
    sheared : whether blurs account for an angle between the u and v directions that is not a right angle
    stretch_constants : pipeline constants of the stretch passes
    stretch_sources : buffer of the texels outside charts, each with the surface point whose stretch it
        copies; None if there are no such texels
    gutter : buffer of the gutter texels, None if there are no gutters
    gutter_light : buffer of the light of the gutter texels, None if there are no gutters
    gutter_texels : (a, 2) coordinates x and y of the gutter texels
    coarser : the atlas at half, a quarter, ... of the resolution; only for stitched layouts
    median_texels_per_mm : median over texels of min(density along u, density along v), for the head at rest
        [texels/mm]
    """

    resources: dict[str, Texture]
    sheared: bool = True
    stretch_constants: Constants = ()
    stretch_sources: Buffer | None = None
    gutter: Buffer | None = None
    gutter_texels: NDArray[np.uint16] = field(default_factory=lambda: np.zeros((0, 2), np.uint16))
    gutter_light: Buffer | None = None
    coarser: tuple[AtlasTextures, ...] = ()
    median_texels_per_mm: float = 0.0

    def mips_for_blurs(self, edge_mode: str) -> tuple[AtlasTextures, ...]:
        """Return the atlas at all resolutions that blurs may use, the finest first.

        edge_mode : what blurs read beyond the edge of a chart; only "repeated", which repeats the texel at
            the edge, permits coarser resolutions
        """
        return (self, *(self.coarser if edge_mode == "repeated" else ()))


def upload_atlas(
    device: Device,
    atlas: Atlas,
    stretch_correction: str = "full",
    seam_method: SeamMethod = SEAM_METHODS["stitch"],
) -> AtlasTextures:
    """Upload an atlas, with an empty stretch map that `draw_stretch` fills.

    stretch_correction : "full" includes the angle between u and v, "axes" assumes that u and v are
        perpendicular, "none" assumes the same texel density everywhere
    seam_method : how seams are treated; determines whether an edge map is uploaded, and whether seams are
        feathered
    """
    texels = pack_surface_points(atlas.triangle, atlas.barycentric)
    own = atlas.lit_mask
    texels[~own] = 0
    resources = {"atlas": texture_from_array(device, texels, "rg32uint", _ATLAS_TEXTURE_NAME)}
    if seam_method.feathered or len(seam_method.layouts) > 1:
        resources["edge_map"] = texture_from_array(
            device, edge_distances(atlas), "r32float", _ATLAS_TEXTURE_NAME
        )
    even = _rms_density(atlas.stretch[own]) if stretch_correction == "none" else 0.0
    feather = FEATHER_WIDTH_MM if seam_method.feathered else 0.0
    mip = AtlasMip(atlas.coverage, own, atlas.edge_distance, atlas.gutter, atlas.source)
    return _upload_mip(
        device,
        mip,
        resources,
        sheared=stretch_correction == "full",
        stretch_constants=(("SHEAR", stretch_correction == "full"), ("EVEN", even), ("FEATHER_MM", feather)),
        stretch_sources=device.buffer(_stretch_sources(atlas), "STORAGE") if len(atlas.outside) else None,
        coarser=_upload_coarser(device, mip) if len(atlas.gutter) else (),
        median_texels_per_mm=_median_density(atlas.stretch, own),
    )


def _rms_density(stretch: NDArray[np.float16]) -> float:
    """Return the root mean square of all (n, 2) texel densities along u and v [texels/mm]."""
    return float(np.sqrt((stretch.astype(np.float64) ** 2).mean())) if len(stretch) else 0.0


def _median_density(stretch: NDArray[np.float16], inside_mask: NDArray[np.bool_]) -> float:
    """Return the median over texels of min(density along u, density along v) [texels/mm].

    stretch : (n, n, 2) texel densities along u and v [texels/mm]
    inside_mask : (n, n) mask of the texels inside charts, which excludes gutters

    The median is read from a histogram of the bit patterns, which is faster than sorting; non-negative half
    floats have the same order as their bit patterns.
    """
    words = stretch.view(np.uint16)
    counts = np.bincount(np.minimum(words[..., 0], words[..., 1])[inside_mask], minlength=1 << 16)
    total = int(counts.sum())
    if total == 0:
        return 0.0
    middle = np.searchsorted(np.cumsum(counts), [(total - 1) // 2, total // 2], side="right")
    return float(middle.astype(np.uint16).view(np.float16).astype(np.float64).mean())


def _upload_mip(
    device: Device, mip: AtlasMip, resources: dict[str, Texture], **further_fields: Any
) -> AtlasTextures:
    reach = mip.reach.copy()
    reach[..., 0] |= np.where(mip.covered & ~mip.lit_mask, _GUTTER_BIT, 0).astype(np.uint16)
    resources = resources | {
        "reach_map": texture_from_array(device, reach, "rgba16uint", _ATLAS_TEXTURE_NAME),
        "stretch_map": make_texture(
            device, (reach.shape[1], reach.shape[0]), "rgba16float", texture_name=_ATLAS_TEXTURE_NAME
        ),
    }
    if not len(mip.gutter):
        return AtlasTextures(resources, **further_fields)
    entries = np.concatenate([mip.source.view(np.uint32), mip.gutter.astype(np.uint32)], axis=1)
    gutter_light = mark_scratch(device, device.storage_buffer(_GUTTER_LIGHT_BYTES * len(entries)))
    gutter = device.buffer(entries, "STORAGE")
    return AtlasTextures(
        resources, gutter_texels=mip.gutter, gutter=gutter, gutter_light=gutter_light, **further_fields
    )


def _stretch_sources(atlas: Atlas) -> NDArray[np.uint32]:
    """Return (r, 3) words for stretch_beyond.wgsl, one row for each texel outside the triangles of its chart.

    Word 0 packs the coordinates of the texel. Words 1 and 2 are the surface point whose stretch the texel
    copies: a triangle, and two packed barycentric weights.
    """
    (x, y), (second, third) = (pair.T.astype(np.uint32) for pair in (atlas.outside, atlas.border_weights))
    return np.stack([x | (y << 16), atlas.border_triangle.astype(np.uint32), second | (third << 16)], axis=1)


def _upload_coarser(device: Device, mip: AtlasMip) -> tuple[AtlasTextures, ...]:
    """Upload the atlas at half, a quarter, ... of its resolution.

    The coarser masks and gutters are computed, or read from the disk cache.
    """
    parts = [field.name for field in fields(AtlasMip)]
    count = 0
    while count < MAX_ATLAS_HALVINGS and len(mip.reach) % (2 << count) == 0:
        count += 1

    def compute_coarser_mips() -> dict[str, NDArray[np.generic]]:
        mips = [mip]
        for _ in range(count):
            mips.append(halve_mip(mips[-1]))
        return {f"{k} {part}": getattr(coarser, part) for k, coarser in enumerate(mips[1:]) for part in parts}

    names = [f"{k} {part}" for k in range(count) for part in parts]
    arrays = cached_arrays(
        [getattr(mip, part) for part in parts], _HALVING_CACHE_KEY, names, compute_coarser_mips
    )
    mips = (AtlasMip(**{part: arrays[f"{k} {part}"] for part in parts}) for k in range(count))
    return tuple(_upload_mip(device, coarser, {}) for coarser in mips)


def pack_surface_points(
    triangle_index: NDArray[np.integer], barycentric: NDArray[np.number]
) -> NDArray[np.uint32]:
    """Pack surface points into (n, n, 2) words: the triangle index plus 1, and two barycentric weights.

    triangle_index : (n, n) triangle indices, -1 for texels without a surface
    barycentric : (n, n, 2) weights of the second and third corner [1/65535]
    """
    packed = barycentric[..., 0].astype(np.uint32) | (barycentric[..., 1].astype(np.uint32) << 16)
    return np.stack([(triangle_index + 1).astype(np.uint32), packed], axis=-1)


def edge_distances(atlas: Atlas) -> NDArray[np.float32]:
    """Return the approximate distance of each texel to the edge of its chart, (n, n) [texels]."""
    from scipy.ndimage import distance_transform_edt

    # charts can be adjacent without an empty texel
    inner = atlas.lit_mask & (atlas.edge_distance > 0).all(axis=-1)
    texels = distance_transform_edt(np.pad(inner, 1))[1:-1, 1:-1] - GUTTER_TEXELS
    return np.asarray(np.maximum(texels, 0.0), np.float32)


@dataclass(frozen=True)
class AtlasMip:
    """Masks and gutters of an n x n atlas at one resolution.

    covered : (n, n) mask of the texels that hold light, gutters included
    lit_mask : (n, n) mask of the texels where lighting is computed, gutters excluded
    reach : (n, n, 4) number of connected texels of the same chart to the left, right, up and down
    gutter : (a, 2) coordinates x and y of the gutter texels
    source : (a, 2) positions from which the gutter texels copy light [texels]
    """

    covered: NDArray[np.bool_]
    lit_mask: NDArray[np.bool_]
    reach: NDArray[np.uint16]
    gutter: NDArray[np.uint16]
    source: NDArray[np.float32]


def halve_mip(atlas_mip: AtlasMip) -> AtlasMip:
    """Return the masks and gutters of an atlas at half its resolution.

    Gutter texels next to a chart are computed like the texels of the chart, as averages of finer texels. All
    other gutter texels still copy light from across the seam.
    """
    from scipy.ndimage import binary_dilation

    own = _split_squares(atlas_mip.lit_mask)
    any_own = own[0] | own[1] | own[2] | own[3]
    measured = np.where(any_own, own, _split_squares(atlas_mip.covered))
    covered = measured[0] | measured[1] | measured[2] | measured[3]
    stitched = covered & ~binary_dilation(any_own, np.ones((3, 3), bool))
    return AtlasMip(
        covered,
        covered & ~stitched,
        _halved_edge_distances(atlas_mip.reach, measured),
        *_halved_gutter(atlas_mip, stitched),
    )


def _split_squares(image: NDArray[np.generic]) -> NDArray[np.generic]:
    """Rearrange an (n, n) image as (4, n/2, n/2); the first axis counts the texels of a 2 x 2 square."""
    return np.stack([image[y::2, x::2] for y in (0, 1) for x in (0, 1)])


def _halved_edge_distances(
    reach: NDArray[np.uint16], counted_texels: NDArray[np.bool_]
) -> NDArray[np.uint16]:
    """Return the reach map at half the resolution, (n/2, n/2, 4), counted in squares of 2 x 2 texels.

    The reach of a texel is the number of texels to its left, to its right, above it and below it until its
    chart ends. The reach of a square is the smallest reach of its texels, counted from the border of the
    square; texels outside `counted_texels` are ignored.

    reach : (n, n, 4) reach of each texel [texels]
    counted_texels : (4, n/2, n/2) mask of texels, as split by `_split_squares`
    """
    squares = np.zeros((*counted_texels.shape[1:], 4), np.uint16)
    within = np.array([[0, 1, 0, 1], [1, 0, 1, 0], [0, 0, 1, 1], [1, 1, 0, 0]])  # steps inside the square
    for side in range(4):
        steps = (
            _split_squares(reach[..., side]).astype(np.int16) - within[side].astype(np.int16)[:, None, None]
        )
        steps[~counted_texels] = np.iinfo(np.int16).max
        squares[..., side] = np.maximum(steps.min(axis=0), 0) // 2
    squares[~counted_texels.any(axis=0)] = 0
    return squares


def _halved_gutter(
    mip: AtlasMip, stitched_squares: NDArray[np.bool_]
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """Return the gutter texels of the halved atlas, and the positions from which they copy light.

    Both results have the shape (b, 2) and are in texels of the halved atlas, as in `AtlasMip`. The position
    for a coarser texel is the mean of the positions for its finer texels, without outliers.

    mip : atlas at the finer resolution
    stitched_squares : mask of the coarser texels that copy light from across a seam
    """
    x, y = (mip.gutter.astype(np.int64) // 2).T
    used = stitched_squares[y, x]
    source = mip.source[used].astype(np.float64)
    squares, first, index = np.unique(
        y[used] * stitched_squares.shape[1] + x[used], return_index=True, return_inverse=True
    )
    near = np.abs(source - source[first][index]).max(axis=1) < MAX_SAME_SOURCE_DISTANCE_TEXELS
    count = np.bincount(index[near], minlength=len(squares))
    mean = np.stack(
        [np.bincount(index[near], source[near, k], minlength=len(squares)) / count for k in (0, 1)], axis=-1
    )
    gutter = np.stack([squares % stitched_squares.shape[1], squares // stitched_squares.shape[1]], axis=-1)
    return gutter.astype(np.uint16), (0.5 * mean - 0.25).astype(np.float32)
