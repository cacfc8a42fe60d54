"""The stitched atlas, made step by step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import MOST_SHEAR, Atlas
from dermis.atlas.stitched.border import Gutter, Placing, find_border
from dermis.atlas.stitched.cover import Cover, cover
from dermis.atlas.stitched.measure import metric_of, roots_of, runs_of
from dermis.atlas.stitched.overlap_cuts import cut_overlaps
from dermis.atlas.stitched.pieces import find_pieces
from dermis.atlas.stitched.placing import lay_out
from dermis.atlas.stitched.surface import Surface, survey
from dermis.mesh.mesh import Mesh

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

_WIDEST = 1 / 8  # of the map's side, for gutters


def build_stitched(mesh: Mesh, size: int, reach_mm: float) -> Atlas | None:
    """The atlas in which every chart has a place of its own and an gutter of what lies across its seams.

    None when there are too many charts for so few texels.

    reach_mm : width of the gutters
    """
    surface = survey(mesh)
    piece, scale = find_pieces(surface)
    piece = cut_overlaps(surface, piece, reach_mm)
    width = Gutter(reach_mm, _WIDEST * size)
    placing = lay_out(surface, piece, scale, size, width)
    if placing is None:
        return None
    made = _cover(surface, piece, placing, width, size)
    # where a piece lies on itself only one layer has light: gutters must not read the other
    lost = _lost(piece, placing, made)
    if lost.any():
        piece = np.where(lost, -1, piece)
        made = _cover(surface, piece, placing, width, size)
    return _atlas(surface, placing, made, piece >= 0)


def _cover(surface: Surface, piece: Index, placing: Placing, width: Gutter, size: int) -> Cover:
    own = np.flatnonzero(piece >= 0)
    return cover(surface, piece, own, find_border(surface, piece, own), placing, width, (size, size))


def _lost(piece: Index, placing: Placing, made: Cover) -> NDArray[np.bool_]:
    """Triangles (f,) most of whose texels are owned by others."""
    from dermis.atlas.stitched.kernels.fill import count

    inside, owned = np.zeros((2, len(piece)), np.int64)
    count(placing.places, np.flatnonzero(piece >= 0), made.rooted, inside, owned)
    return np.asarray(owned < 0.5 * inside)


def _atlas(surface: Surface, placing: Placing, made: Cover, mapped: NDArray[np.bool_]) -> Atlas:
    size = len(made.triangle)
    metric = metric_of(surface, placing, made)
    reach = runs_of(surface, made, made.piece, metric, roots_of(placing, made))
    y, x = np.nonzero(made.gutter)
    second = made.weights[y, x].astype(np.float64)
    weights = np.column_stack((1 - second.sum(axis=1), second))
    source = np.einsum("nk,nka->na", weights, placing.places[made.triangle[y, x]])
    place = np.where(mapped[:, None, None], (placing.places + 0.5) / size, 0.0)
    shear = np.clip(metric[..., 2], -MOST_SHEAR, MOST_SHEAR)
    return Atlas(
        triangle=made.triangle,
        barycentric=np.floor(made.weights * 65535.0).astype(np.uint16),
        stretch=np.minimum(metric[..., :2], 6e4).astype(np.float16),
        shear=shear.astype(np.float16),
        reach=reach,
        place=place.astype(np.float32),
        gutter=np.column_stack((x, y)).astype(np.uint16),
        source=source.astype(np.float32),
        mapped=mapped,
    )
