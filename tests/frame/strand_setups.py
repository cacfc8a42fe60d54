"""A sheet of quads with straight hairs over it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.human.hair.guides import bind_guides
from dermis.human.hair.head_hair import HAIR_PARAMETERS_DTYPE
from dermis.mesh.geometry import split_quads
from dermis.mesh.groom import KNOTS_PER_GUIDE, Groom, StrandRoots
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.strands import Roots, Strands, quad_corners, root_frames, to_root_frames

SIDE_MM = 100.0
_CELLS = 4


def sheet() -> Mesh:
    """Return a square of quads in the XY plane about the origin that faces +Z."""
    along = np.linspace(0, 1, _CELLS + 1)
    v, u = (axis.ravel() for axis in np.meshgrid(along, along, indexing="ij"))
    number = np.arange((_CELLS + 1) ** 2).reshape(_CELLS + 1, _CELLS + 1)
    around = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    quads = np.stack([part.ravel() for part in around], axis=1)
    places = SIDE_MM * np.column_stack((u - 0.5, 0.5 - v, np.zeros_like(u)))
    pairs = np.arange(2 * len(quads)).reshape(-1, 2)
    flat, skin = np.zeros(2 * len(quads), np.int32), (Material("skin"),)
    return build_mesh(places, np.column_stack((u, v)), split_quads(quads), flat, skin, quads=pairs)


def hairy(
    begins: ArrayLike, ends: ArrayLike, radius_mm: ArrayLike, absorption: ArrayLike = 0.0, knots: int = 5
) -> Head:
    """Return a white sheet with straight strands between (n, 3) points [mm].

    absorption : [1/mm]
    """
    mesh, count = sheet(), len(np.asarray(begins))
    roots = Roots(np.zeros(count, np.int32), np.full((count, 2), 0.5, np.float32))
    t = np.linspace(0, 1, knots)[None, :, None]
    places = (1 - t) * np.asarray(begins, float)[:, None] + t * np.asarray(ends, float)[:, None]
    root, _ = root_frames(mesh, roots, mesh.points_mm)
    radius = np.broadcast_to(np.asarray(radius_mm, np.float32), (count,))
    strands = Strands(
        roots,
        to_root_frames(mesh, roots, places - root[:, None]),
        np.repeat(radius[:, None], knots, axis=1),
        np.broadcast_to(np.asarray(absorption, np.float32), (count, 3)).copy(),
    )
    return Head("sheet", mesh, Maps(colour=np.ones((4, 4, 3), np.float32)), strands=strands)


def woolly(
    begins: NDArray[np.float64], ends: NDArray[np.float64], radius_mm: float, absorption: float, cover: float
) -> Head:
    """Return a white sheet with straight coarse strands between (n, 3) points, each along a guide [mm]."""
    mesh, count = sheet(), len(begins)
    points_mm = mesh.points_mm
    t = np.linspace(0.0, 1.0, KNOTS_PER_GUIDE)[None, :, None]
    knots = (1.0 - t) * begins[:, None] + t * ends[:, None]
    guides = bind_guides(mesh, points_mm, knots, knots[..., 2], np.ones(count))
    corners = points_mm[quad_corners(mesh, np.arange(len(mesh.quads)))]
    quad = np.linalg.norm(corners.mean(axis=1)[None, :, :2] - begins[:, None, :2], axis=2).argmin(axis=1)
    a, b, _, d = corners[quad].swapaxes(0, 1)
    position = [((begins - a) * (side - a)).sum(axis=1) / ((side - a) ** 2).sum(axis=1) for side in (b, d)]
    roots = StrandRoots(
        roots=Roots(quad.astype(np.int32), np.stack(position, axis=1).astype(np.float32)),
        guide=np.repeat(np.arange(count, dtype=np.int32)[:, None], 4, axis=1),
        guide_weight=np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (count, 1)),
        clump=np.arange(count, dtype=np.int32),
        place=np.tile(np.array([0.0, 100.0, 0.0, 1.0], np.float32), (count, 1)),
        along_mm=np.zeros(count, np.float32),
        part=np.zeros(count, np.int32),
        threshold=np.zeros(count, np.float32),
    )
    part = np.zeros(1, HAIR_PARAMETERS_DTYPE)
    for name in ("density", "length_mm", "guide_mm", "clump_start_mm", "pitch_mm", "hairs_per_strand"):
        part[name] = 1.0
    part["radius_mm"], part["cover"], part["dark"] = radius_mm, cover, absorption
    centre = np.array([0.0, 0.0, 1.0])
    hair = Groom(guides, roots, part, count, count, 5, np.zeros(91, np.float32), centre)
    return Head("sheet", mesh, Maps(colour=np.ones((4, 4, 3), np.float32)), hair=hair)


def shuffled(head: Head, seed: int) -> Head:
    """Return a head with its strands in another order."""
    from dataclasses import replace

    strands = head.strands
    assert strands is not None
    order: NDArray[np.intp] = np.random.default_rng(seed).permutation(len(strands))
    roots = Roots(*(part[order] for part in strands.roots))
    parts = (strands.knots_mm, strands.radius_mm, strands.absorption)
    return replace(head, strands=Strands(roots, *(part[order] for part in parts)))
