"""An atlas in coarse cells: those that give light to thin parts, those that take it, copies in gutters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER, Atlas

Index = NDArray[np.int64]
Words = NDArray[np.uint32]
Flags = NDArray[np.bool_]
TILE = 4
"""Cells along the side of a tile."""

BESIDE = 0.7
"""Texels by which a tile may show more than it covers: cells are whole ones, and triangles reach farther."""

_REACH = 3.2  # standard deviations of the widest Gaussian that two places are apart at most
_SPACING = 0.36  # of the cells, in the same unit: what is read between them is smooth
_WIDEST_MM = 10.0  # pairs through wax, which spreads light farther, would be too many
_ENOUGH = 1024  # texels a side that are looked at, where there are more of them than cells
_INSIDE = 0.1  # texels; the place of a texel beside a chart is on its edge, or in another chart


@dataclass(frozen=True, eq=False)
class Cells:
    """An atlas divided into side x side cells, numbered row by row, and these into tiles.

    Nothing but how large texels are depends on the shape of the surface.

    size : texels along the atlas' side
    widest_mm : standard deviation of the widest Gaussian
    spacing_mm : between cells, usually
    stride : texels between those that sources are made of
    surface : (side, side) cells that take light: with texels of their own, or beside such
    taking : (m,) uint32 x and y of these, packed, by the tile that the place at their middle belongs to
    middle : (m, 2) uint32 of these: triangle at the middle texel, and its packed weights
    taking_first : (t + 1,) where those of each tile begin
    giving, giving_first : (n,) and (t + 1,) cells with texels of their own, which give light, and where those
        of each tile begin
    triangle_first, triangle : (t + 1,) and (k,) uint32 triangles that tiles show
    copy_first, copy : (side * side + 1,) and (c, 2) uint32 texels of gutters that show something of cells,
        and texels that they show, x and y packed
    """

    size: int
    side: int
    widest_mm: float
    spacing_mm: float
    stride: int
    surface: Flags
    taking: Words
    middle: Words
    taking_first: Index
    giving: Index
    giving_first: Index
    triangle_first: Words
    triangle: Words
    copy_first: Index
    copy: Words

    @property
    def radius_mm(self) -> float:
        """Largest distance of a translucent pair."""
        return _REACH * self.widest_mm

    @property
    def tiles(self) -> int:
        """Along a side."""
        return -(-self.side // TILE)


def divide(atlas: Atlas, widest_mm: float, coarser: float = 1.0) -> Cells:
    """The cells for light that Gaussians of at most this standard deviation spread, up to 32 mm far.

    coarser : times the usual side of cells
    """
    widest, fine = min(widest_mm, _WIDEST_MM), _texel_mm(atlas)
    side = int(np.ceil(atlas.size * fine / (_SPACING * widest * coarser)))
    side = min(max(side, 1), atlas.size)
    stride = max(1, atlas.size // max(_ENOUGH, side))
    middle, own = middles(atlas.size, side), _any(atlas.own[::stride, ::stride], atlas.size, side, stride)
    shown = atlas.triangle[np.ix_(middle, middle)]
    surface = _widened(own) & (shown >= 0)
    weights = atlas.barycentric[np.ix_(middle, middle)][surface]
    places, tiles = np.column_stack([shown[surface].astype(np.uint32), _packed(*weights.T)]), -(-side // TILE)
    order, first = _by_tile(_tile_of(atlas, places, side, tiles), tiles)
    return Cells(
        atlas.size,
        side,
        widest,
        fine * atlas.size / side,
        stride,
        surface,
        _packed(*np.nonzero(surface)[::-1])[order],
        places[order],
        first,
        *_giving(own, tiles),
        *_triangles(atlas, side, tiles),
        *_copies(atlas, side),
    )


def _texel_mm(atlas: Atlas) -> float:
    """Median side of a texel on the surface [mm]."""
    step = max(1, atlas.size // _ENOUGH)
    own, stretch = atlas.own[::step, ::step], atlas.stretch[::step, ::step].astype(np.float32)
    density = stretch[..., 0][own] * stretch[..., 1][own]
    return float(1.0 / np.sqrt(np.median(density))) if len(density) else 1.0


def middles(size: int, side: int) -> Index:
    """(side,) texels in the middle of the cells."""
    return np.asarray(((np.arange(side) + 0.5) * size / side).astype(np.int64))


def _any(texels: Flags, size: int, side: int, stride: int) -> Flags:
    """(side, side) cells with marked texels, of every `stride`-th one along each axis."""
    first = -(-np.arange(side) * size // (side * stride))
    rows = np.logical_or.reduceat(texels, first, axis=0)
    return np.asarray(np.logical_or.reduceat(rows, first, axis=1))


def _widened(cells: Flags) -> Flags:
    """Cells, and all around them."""
    padded = np.pad(cells, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return np.asarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])


def _by_tile(tile: NDArray[np.integer], tiles: int) -> tuple[Index, Index]:
    """An order of things by their tile, and (t + 1,) where those of each begin."""
    order = np.argsort(tile, kind="stable")
    return order, np.concatenate([[0], np.cumsum(np.bincount(tile, minlength=tiles * tiles))])


def _giving(own: Flags, tiles: int) -> tuple[Index, Index]:
    """The numbers of cells by tile, and where those of each tile begin."""
    y, x = np.nonzero(own)
    order, first = _by_tile((y // TILE * tiles + x // TILE).astype(np.int32), tiles)
    return (y * len(own) + x)[order], first


def _tile_of(atlas: Atlas, middle: Words, side: int, tiles: int) -> NDArray[np.int32]:
    """(m,) tiles of places on triangles; where gutters show them they are elsewhere."""
    column, row = (
        np.clip(at * np.float32(side), 0, side - 1).astype(np.int32) // TILE
        for at in _places(atlas, middle[:, 0], middle[:, 1])
    )
    return np.asarray(row * tiles + column, np.int32)


def _packed(low: NDArray[np.integer], high: NDArray[np.integer]) -> Words:
    """Two numbers of 16 bits in each word."""
    return np.asarray(low.astype(np.uint32) | (high.astype(np.uint32) << 16), np.uint32)


def _triangles(atlas: Atlas, side: int, tiles: int) -> tuple[Words, Words]:
    """Where the triangles of each tile begin, and these: all whose boxes overlap it."""
    index = np.flatnonzero(atlas.mapped)
    place, beside = atlas.place[index].astype(np.float64), BESIDE / atlas.size
    low, high = place.min(axis=1) - beside, place.max(axis=1) + beside
    first, last = (np.clip((at * side).astype(np.int64) // TILE, 0, tiles - 1) for at in (low, high))
    wide, high_ = (last - first + 1).T
    count = wide * high_
    which = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    x, y = first[which].T + np.stack([number % wide[which], number // wide[which]])
    order, begin = _by_tile(y * tiles + x, tiles)
    return begin.astype(np.uint32), index[which[order]].astype(np.uint32)


def _copies(atlas: Atlas, side: int) -> tuple[Index, Words]:
    """Where the list of those begins that show each cell from elsewhere, and texels with what they show."""
    rim, place = _rim(atlas)
    texel = np.concatenate([atlas.gutter, rim])
    x, y = np.clip(np.rint(np.concatenate([atlas.source, place])), 0, atlas.size - 1).astype(np.int64).T
    cell = y * side // atlas.size * side + x * side // atlas.size
    order = np.argsort(cell, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=side * side))])
    return first, np.column_stack([_packed(*texel[order].T), _packed(x[order], y[order])])


def _rim(atlas: Atlas) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """(r, 2) texels beside charts that are lit themselves, and the places that they show [texel]."""
    inner, view = np.pad(atlas.own, GUTTER), np.lib.stride_tricks.sliding_window_view
    for axis in (0, 1):
        inner = np.logical_and.reduce(view(inner, 2 * GUTTER + 1, axis), -1)
    y, x = np.nonzero(atlas.own & ~inner)
    texel, weights = np.stack([x, y], axis=-1), _packed(*atlas.barycentric[y, x].T)
    place = np.stack(_places(atlas, atlas.triangle[y, x], weights), axis=-1)
    place = place * np.float32(atlas.size) - np.float32(0.5)
    elsewhere = np.abs(place - texel).max(axis=1, initial=0.0) > _INSIDE
    return texel[elsewhere].astype(np.uint16), place[elsewhere]


def _places(atlas: Atlas, triangle: NDArray[np.integer], weights: Words) -> list[NDArray[np.float32]]:
    """u and v in the atlas of places on triangles, v down.

    weights : of the second and third corner, packed
    """
    corner = atlas.place[triangle].reshape(-1, 6)
    b, c = (part.astype(np.float32) / np.float32(65535) for part in (weights & 0xFFFF, weights >> 16))
    axes = (corner[:, axis::2].T for axis in range(2))
    return [first + b * (second - first) + c * (third - first) for first, second, third in axes]
