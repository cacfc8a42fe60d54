"""The atlas as textures, with the chosen stretch correction and remedy for seams."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER, MOST_SHEAR, Atlas
from dermis.atlas.stitched.walk import INNER, INWARD
from dermis.base.disk import cached_arrays
from dermis.frame.seams import FEATHER_MM, REMEDIES, Remedy
from dermis.gpu import Buffer, Constants, Device, Texture, make_texture, scratch
from dermis.gpu.textures import texture_from

_HALVING = "halved 2"  # raise when `halved` gives other results
MOST_HALVINGS = 3
"""Coarser resolutions of an atlas that blurs may use."""
ENTRY_BYTES = 16
"""Of a texel in a list of gutters, as gutter.wgsl reads it."""
_NAME = "map of the atlas"
_LIGHT = 16  # bytes of what a texel beyond a chart shows
_GUTTER_BIT = 1 << 15  # of the first number of a texel's reach, see reach.wgsl
SAME_PLACE = 4.0
"""Texels within which the sources of four gutter neighbours are averaged."""


def atlas_numbers() -> dict[str, int | float]:
    """What shaders that read the atlas fill in."""
    _, inner_b, inner_c = INNER
    walks = {"inward": INWARD, "inner_b": inner_b, "inner_c": inner_c, "same_place": SAME_PLACE}
    return {"gutter_bit": _GUTTER_BIT, "most_shear": MOST_SHEAR, **walks}


@dataclass(frozen=True, eq=False)
class AtlasTextures:
    """Resources of an atlas, by their names in the shaders.

    resources : atlas, stretch_map (filled by its pass), reach_map, and edge_map for two layouts and feathered
        stretch; stretch_map and reach_map alone of coarser ones
    sheared : whether u and v may meet at other than right angles
    stretching : pipeline constants of the stretch passes
    rooted : buffer of the texels whose stretch is that of another place; None without any
    gutter, gathered : buffers of the texels beyond the charts' edges and of their light; None without any
    gutter_texels : (a, 2) these texels, x and y
    coarser : the same, again and again at half the resolution; only of stitched layouts
    usual_per_mm : median of the texels per mm along the axis that has fewer, at rest
    """

    resources: dict[str, Texture]
    sheared: bool = True
    stretching: Constants = ()
    rooted: Buffer | None = None
    gutter: Buffer | None = None
    gutter_texels: NDArray[np.uint16] = field(default_factory=lambda: np.zeros((0, 2), np.uint16))
    gathered: Buffer | None = None
    coarser: tuple[AtlasTextures, ...] = ()
    usual_per_mm: float = 0.0

    def sheets(self, edge: str) -> tuple[AtlasTextures, ...]:
        """The atlas at its own resolution and at the coarser ones that blurs with this edge may use."""
        return (self, *(self.coarser if edge == "repeated" else ()))


def upload_atlas(
    device: Device, atlas: Atlas, stretch: str = "full", remedy: Remedy = REMEDIES["stitch"]
) -> AtlasTextures:
    """The atlas as the shaders read it; its stretch is left to the stretch pass.

    stretch : "full" has the angle between u and v, "axes" takes it as right, "none" is one density for all
    """
    texels = packed_texels(atlas.triangle, atlas.barycentric)
    own = atlas.own
    texels[~own] = 0
    resources = {"atlas": texture_from(device, texels, "rg32uint", _NAME)}
    if remedy.feathered or len(remedy.layouts) > 1:
        resources["edge_map"] = texture_from(device, edge_texels(atlas), "r32float", _NAME)
    even = _even(atlas.stretch[own]) if stretch == "none" else 0.0
    feather = FEATHER_MM if remedy.feathered else 0.0
    sheet = Sheet(atlas.coverage, own, atlas.reach, atlas.gutter, atlas.source)
    return _uploaded(
        device,
        sheet,
        resources,
        sheared=stretch == "full",
        stretching=(("SHEAR", stretch == "full"), ("EVEN", even), ("FEATHER_MM", feather)),
        rooted=device.buffer(_rooted(atlas), "STORAGE") if len(atlas.beyond) else None,
        coarser=_coarser(device, sheet) if len(atlas.gutter) else (),
        usual_per_mm=_usual(atlas.stretch, own),
    )


def _even(stretch: NDArray[np.float16]) -> float:
    """One density for all texels (n, 2) [1/mm]."""
    return float(np.sqrt((stretch.astype(np.float64) ** 2).mean())) if len(stretch) else 0.0


def _usual(stretch: NDArray[np.float16], own: NDArray[np.bool_]) -> float:
    """Median of the density along the axis that has less [1/mm].

    Halves that are not negative are in order as numbers of 16 bits are, and few: counting takes a tenth of
    sorting.
    """
    words = stretch.view(np.uint16)
    counts = np.bincount(np.minimum(words[..., 0], words[..., 1])[own], minlength=1 << 16)
    total = int(counts.sum())
    if total == 0:
        return 0.0
    middle = np.searchsorted(np.cumsum(counts), [(total - 1) // 2, total // 2], side="right")
    return float(middle.astype(np.uint16).view(np.float16).astype(np.float64).mean())


def _uploaded(device: Device, sheet: Sheet, resources: dict[str, Texture], **more: Any) -> AtlasTextures:
    reach = sheet.reach.copy()
    reach[..., 0] |= np.where(sheet.covered & ~sheet.own, _GUTTER_BIT, 0).astype(np.uint16)
    resources = resources | {
        "reach_map": texture_from(device, reach, "rgba16uint", _NAME),
        "stretch_map": make_texture(device, (reach.shape[1], reach.shape[0]), "rgba16float", name=_NAME),
    }
    if not len(sheet.gutter):
        return AtlasTextures(resources, **more)
    beyond = np.concatenate([sheet.source.view(np.uint32), sheet.gutter.astype(np.uint32)], axis=1)
    gathered = mark_scratch(device, device.space(_LIGHT * len(beyond)))
    gutter = device.buffer(beyond, "STORAGE")
    return AtlasTextures(resources, gutter_texels=sheet.gutter, gutter=gutter, gathered=gathered, **more)


def _rooted(atlas: Atlas) -> NDArray[np.uint32]:
    """(r, 3) texel, triangle and weights as stretch_beyond.wgsl reads them."""
    (x, y), (second, third) = (pair.T.astype(np.uint32) for pair in (atlas.beyond, atlas.root_weight))
    return np.stack([x | (y << 16), atlas.root.astype(np.uint32), second | (third << 16)], axis=1)


def _coarser(device: Device, sheet: Sheet) -> tuple[AtlasTextures, ...]:
    """The sheet at half, a quarter, ... of its resolution, made or read from disk."""
    parts = [field.name for field in fields(Sheet)]
    count = 0
    while count < MOST_HALVINGS and len(sheet.reach) % (2 << count) == 0:
        count += 1

    def make() -> dict[str, NDArray[np.generic]]:
        made = [sheet]
        for _ in range(count):
            made.append(halved(made[-1]))
        return {f"{k} {part}": getattr(one, part) for k, one in enumerate(made[1:]) for part in parts}

    names = [f"{k} {part}" for k in range(count) for part in parts]
    found = cached_arrays([getattr(sheet, part) for part in parts], _HALVING, names, make)
    sheets = (Sheet(**{part: found[f"{k} {part}"] for part in parts}) for k in range(count))
    return tuple(_uploaded(device, one, {}) for one in sheets)


def packed_texels(triangle: NDArray[np.integer], barycentric: NDArray[np.number]) -> NDArray[np.uint32]:
    """(n, n, 2) places on the mesh as the shaders read them.

    triangle : (n, n) -1 for none
    barycentric : (n, n, 2) weights of the second and third corner [1/65535]
    """
    packed = barycentric[..., 0].astype(np.uint32) | (barycentric[..., 1].astype(np.uint32) << 16)
    return np.stack([(triangle + 1).astype(np.uint32), packed], axis=-1)


def edge_texels(atlas: Atlas) -> NDArray[np.float32]:
    """(n, n) distance of each texel to the nearest edge of its chart, roughly [texel]."""
    from scipy.ndimage import distance_transform_edt

    inner = atlas.own & (atlas.reach > 0).all(axis=-1)  # charts may touch without an empty texel between
    texels = distance_transform_edt(np.pad(inner, 1))[1:-1, 1:-1] - GUTTER
    return np.asarray(np.maximum(texels, 0.0), np.float32)


@dataclass(frozen=True)
class Sheet:
    """The data of an n x n atlas that blurs and seams need.

    covered, own : (n, n) texels that show surface, and those of them that do not copy others
    reach : (n, n, 4) texels to the left, right, up and down of the same chart without a gap between
    gutter, source : (a, 2) texels (x, y) beyond a chart's edge, and where their light is [texel]
    """

    covered: NDArray[np.bool_]
    own: NDArray[np.bool_]
    reach: NDArray[np.uint16]
    gutter: NDArray[np.uint16]
    source: NDArray[np.float32]


def halved(sheet: Sheet) -> Sheet:
    """The sheet at half resolution; texels that bilinear reads may touch are computed, not stitched."""
    from scipy.ndimage import binary_dilation

    own = _quads(sheet.own)
    some_own = own[0] | own[1] | own[2] | own[3]
    counted = np.where(some_own, own, _quads(sheet.covered))
    some = counted[0] | counted[1] | counted[2] | counted[3]
    stitched = some & ~binary_dilation(some_own, np.ones((3, 3), bool))
    return Sheet(some, some & ~stitched, _reach(sheet.reach, counted), *_gutter(sheet, stitched))


def _quads(image: NDArray[np.generic]) -> NDArray[np.generic]:
    """(4, n/2, n/2) texels (0, 0), (1, 0), (0, 1), (1, 1) of each square of four."""
    return np.stack([image[y::2, x::2] for y in (0, 1) for x in (0, 1)])


def _reach(reach: NDArray[np.uint16], counted: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """Whole squares to the left, right, up and down that all counted texels reach."""
    made = np.zeros((*counted.shape[1:], 4), np.uint16)
    within = np.array([[0, 1, 0, 1], [1, 0, 1, 0], [0, 0, 1, 1], [1, 1, 0, 0]])  # to the square's own side
    for side in range(4):
        steps = _quads(reach[..., side]).astype(np.int16) - within[side].astype(np.int16)[:, None, None]
        steps[~counted] = np.iinfo(np.int16).max
        made[..., side] = np.maximum(steps.min(axis=0), 0) // 2
    made[~counted.any(axis=0)] = 0
    return made


def _gutter(sheet: Sheet, stitched: NDArray[np.bool_]) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """The squares that are stitched, and the mean of their texels' sources."""
    x, y = (sheet.gutter.astype(np.int64) // 2).T
    kept = stitched[y, x]
    source = sheet.source[kept].astype(np.float64)
    squares, first, of = np.unique(
        y[kept] * stitched.shape[1] + x[kept], return_index=True, return_inverse=True
    )
    near = np.abs(source - source[first][of]).max(axis=1) < SAME_PLACE
    count = np.bincount(of[near], minlength=len(squares))
    mean = np.stack(
        [np.bincount(of[near], source[near, k], minlength=len(squares)) / count for k in (0, 1)], axis=-1
    )
    gutter = np.stack([squares % stitched.shape[1], squares // stitched.shape[1]], axis=-1)
    return gutter.astype(np.uint16), (0.5 * mean - 0.25).astype(np.float32)
