"""Complete hair of a person: scalp hair, beard, brows and lashes as strands.

Roots of brows and lashes are computed once, on the mean person; they apply to all people, because all of
their meshes have the same quads.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.hair import brows, lashes
from dermis.human.hair.brows import BrowSurface
from dermis.human.hair.density import skin_vertices_near_brows
from dermis.human.hair.head_hair import make_groom
from dermis.human.hair.look import HairLook
from dermis.human.hair.root_finder import SIDE_SIGNS, RootFinder, eye_centres
from dermis.human.hair.skin_surface import GrowthSurface, HairGroup, RootFrames, SkinSurface
from dermis.mesh.head import Head
from dermis.mesh.strands import Roots, Strands, offsets_in_root_axes
from dermis.specular.hair import absorption_per_mm

_BROW_PIGMENT_FACTOR, _LASH_PIGMENT_FACTOR = 1.3, 3.0


def add_hair(
    head: Head,
    control_head: Head,
    root_finder: RootFinder,
    hair_look: HairLook,
    recession: float = 0.0,
    hair_fraction: float = 1.0,
) -> Head:
    """Return a head with strands for scalp hair, beard, brows and lashes.

    head, control_head : the subdivided head, and the same head before subdivision
    root_finder : root finder of the mean person, on whom brows and lashes are defined
    hair_look : length, density, curl and colour of the hair
    recession : recession of the hairline, 0 to 1, see `SkinLook`
    hair_fraction : fraction of scalp and beard hairs to generate; the hairs are widened by the inverse of
        this fraction, so that coverage stays the same
    """
    near = skin_vertices_near_brows(root_finder)
    skin = SkinSurface(head.mesh.positions[near], head.mesh.normals[near])
    surface = GrowthSurface(head, control_head.mesh, skin, hair_fraction)
    rngs = [np.random.default_rng((hair_look.seed, int(side > 0))) for side in SIDE_SIGNS]
    left, right = _grow_brows(surface, root_finder, hair_look, rngs)
    rows = list(_grow_lashes(surface, root_finder, eye_centres(control_head.mesh), rngs))
    groups = [left, *rows[:2], right, *rows[2:]]
    strands = _join_groups(groups, _fine_hair_absorption(groups, hair_look))
    is_lash = np.repeat([False, True, True, False, True, True], [len(group.radius) for group in groups])
    strands = replace(strands, is_lash=is_lash)
    groom = make_groom(hair_look, recession, root_finder, head.levels, hair_fraction)
    return replace(head, strands=strands, hair=groom)


def _grow_brows(
    surface: GrowthSurface, root_finder: RootFinder, hair_look: HairLook, rngs: list[np.random.Generator]
) -> Iterator[HairGroup]:
    """Yield the hairs of the left brow and then those of the right brow.

    root_finder : root finder of the mean person
    rngs : random generators for the left and for the right brow
    """
    roots, parameters = [], []
    for side, rng in zip(SIDE_SIGNS, rngs, strict=True):
        u, v, x, y = brows.sample_positions(rng)
        found, hit = root_finder.front_roots(side * x, y)
        index = np.flatnonzero(hit)[: brows.hair_count(hair_look)]
        roots.append(Roots(found.quad[index], found.position[index]))
        shape = brows.sample_shapes(u[index], v[index], rng, hair_look)
        parameters.append(np.vstack([np.full(len(index), side), x[index], y[index], shape]))
    frames, hair = surface.root_frames(_concatenate_roots(roots)), np.concatenate(parameters, axis=1)
    grid_mm = surface.root_frames(root_finder.brow_grid_roots).positions_mm
    brow_surface = BrowSurface(*surface.skin.project(grid_mm))
    knots, radius = brows.grow_brow_hairs(brow_surface, frames.positions_mm, hair[0], hair[1:3], hair[3:])
    yield from _split_group(
        _hair_group(frames, knots, radius, _BROW_PIGMENT_FACTOR), [len(part.quad) for part in roots]
    )


def _grow_lashes(
    surface: GrowthSurface, root_finder: RootFinder, eyes: Doubles, rngs: list[np.random.Generator]
) -> Iterator[HairGroup]:
    """Yield the upper lashes and the lower lashes of the left eye, then those of the right eye.

    root_finder : root finder of the mean person
    eyes : (2, 3) centres of the left and the right eye [mm]
    rngs : random generators for the lashes of the left eye and for those of the right eye
    """
    roots, parameters, clumps = [], [], 0
    for side, eye, rng in zip(SIDE_SIGNS, eyes, rngs, strict=True):
        for row in (lashes.UPPER_LASHES, lashes.LOWER_LASHES):
            u, across = lashes.sample_positions(row, rng)
            roots.append(root_finder.lid_edge_roots(row, side, u, across))
            shape = lashes.sample_shapes(row, u, rng, clumps)
            parameters.append(np.vstack([np.full((len(u), 4), [side, *eye]).T, shape]))
            clumps += len(u) + 1
    frames, hair = surface.root_frames(_concatenate_roots(roots)), np.concatenate(parameters, axis=1)
    knots, radius = lashes.grow_lashes(frames.positions_mm, hair[1:4].T, hair[0], hair[4:])
    group = _hair_group(frames, knots, radius, _LASH_PIGMENT_FACTOR)
    yield from _split_group(group, [len(part.quad) for part in roots])


def _split_group(hair_group: HairGroup, hair_counts: list[int]) -> Iterator[HairGroup]:
    """Yield consecutive slices of a hair group; `hair_counts` holds the number of hairs in each slice."""
    for end, count in zip(np.cumsum(hair_counts).tolist(), hair_counts, strict=True):
        part = slice(end - count, end)
        roots = Roots(hair_group.roots.quad[part], hair_group.roots.position[part])
        yield hair_group._replace(roots=roots, knots=hair_group.knots[part], radius=hair_group.radius[part])


def _hair_group(
    root_frames: RootFrames, knots_mm: Doubles, radius_mm: Doubles, pigment_factor: float
) -> HairGroup:
    """Return a hair group, with knots converted from the coordinates of the head to the root frames.

    root_frames : roots of the n hairs, with their frames
    knots_mm, radius_mm : (n, k, 3) positions and (n, k) radii of the knots [mm]
    pigment_factor : pigment concentrations, divided by the concentrations in the person's look [-]
    """
    offsets = offsets_in_root_axes(root_frames.frame, knots_mm - root_frames.positions_mm[:, None])
    return HairGroup(root_frames.roots, offsets, radius_mm.astype(np.float32), pigment_factor)


def _join_groups(hair_groups: list[HairGroup], absorption: Doubles) -> Strands:
    """Return the strands of several hair groups as one object.

    absorption : (n, 3) absorption coefficients of single hairs [1/mm]; a strand that represents several hairs
        gets a lower coefficient
    """
    roots = _concatenate_roots(group.roots for group in hair_groups)
    knots, radius = (np.concatenate([group[k] for group in hair_groups]) for k in (1, 2))
    hairs_per_strand, cover = (_repeat_per_hair(hair_groups, name) for name in ("hairs_per_strand", "cover"))
    strand_absorption = (absorption / hairs_per_strand[:, None]).astype(np.float32)
    return Strands(roots, knots, radius, strand_absorption, cover.astype(np.float32))


def _concatenate_roots(root_groups: Iterable[Roots]) -> Roots:
    quads, positions = zip(*root_groups, strict=True)
    return Roots(np.concatenate(quads), np.concatenate(positions))


def _repeat_per_hair(hair_groups: list[HairGroup], field_name: str) -> Doubles:
    """Return for each hair the value (n,) of a scalar field of its group, such as "cover"."""
    return np.concatenate([np.full(len(group.radius), getattr(group, field_name)) for group in hair_groups])


def _fine_hair_absorption(hair_groups: list[HairGroup], hair_look: HairLook) -> Doubles:
    """Return absorption coefficients (n, 3) of brow and lash hairs, some of them white at random [1/mm]."""
    rng, pigment_factor = (
        np.random.default_rng((hair_look.seed, 2)),
        _repeat_per_hair(hair_groups, "pigment_factor"),
    )
    n = len(pigment_factor)
    amount = pigment_factor * rng.lognormal(0.0, 0.15, n) * (rng.random(n) >= hair_look.grey)
    return absorption_per_mm(amount * hair_look.eumelanin, amount * hair_look.pheomelanin)
