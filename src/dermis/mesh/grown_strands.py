"""Growth of strands from a groom on the CPU, as in strands_grow.wgsl, for exports and path tracing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Ints, Mask
from dermis.mesh.groom import HIDDEN_CEILING_MM, KNOTS_PER_GUIDE, Groom, Guides
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.skin_grid import SkinGrid
from dermis.mesh.strands import Roots, Strands, offsets_in_root_axes, root_frames

UInt32s = NDArray[np.uint32]
MAX_EXPORTED_STRANDS = 40_000
"""Largest number of strands in exports and in path tracing."""
_SMOOTHING_KNOTS, _SMOOTH_HEIGHTS_MM = 8, (2.0, 18.0)
_MIN_HEIGHT_ABOVE_SKIN_MM, _RISE_LENGTH_MM = 0.35, 4.0
# Constants near the hairline, as in strands_grow.wgsl.
_HAIRLINE_FADE_MM, _SHORT_HAIR_HEIGHTS_MM, _HAIRLINE_NOISE_MM = (-5.0, 7.0), (-4.0, 14.0), 2.0
# Length, thickness and pull into clumps at the hairline, relative to those elsewhere.
_MIN_HAIRLINE_LENGTH, _MIN_HAIRLINE_THICKNESS, _MIN_HAIRLINE_CLUMPING = 0.55, 0.35, 0.25
_CLUMPING_HEIGHTS_MM = 0.0, 22.0
_BABY_DROP_MM, _BABY_HEIGHTS_MM, _BABY_LENGTHS_MM = 4.0, (4.0, 24.0), (3.0, 17.0)
_BABY_THICKNESS, _BABY_TURN = 0.42, 0.35
_TEMPLE_HEIGHTS_MM, _TEMPLE_DEGREES = (90.0, -10.0), (140.0, 95.0)
_HAIRLINE_STEP_DEGREES = 2.0
_TIP_FRACTION, _TIP_WIDTH_RATIO = 0.12, 0.35
_HAIRS_SAMPLED_PER_STRAND = 5
_HEAD_RADIUS_MM, _LIFTED_HEIGHT_MM = 80.0, 20.0
_STRANDS_PER_CHUNK = 4_000  # strands that are grown at once
_FALLBACK_AXIS = np.array([0.31, 0.2, 0.93])


def grow_strands(
    groom: Groom, mesh: Mesh, points_mm: NDArray[np.floating], max_strands: int = MAX_EXPORTED_STRANDS
) -> Strands:
    """Return the strands that grow from the roots of a groom on a posed skin.

    The radius of knots that headwear hides is 0.

    mesh : mesh of quads on which the strands are rooted
    points_mm : (p, 3) points of the mesh in a pose [mm]
    max_strands : largest number of roots to use; if the groom has more, the strands are widened to keep
        coverage
    """
    count = min(len(groom), max_strands)
    guides = posed_guide_knots(groom.guides, points_mm)
    scale = groom.possible / max(count, 1)
    roots = Roots(groom.roots.roots.quad[:count], groom.roots.roots.position[:count])
    root_mm, frames = root_frames(mesh, roots, points_mm)
    middle = groom.roots.clump[:count]
    every = groom.roots.roots
    middles = Roots(every.quad.take(middle), every.position.take(middle, axis=0))
    middle_mm, _ = root_frames(mesh, middles, points_mm)
    grown, skin = _growing_root_indices(groom, count), SkinGrid(mesh, points_mm)
    parts = [
        _grow_chunk(groom, guides, skin, index, root_mm[index], frames[index], middle_mm[index])
        for index in np.array_split(grown, max(1, -(-len(grown) // _STRANDS_PER_CHUNK)))
    ]
    knots, radius, absorption, cover = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    kept = Roots(roots.quad[grown], roots.position[grown])
    types = np.float32
    return Strands(
        kept, knots, (scale * radius).astype(types), (absorption / scale).astype(types), cover.astype(types)
    )


def hair_strands(head: Head, points_mm: NDArray[np.floating] | None = None) -> Strands | None:
    """Return the visible strands of a head's hair for path tracing; None for a head without hair.

    points_mm : (p, 3) points of the mesh in a pose; at rest by default [mm]
    """
    if head.hair is None:
        return None
    points = head.mesh.points_mm if points_mm is None else points_mm
    return grow_strands(head.hair, head.mesh, points).without_hidden


def is_beard(groom: Groom, max_strands: int = MAX_EXPORTED_STRANDS) -> Mask:
    """Return a mask (n,) of the strands of `grow_strands` that belong to the beard."""
    part = groom.roots.part[_growing_root_indices(groom, min(len(groom), max_strands))]
    return np.asarray(groom.parameters["hairline"][part] == 0.0)


def mean_hair_absorptance(groom: Groom) -> float:
    """Return the mean fraction of diffuse light that a single hair absorbs [-].

    The mean is over the colour channels, and over scalp hair and beard by the area that they cover.
    """
    parts = groom.parameters
    chord = 0.5 * np.pi * (parts["radius_mm"] / parts["hairs_per_strand"])[:, None]
    natural = np.maximum((1.0 - parts["grey"][:, None]) * parts["dark"], parts["white"])
    absorption = np.where(parts["dyed"][:, None] > 0.0, parts["dye"], natural)
    weights = np.maximum(parts["density"] * parts["cover"], 1e-6)
    return float(np.average((1.0 - np.exp(-absorption * chord)).mean(axis=1), weights=weights))


class _Curves(NamedTuple):
    """Points of n curves that are interpolated between guides.

    position, normal, tangent : (n, k, 3) positions [mm], skin normals and tangents at the points
    height : (n, k) heights of the points above the skin [mm]
    ceiling : (n, k) largest heights there, below headwear [mm]
    """

    position: Doubles
    height: Doubles
    normal: Doubles
    tangent: Doubles
    ceiling: Doubles


def posed_guide_knots(guides: Guides, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
    """Return the knots (g, k, 3) of the guides on a posed skin [mm], and unit normals of the skin below them.

    points_mm : (p, 3) points of the mesh in a pose [mm]
    """
    middle, axes = guide_frames(guides, points_mm)
    normal = axes[..., 2, :]
    knots = middle + np.einsum("gkaic,gkai->gkac", axes, guides.local_mm)
    weight = guides.weight[..., None]
    bound, outward = (weight * knots).sum(axis=2), _unit_vectors((weight * normal).sum(axis=2))
    moved, total = bound - guides.rest_mm[..., :3], 0.0
    smooth = np.zeros_like(moved)
    for step in range(-_SMOOTHING_KNOTS, _SMOOTHING_KNOTS + 1):
        factor = 1.0 - abs(step) / (_SMOOTHING_KNOTS + 1)
        smooth += factor * moved[:, np.clip(np.arange(KNOTS_PER_GUIDE) + step, 0, KNOTS_PER_GUIDE - 1)]
        total += factor
    far = _smoothstep(*_SMOOTH_HEIGHTS_MM, guides.rest_mm[..., 3].astype(np.float64))[..., None]
    return (1.0 - far) * bound + far * (guides.rest_mm[..., :3] + smooth / total), outward


def guide_frames(guides: Guides, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
    """Return the middles (g, k, m, 3) and the axes (g, k, m, 3, 3), as rows, of the quads of guides [mm].

    points_mm : (p, 3) points of the mesh in a pose [mm]
    """
    a, b, c, d = np.moveaxis(points_mm.astype(np.float64)[guides.corner], -2, 0)
    along = _unit_vectors((b - a) + (c - d))
    across = np.cross(c - a, d - b)
    normal = _unit_vectors(across - (across * along).sum(axis=-1, keepdims=True) * along)
    return 0.25 * (a + b + c + d), np.stack([along, np.cross(normal, along), normal], axis=-2)


def _grow_chunk(
    groom: Groom,
    posed_guides: tuple[Doubles, Doubles],
    skin_grid: SkinGrid,
    strand_index: Ints,
    root_mm: Doubles,
    root_axes: Doubles,
    clump_centre_mm: Doubles,
) -> tuple[NDArray[np.float32], Doubles, Doubles, Doubles]:
    """Return the knots, radii, absorption coefficients and `cover` of n strands, as in `Strands`.

    posed_guides : knots of the posed guides, and skin normals below the knots
    skin_grid : grid of the posed skin, which keeps strands outside
    strand_index : (n,) indices of the strands
    root_mm : (n, 3) positions of the roots [mm]
    root_axes : (n, 3, 3) axes of the coordinate system at each root, as rows
    clump_centre_mm : (n, 3) root of the strand at the centre of each strand's clump [mm]
    """
    roots, seed = groom.roots, groom.parameters["seed"].astype(np.uint32) * np.uint32(131071)
    part = groom.parameters[roots.part[strand_index]]
    strand_seed = strand_index.astype(np.uint32) + seed[roots.part[strand_index]]
    clump = roots.clump[strand_index]
    clump_seed = clump.astype(np.uint32) + seed[roots.part[strand_index]]
    edge = _hairline_effects(groom, strand_index)
    t = np.linspace(0.0, 1.0, groom.knots)[None]
    length = _length_fractions(groom, strand_index, edge)
    u = t * length[:, None]
    own, at = (
        _interpolate_guides(groom, posed_guides, strand_index, u, root_mm),
        _interpolate_guides(groom, posed_guides, clump, u, clump_centre_mm),
    )
    s = u * _parameter_column(part, "guide_mm")
    near = 1.0 - np.exp(-((s / _parameter_column(part, "clump_start_mm")) ** 1.5))
    rope = _parameter_column(part, "rope_mm") > 0
    loosened = _MIN_HAIRLINE_CLUMPING + (1.0 - _MIN_HAIRLINE_CLUMPING) * _smoothstep(
        *_CLUMPING_HEIGHTS_MM, edge.above_mm
    )
    loose = 1.0 + part["hairline"] * (loosened - 1.0)
    grown, pulled = 1.0 - edge.baby[:, None], (0.6 + 0.4 * _uniform_random(strand_seed, 2)) * loose
    pull = _parameter_column(part, "clump") * near * grown * np.where(rope, 1.0, pulled[:, None])
    side, other = _cross_section_axes(at)
    to_middle = pull[..., None] * (at.position - own.position)
    across = (
        near
        * np.where(rope, grown, 0.0)
        * _rope_offsets(strand_seed, part, s + roots.along_mm[strand_index, None])
    )
    across = across + np.where(rope, 0.0, 1.0) * _curl_offsets(
        strand_seed, clump_seed, part, s, roots.place[clump]
    )
    across = across + _frizz_offsets(strand_seed, part, s)
    across[0] += (edge.baby * _BABY_TURN * _normal_random(strand_seed, 35))[:, None] * s
    varied = across[0][..., None] * side + across[1][..., None] * other
    height = (1.0 - pull) * own.height + pull * at.height + (varied * own.normal).sum(axis=-1)
    least = _MIN_HEIGHT_ABOVE_SKIN_MM * np.minimum(s / _RISE_LENGTH_MM, 1.0)
    lift = np.maximum(least - height, 0.0) + np.minimum(np.maximum(own.ceiling, least) - height, 0.0)
    positions = own.position + to_middle + varied + lift[..., None] * own.normal
    above = s > 0.0
    positions[above] = skin_grid.push_out(positions[above], least[above], s[above])
    taper = 1.0 - (1.0 - _TIP_WIDTH_RATIO) * _smoothstep(1.0 - _TIP_FRACTION, 1.0, t)
    thinned = _MIN_HAIRLINE_THICKNESS + (1.0 - _MIN_HAIRLINE_THICKNESS) * _smoothstep(
        *_SHORT_HAIR_HEIGHTS_MM, edge.above_mm
    )
    thickness = 1.0 + part["hairline"] * (
        np.minimum(thinned, 1.0 + edge.baby * (_BABY_THICKNESS - 1.0)) - 1.0
    )
    radius = (part["radius_mm"] * (0.8 + 0.4 * _uniform_random(strand_seed, 3)) * thickness)[:, None] * taper
    radius *= own.ceiling >= HIDDEN_CEILING_MM
    return (
        offsets_in_root_axes(root_axes, positions - root_mm[:, None]),
        radius,
        _strand_absorption(strand_seed, part, roots.place[strand_index], length * part["guide_mm"]),
        part["cover"],
    )


def _parameter_column(hair_parameters: NDArray[np.void], parameter_name: str) -> Doubles:
    return hair_parameters[parameter_name].astype(np.float64)[:, None]


def _uniform_random(strand_seed: UInt32s, stream: int) -> Doubles:
    """Return a uniform random number (n,) for each strand, 0 to 1.

    strand_seed : (n,) numbers that identify the strands
    stream : number that selects one of several random numbers of a strand

    Source: PCG hash [Jarzynski2020].
    """
    with np.errstate(over="ignore"):
        state = (strand_seed * np.uint32(64) + np.uint32(stream)) * np.uint32(747796405) + np.uint32(
            2891336453
        )
        word = ((state >> ((state >> np.uint32(28)) + np.uint32(4))) ^ state) * np.uint32(277803737)
        return np.asarray((((word >> np.uint32(22)) ^ word) >> np.uint32(8)) / 16777216.0)


def _normal_random(strand_seed: UInt32s, stream: int) -> Doubles:
    return np.asarray(2.0 * (sum(_uniform_random(strand_seed, stream + k) for k in range(3)) - 1.5))


def _heights_above_hairline(groom: Groom, strand_index: Ints) -> Doubles:
    place = groom.roots.place[strand_index]
    angles = _HAIRLINE_STEP_DEGREES * np.arange(len(groom.hairline_mm))
    return np.asarray(place[:, 1] - np.interp(place[:, 0], angles, groom.hairline_mm))


class _HairlineEffects(NamedTuple):
    """Properties of n strands that depend on the distance of their roots from the hairline.

    above_mm : (n,) heights of the roots above the hairline, with a random variation [mm]
    baby : (n,) 1 for baby hairs, 0 for others
    part, seed : (n,) row of `Groom.parameters` for each strand, and its random seed for `_uniform_random`
    """

    above_mm: Doubles
    baby: Doubles
    part: NDArray[np.void]
    seed: UInt32s


def _hairline_effects(groom: Groom, strand_index: Ints) -> _HairlineEffects:
    rows = groom.roots.part[strand_index]
    part = groom.parameters[rows]
    seeds = groom.parameters["seed"].astype(np.uint32) * np.uint32(131071)
    seed = strand_index.astype(np.uint32) + seeds[rows]
    above = _heights_above_hairline(groom, strand_index) + _HAIRLINE_NOISE_MM * _normal_random(seed, 30)
    chance = part["hairline"] * part["baby_hairs"] * (1.0 - _smoothstep(*_BABY_HEIGHTS_MM, above))
    return _HairlineEffects(above, (_uniform_random(seed, 33) < chance).astype(np.float64), part, seed)


def _growing_root_indices(groom: Groom, root_count: int) -> Ints:
    """Return the indices of the roots from which a strand grows, among the first `root_count` roots."""
    index = np.arange(root_count, dtype=np.int32)
    edge, place = _hairline_effects(groom, index), groom.roots.place[:root_count]
    fade = _smoothstep(*_HAIRLINE_FADE_MM, edge.above_mm + _BABY_DROP_MM * edge.baby)
    density = 1.0 + edge.part["hairline"] * (fade - 1.0)
    density = density * edge.part["density"] * (1.0 - edge.part["thinning"] * place[:, 2])
    seeds = groom.parameters["seed"].astype(np.uint32) * np.uint32(131071)
    offset = _uniform_random(seeds, 0)[groom.roots.part[:root_count]]
    threshold = np.modf(groom.roots.threshold[:root_count] + offset)[0]
    return np.flatnonzero(threshold < density).astype(np.int32)


def _length_fractions(groom: Groom, strand_index: Ints, hairline_effects: _HairlineEffects) -> Doubles:
    """Return the length (n,) of each strand as a fraction of the length of its guides.

    strand_index : (n,) indices of the strands
    hairline_effects : properties of the strands that depend on the hairline
    """
    roots, (above_mm, baby, part, seed) = groom.roots, hairline_effects
    cut = (roots.guide_weight[strand_index] * groom.guides.cut[roots.guide[strand_index]]).sum(axis=1)
    sides = 1.0 - part["fade"] * (1.0 - roots.place[strand_index, 3])
    shortened = _MIN_HAIRLINE_LENGTH + (1.0 - _MIN_HAIRLINE_LENGTH) * _smoothstep(
        *_SHORT_HAIR_HEIGHTS_MM, above_mm
    )
    whole = 1.0 + part["hairline"] * (shortened - 1.0)
    length = np.minimum(cut, part["length_mm"] / part["guide_mm"] * sides) * whole
    shortest, longest = _BABY_LENGTHS_MM
    short = np.minimum(
        length, (shortest + (longest - shortest) * _uniform_random(seed, 34)) / part["guide_mm"]
    )
    return np.asarray((length + baby * (short - length)) * (1.0 - part["layers"] * _uniform_random(seed, 1)))


def _interpolate_guides(
    groom: Groom,
    posed_guides: tuple[Doubles, Doubles],
    strand_index: Ints,
    guide_position: Doubles,
    root_mm: Doubles,
) -> _Curves:
    """Return curves of strands, interpolated between the guides of each strand.

    posed_guides : knots of the posed guides, and skin normals below the knots
    strand_index : (n,) indices of the strands
    guide_position : (n, k) positions of points along the guides, 0 at the root to 1 at the tip
    root_mm : (n, 3) positions of the roots [mm]
    """
    knots, normals = posed_guides
    at = np.clip(guide_position, 0.0, 1.0) * (KNOTS_PER_GUIDE - 1)
    first = np.minimum(at.astype(np.int64), KNOTS_PER_GUIDE - 2)
    part = (at - first)[..., None]
    around = np.stack(
        [np.maximum(first, 1) - 1, first, first + 1, np.minimum(first + 2, KNOTS_PER_GUIDE - 1)]
    )
    value, slope = _spline_weights(at - first)
    height_mm, ceiling_mm = groom.guides.rest_mm[..., 3], groom.guides.ceilings_mm
    position = np.repeat(root_mm[:, None], guide_position.shape[1], axis=1)
    normal, tangent, middle = (np.zeros_like(position) for _ in range(3))
    height, square, ceiling = (np.zeros(guide_position.shape) for _ in range(3))
    for k in range(4):
        guide, weight = (
            groom.roots.guide[strand_index, k][:, None],
            groom.roots.guide_weight[strand_index, k][:, None, None],
        )
        near = knots[guide[None], around]
        here = np.einsum("jnk,jnkc->nkc", value, near)
        position += weight * (here - knots[guide, 0])
        middle += weight * (here - root_mm[:, None])
        square += weight[..., 0] * ((here - root_mm[:, None]) ** 2).sum(axis=-1)
        normal += weight * ((1.0 - part) * normals[guide, first] + part * normals[guide, first + 1])
        tangent += weight * np.einsum("jnk,jnkc->nkc", slope, near)
        height += weight[..., 0] * (value * height_mm[guide[None], around]).sum(axis=0)
        low, high = ceiling_mm[guide, first], ceiling_mm[guide, first + 1]
        ceiling += weight[..., 0] * (low + part[..., 0] * (high - low))
    normal = _unit_vectors(normal)
    close = 1.0 / (1.0 + (np.maximum(height, 0.0) / _LIFTED_HEIGHT_MM) ** 2)
    sag = close * np.maximum(square - (middle**2).sum(axis=-1), 0.0) / (2.0 * _HEAD_RADIUS_MM)
    position += sag[..., None] * normal
    return _Curves(position, height, normal, _unit_vectors(tangent + 1e-9 * normal), ceiling)


def _spline_weights(t: Doubles) -> tuple[Doubles, Doubles]:
    """Return the weights (4, n, k) of four knots in a Catmull-Rom spline, and those in its derivative.

    t : (n, k) positions between the second and the third knot, 0 to 1
    """
    cubic, square = t**3, t**2
    value = (
        2 * square - cubic - t,
        3 * cubic - 5 * square + 2,
        4 * square - 3 * cubic + t,
        cubic - square,
    )
    slope = 4 * t - 3 * square - 1, 9 * square - 10 * t, 8 * t - 9 * square + 1, 3 * square - 2 * t
    return 0.5 * np.stack(value), 0.5 * np.stack(slope)


def _cross_section_axes(curves: _Curves) -> tuple[Doubles, Doubles]:
    """Return two unit vectors (n, k, 3) at each point, orthogonal to the tangent and to each other."""
    side = np.cross(curves.tangent, curves.normal)
    upright = (side**2).sum(axis=-1, keepdims=True) < 0.08
    side = _unit_vectors(np.where(upright, np.cross(curves.tangent, _FALLBACK_AXIS), side))
    return side, np.cross(side, curves.tangent)


def _rope_offsets(strand_seed: UInt32s, hair_parameters: NDArray[np.void], length_mm: Doubles) -> Doubles:
    """Return the offsets (2, n, k) of strands from the centre line of their twist or braid [mm].

    The first axis is for the two directions of `_cross_section_axes`.

    strand_seed : (n,) random seeds of the strands, for `_uniform_random`
    hair_parameters : (n,) row of `Groom.parameters` for each strand
    length_mm : (n, k) lengths from the root along the rope [mm]
    """
    rope = np.maximum(_parameter_column(hair_parameters, "rope_mm"), 1e-6)
    radius, turn = (
        rope * np.sqrt(_uniform_random(strand_seed, 4))[:, None],
        2 * np.pi * _uniform_random(strand_seed, 5)[:, None],
    )
    bundle = np.floor(3.0 * _uniform_random(strand_seed, 6))[:, None]
    phase = 2 * np.pi * (length_mm / (8.0 * rope) + bundle / 3.0)
    middle = rope * np.sin(phase), 0.45 * rope * np.sin(2 * phase)
    braided = np.stack([middle[0] + 0.5 * radius * np.cos(turn), middle[1] + 0.5 * radius * np.sin(turn)])
    phase = turn + 2 * np.pi * length_mm / (7.0 * rope)
    twisted = np.stack([radius * np.cos(phase), radius * np.sin(phase)])
    return np.where(_parameter_column(hair_parameters, "braid") > 0, braided, twisted)


def _curl_offsets(
    strand_seed: UInt32s,
    clump_seed: UInt32s,
    hair_parameters: NDArray[np.void],
    length_mm: Doubles,
    clump_place: NDArray[np.floating],
) -> Doubles:
    """Return the offsets (2, n, k) by which curls displace the points of strands [mm].

    The first axis is for the two directions of `_cross_section_axes`.

    strand_seed, clump_seed : (n,) random seeds of the strands and of their clumps, for `_uniform_random`
    hair_parameters : (n,) row of `Groom.parameters` for each strand
    length_mm : (n, k) lengths from the root along the strand [mm]
    clump_place : (n, 4) rows of `StrandRoots.place` of the strands at the middle of the clumps
    """
    spread = hair_parameters["clump_phases"].astype(np.float64)
    varied = 1.0 + 0.3 * spread * (_uniform_random(clump_seed, 8) - 0.5)
    pitch = _parameter_column(hair_parameters, "pitch_mm") * varied[:, None]
    wave = 0.2 * np.sin(0.07 * clump_place[:, 0]) - 0.5 * clump_place[:, 1] / hair_parameters["pitch_mm"]
    shift = (1.0 - spread) * wave + spread * _uniform_random(clump_seed, 9)
    shift = shift + hair_parameters["incoherence"] * _uniform_random(strand_seed, 7)
    phase = 2 * np.pi * (length_mm / pitch + shift[:, None])
    radius = (
        _parameter_column(hair_parameters, "curl_mm")
        * (0.75 + 0.5 * _uniform_random(strand_seed, 10))[:, None]
    )
    radius = radius * np.minimum(
        length_mm / (0.5 * _parameter_column(hair_parameters, "pitch_mm") + 4.0), 1.0
    )
    return np.stack([radius * np.cos(phase), radius * np.sin(phase)])


def _frizz_offsets(strand_seed: UInt32s, hair_parameters: NDArray[np.void], length_mm: Doubles) -> Doubles:
    """Return smooth random offsets (2, n, k) by which frizz displaces the points of strands [mm].

    The first axis is for the two directions of `_cross_section_axes`.

    strand_seed : (n,) random seeds of the strands, for `_uniform_random`
    hair_parameters : (n,) row of `Groom.parameters` for each strand
    length_mm : (n, k) lengths from the root along the strand [mm]
    """
    amount = hair_parameters["frizz_mm"] * np.where(
        _uniform_random(strand_seed, 11) < hair_parameters["flyaways"], 5.0, 1.0
    )
    amount = amount[:, None] * np.minimum(length_mm / 25.0, 1.0)
    x, y = (2 * np.pi * _uniform_random(strand_seed, stream)[:, None] for stream in (12, 13))
    slow, fast = 2 * np.pi * length_mm / 90.0, 2 * np.pi * length_mm / 31.0
    waves = np.sin(slow + x) + 0.4 * np.sin(fast + y), np.cos(slow + y) + 0.4 * np.cos(fast + x)
    return np.stack(
        [
            amount * _normal_random(strand_seed, k)[:, None] * wave
            for k, wave in zip((14, 17), waves, strict=True)
        ]
    )


def _strand_absorption(
    strand_seed: UInt32s, hair_parameters: NDArray[np.void], place: NDArray[np.floating], length_mm: Doubles
) -> Doubles:
    """Return the absorption coefficients (n, 3) of strands [1/mm].

    Each strand represents several hairs, some of which may be white. The absorption of a dyed strand is
    the mean over its length.

    strand_seed : (n,) random seeds of the strands, for `_uniform_random`
    hair_parameters : (n,) row of `Groom.parameters` for each strand
    place : (n, 4) rows of `StrandRoots.place`
    length_mm : (n,) lengths of the strands [mm]
    """
    angle, height = place[:, :2].astype(np.float64).T
    temple = _smoothstep(*_TEMPLE_HEIGHTS_MM, height) * _smoothstep(*_TEMPLE_DEGREES, angle)
    greyed = hair_parameters["grey"] + hair_parameters["temple_grey"] * hair_parameters["hairline"] * temple
    white = (
        sum(_uniform_random(strand_seed, 20 + k) < greyed for k in range(_HAIRS_SAMPLED_PER_STRAND))
        / _HAIRS_SAMPLED_PER_STRAND
    )
    white = np.asarray(white)[:, None]
    dark = hair_parameters["dark"] * np.exp(0.12 * _normal_random(strand_seed, 26))[:, None]
    mixed = (1.0 - white) ** 2 * ((1.0 - white) * dark + white * dark.mean(axis=1, keepdims=True))
    natural = np.maximum(mixed, hair_parameters["white"])
    undyed = np.clip(hair_parameters["roots_mm"] / np.maximum(length_mm, 1e-3), 0.002, 0.998)
    dyed = (hair_parameters["dyed"] * (1.0 - undyed))[:, None]
    return np.asarray(
        (natural + dyed * (hair_parameters["dye"] - natural)) / hair_parameters["hairs_per_strand"][:, None]
    )


def _unit_vectors(vectors: Doubles) -> Doubles:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def _smoothstep(low: float, high: float, x: Doubles) -> Doubles:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
