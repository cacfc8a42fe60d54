"""The atlas as textures, with the chosen stretch correction and remedy for seams."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER, Atlas
from dermis.disk import cached_arrays
from dermis.frame.coarser import Sheet, halved
from dermis.frame.levels import MOST_HALVINGS
from dermis.frame.seams import FEATHER_MM, REMEDIES, Remedy
from dermis.gpu import Device, scratch
from dermis.gpu.textures import texture_from

_HALVING = "halved 1"  # increment when `halved` gives other results
_LEAST_SHARE = 1e-3  # of the blur at the edge itself: 0 would mean no surface


@dataclass(frozen=True, eq=False)
class AtlasTextures:
    """Resources of an atlas, by their names in the shaders.

    resources : atlas, stretch_map, sheet_map, and edge_map where two layouts are blended; coarser ones have
        sheet_map alone
    sheared : whether u and v meet at other than right angles somewhere
    gutter, gathered : buffers of the texels beyond charts' edges and of their light; None without any
    coarser : the same at a half, a quarter, ... of the resolution; only of stitched layouts
    usual_per_mm : median of the texels per mm along the axis that has fewer
    """

    resources: dict[str, Any]
    sheared: bool
    gutter: Any = None
    gathered: Any = None
    coarser: tuple[AtlasTextures, ...] = ()
    usual_per_mm: float = 0.0

    def sheets(self, edge: str) -> tuple[AtlasTextures, ...]:
        """The atlas at its own resolution and at the coarser ones that blurs with this edge may use."""
        return (self, *(self.coarser if edge == "repeated" else ()))


def upload_atlas(
    device: Device, atlas: Atlas, stretch: str = "full", remedy: Remedy = REMEDIES["stitch"]
) -> AtlasTextures:
    """The atlas as the shaders read it.

    stretch : "full" has the angle between u and v, "axes" takes it as right, "none" is one density for all
    """
    texels = packed_texels(atlas.triangle, atlas.barycentric)
    texels[~atlas.own] = 0
    metric = _metric(atlas, stretch)
    if remedy.feathered:
        metric[..., :2] = _feathered(atlas, metric[..., :2])
    resources = {
        "atlas": texture_from(device, texels, "rg32uint"),
        "stretch_map": texture_from(device, metric, "rgba16float"),
    }
    if len(remedy.layouts) > 1:
        resources["edge_map"] = texture_from(device, edge_mm(atlas), "r32float")
    sheet = Sheet(metric, atlas.reach, atlas.gutter, atlas.source)
    own = metric[atlas.own, :2].min(axis=-1)
    usual = float(np.median(own)) if len(own) else 0.0
    coarser = _coarser(device, sheet) if len(atlas.gutter) else ()
    return _uploaded(device, sheet, resources, coarser=coarser, usual_per_mm=usual)


def _uploaded(device: Device, sheet: Sheet, resources: dict[str, Any], **more: Any) -> AtlasTextures:
    words = np.concatenate([part.view(np.uint32) for part in (sheet.metric, sheet.reach)], axis=-1)
    resources = resources | {"sheet_map": texture_from(device, words, "rgba32uint")}
    sheared = bool(sheet.metric[..., 2].any())
    if not len(sheet.gutter):
        return AtlasTextures(resources, sheared, **more)
    beyond = np.concatenate([sheet.source.view(np.uint32), sheet.gutter.astype(np.uint32)], axis=1)
    light = np.zeros((len(beyond), 4), np.float32)
    lists = [device.buffer(words, "STORAGE") for words in (beyond, light)]
    scratch(device, lists[1])
    return AtlasTextures(resources, sheared, *lists, **more)


def _coarser(device: Device, sheet: Sheet) -> tuple[AtlasTextures, ...]:
    """The sheet at half, a quarter, ... of its resolution, made or read from disk."""
    parts = [field.name for field in fields(Sheet)]
    count = 0
    while count < MOST_HALVINGS and len(sheet.metric) % (2 << count) == 0:
        count += 1

    def make() -> dict[str, NDArray[Any]]:
        made = [sheet]
        for _ in range(count):
            made.append(halved(made[-1]))
        return {f"{k} {part}": getattr(one, part) for k, one in enumerate(made[1:]) for part in parts}

    names = [f"{k} {part}" for k in range(count) for part in parts]
    found = cached_arrays([getattr(sheet, part) for part in parts], _HALVING, names, make)
    sheets = (Sheet(**{part: found[f"{k} {part}"] for part in parts}) for k in range(count))
    return tuple(_uploaded(device, one, {}) for one in sheets)


def packed_texels(triangle: NDArray[Any], barycentric: NDArray[Any]) -> NDArray[np.uint32]:
    """(n, n, 2) places on the mesh as the shaders read them.

    triangle : (n, n) -1 for none
    barycentric : (n, n, 2) weights of the second and third corner [1/65535]
    """
    packed = barycentric[..., 0].astype(np.uint32) | (barycentric[..., 1].astype(np.uint32) << 16)
    return np.stack([(triangle + 1).astype(np.uint32), packed], axis=-1)


def _metric(atlas: Atlas, stretch: str) -> NDArray[np.float16]:
    """(n, n, 4) texels per mm along u and v, the cosine between the two, and 1 in the gutter."""
    metric = np.zeros((atlas.size, atlas.size, 4), np.float16)
    metric[..., :2] = atlas.stretch
    if stretch == "full":
        metric[..., 2] = atlas.shear
    if stretch == "none":
        covered = atlas.stretch[atlas.own].astype(np.float64)
        metric[atlas.coverage, :2] = np.sqrt((covered**2).mean()) if len(covered) else 0.0
    metric[atlas.coverage & ~atlas.own, 3] = 1.0
    return metric


def edge_mm(atlas: Atlas) -> NDArray[np.float32]:
    """(n, n) distance of each texel to the nearest edge of its chart, roughly [mm]."""
    from scipy.ndimage import distance_transform_edt

    inner = atlas.own & (atlas.reach > 0).all(axis=-1)  # charts may touch without an empty texel between
    texels = np.maximum(distance_transform_edt(np.pad(inner, 1))[1:-1, 1:-1] - GUTTER, 0.0)
    density = np.sqrt(atlas.stretch.astype(np.float32).prod(axis=-1))
    return np.asarray(texels / np.maximum(density, 1e-3), np.float32)


def _feathered(atlas: Atlas, stretch: NDArray[np.float16]) -> NDArray[np.float16]:
    """Texels per mm, reduced towards the edge, so that a blur hardly crosses it."""
    share = np.clip(edge_mm(atlas) / FEATHER_MM, _LEAST_SHARE, 1.0)
    return np.asarray(stretch * share[..., None], np.float16)
