"""Patches of clothing and glasses, added to the patches of skin for interreflection."""

from __future__ import annotations

import numpy as np

from dermis.atlas.atlas import Atlas
from dermis.atlas.interreflection import CELLS_PER_SIDE
from dermis.base.arrays import Floats, Mask
from dermis.mesh.mesh import Mesh

_PATCH_MM = 40.0  # size of patches of cloth; larger if there are too few unused blocks of the uv square
_BLOCK_CELLS = 2  # cells along the side of a block
_MIN_FREE_BLOCKS = 8  # number of cubes that meet in the origin, however large they are


def with_worn_patches(mesh: Mesh, atlas: Atlas) -> tuple[Floats, Mask]:
    """Return the uv (f, 3, 2) of all triangles, and the mask (f,) of those that exchange light.

    Clothing and glasses have no texels in the atlas. Their triangles are grouped by cubes of a few
    centimetres. The triangles in each cube get the uv of one block of cells that no skin uses, so that they
    form one patch. Without enough unused blocks, only skin exchanges light.
    """
    is_worn = np.array([bool(one.label) for one in mesh.materials])[mesh.material]
    worn, free = np.flatnonzero(is_worn), _unused_blocks(atlas)
    if not len(worn) or len(free) < _MIN_FREE_BLOCKS:
        return atlas.corner_uv, atlas.mapped
    middles, size = mesh.positions[mesh.triangles[worn]].mean(axis=1), _PATCH_MM
    patch = _cubes(middles, size)
    while patch.max() >= len(free):
        size *= 1.2
        patch = _cubes(middles, size)
    rows, columns = free[patch].T
    corner_uv, mapped = atlas.corner_uv.copy(), atlas.mapped.copy()
    cells = _BLOCK_CELLS * np.stack([columns, rows], axis=1) + 0.5
    corner_uv[worn] = (cells / CELLS_PER_SIDE).astype(np.float32)[:, None]
    mapped[worn] = True
    return corner_uv, mapped


def _cubes(points: Floats, side_mm: float) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the index (n,) of the cube of a grid that contains each point, counted from 0 without gaps."""
    return np.unique(np.floor(points / side_mm), axis=0, return_inverse=True)[1].ravel()


def _unused_blocks(atlas: Atlas) -> np.ndarray[tuple[int, int], np.dtype[np.intp]]:
    """Return row and column (b, 2) of the blocks of 2 x 2 cells that are not next to a texel of the atlas."""
    from scipy.ndimage import binary_dilation

    blocks = CELLS_PER_SIDE // _BLOCK_CELLS
    y, x = np.nonzero(atlas.coverage)
    used = np.zeros((blocks, blocks), bool)
    used[y * blocks // atlas.size, x * blocks // atlas.size] = True
    return np.argwhere(~binary_dilation(used, np.ones((3, 3), bool)))
