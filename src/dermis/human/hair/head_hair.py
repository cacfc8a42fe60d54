"""Strands of scalp hair and beard: combed guide hairs, and randomly varied hairs interpolated from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats
from dermis.human.hair import density
from dermis.human.hair.density import HEAD_AXIS_Z, average_points, height_above_hairline, smoothstep
from dermis.human.hair.look import HairLook
from dermis.human.hair.skin_surface import (
    GrowthSurface,
    HairGroup,
    RootFrames,
    SkinSurface,
    tangent_component,
)
from dermis.mesh.geometry import compact_vertices, cross_columns, dot_columns
from dermis.mesh.strands import Roots, quad_corners, quad_weights

# Artist's values on the average person [mm].
_WHORL_CENTRE = np.array([9.0, 86.0, -131.0])
_WHORL_MM = 24.0  # radius of the spiral
_PARTING_X = 31.0  # position of the parting of short hair
_PARTING_WIDTH_MM = 9.0
_LENGTH_LEVEL_TILT = 0.15  # slope of the levels of equal length, higher in front
_CROPPED_RISE, _BEARD_RISE = (0.95, 0.75), (0.85, 0.35)  # angles of root and tip to the skin [rad]
_SHORT_RISE = (0.5, -0.05)  # angles of root and tip of short hair at the sides [rad]
_TOP_RISE = (0.55, -0.35)  # increase of these angles on top of the head [rad]
_TUFT_MM = 2.2  # size of the cells in which tips form tufts
_MIN_HEIGHT_MM = 0.35  # minimum height above the skin
_HEAD_RADIUS_MM = 85.0
_EPSILON = np.float32(1e-9)
MAX_PER_CM2 = 200.0
"""Density of the densest hair of the head [1/cm2]."""
BEARD_PER_CM2 = 60.0
"""Density of beards [1/cm2]."""
_HAIR_RADIUS_MM, _BEARD_RADIUS_MM = 0.034, 0.048
_TIP_RADIUS_FACTOR = 0.6  # radius at the tip relative to the root
_STRAIGHT_KNOTS, _CURVED_KNOTS, _COILED_KNOTS = 5, 7, 9
_COIL_CURL = 0.5  # curl above which hair coils
_LONG_BEARD_MM = 8.0


class GuideShape(NamedTuple):
    """Shape of guide hairs, from which the neighbouring hairs are interpolated.

    directions : (n, 3) unit tangents of the skin, along which the guides are traced
    length_mm : (n,) length of each guide [mm]
    rise, tip_rise : (n,) angles between the skin and the guide at its root and at its tip [rad]
    """

    directions: Doubles
    length_mm: Doubles
    rise: Doubles
    tip_rise: Doubles


def comb_scalp(points: Doubles, normals: Doubles, look: HairLook, recession: float) -> GuideShape:
    """Return the shapes of scalp guide hairs combed according to the hair style.

    points : (n, 3) positions of the guide roots on the average person [mm]
    normals : (n, 3) skin normals of the actual person at these roots
    look : style, length and fade of the hair
    recession : recession of the hairline, 0 to 1, see `SkinLook`
    """
    growth, top, n = _growth_directions(points, normals), _top_weight(points), len(points)
    edge = height_above_hairline(points, recession)
    if look.style == "cropped":
        length = look.length_mm * (0.55 + 0.45 * smoothstep(-2.0, 22.0, edge)) * (0.85 + 0.15 * top)
        return GuideShape(growth, length, *(np.full(n, rise) for rise in _CROPPED_RISE))
    high = points[:, 1] + _LENGTH_LEVEL_TILT * (points[:, 2] - HEAD_AXIS_Z)
    sides = 1.0 - look.fade * (1.0 - smoothstep(-45.0, 62.0, high))
    near = 0.3 + 0.7 * np.maximum(smoothstep(0.0, 35.0, edge), top)
    length = look.length_mm * np.minimum(sides, near)
    rise = (at_side + at_top * top for at_side, at_top in zip(_SHORT_RISE, _TOP_RISE, strict=True))
    return GuideShape(_combed_directions(points, normals, growth), length, *rise)


def comb_beard(points: Doubles, normals: Doubles, look: HairLook) -> GuideShape:
    """Return the shapes of beard guide hairs, which point down and slightly to the sides.

    points : (n, 3) positions of the guide roots on the average person [mm]
    normals : (n, 3) skin normals of the actual person at these roots
    """
    n = len(points)
    sideways = 0.4 * np.clip(points[:, 0] / 25.0, -1.0, 1.0)
    directions = tangent_directions(np.stack([sideways, np.full(n, -1.0), np.zeros(n)], axis=1), normals)
    return GuideShape(directions, np.full(n, look.beard_mm), *(np.full(n, rise) for rise in _BEARD_RISE))


def tangent_directions(offsets: Doubles, normals: Doubles) -> Doubles:
    """Return unit tangents (n, 3): vectors projected onto the tangent planes and normalised."""
    flat = tangent_component(offsets, normals)
    return np.asarray(flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9))


def rotate_about_normals(offsets: Doubles, normals: Doubles, angle: Doubles) -> Doubles:
    """Rotate tangent vectors (n, 3) counter-clockwise about unit normals (n, 3) by angles (n,) [rad]."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(c * offsets + s * np.cross(normals, offsets))


def _growth_directions(points: Doubles, normals: Doubles) -> Doubles:
    """Return directions (n, 3) of uncombed hair: in a spiral away from the whorl, down at sides and nape."""
    away = points - _WHORL_CENTRE
    spiral = 1.1 * np.exp(-(away**2).sum(axis=1) / _WHORL_MM**2)
    offsets = rotate_about_normals(tangent_directions(away, normals), normals, spiral)
    low = 1.2 * smoothstep(40.0, -30.0, points[:, 1])
    back = 0.35 * smoothstep(-120.0, -60.0, points[:, 2])
    down = np.stack([np.zeros(len(points)), -low, -low * back], axis=1)
    return tangent_directions(offsets + down, normals)


def _top_weight(points: Doubles) -> Doubles:
    """Return a blend weight (n,) for combing: 1 on top of the head, 0 at its sides and back."""
    return smoothstep(48.0, 86.0, points[:, 1] + _LENGTH_LEVEL_TILT * (points[:, 2] - HEAD_AXIS_Z))


def _combed_directions(points: Doubles, normals: Doubles, growth: Doubles) -> Doubles:
    """Return unit directions (n, 3) of short hair: away from the parting on top, down and back at the sides.

    growth : (n, 3) directions of uncombed hair
    """
    one = np.ones(len(points))
    top = 2.2 * _top_weight(points) * smoothstep(-135.0, -95.0, points[:, 2])
    away = np.tanh((points[:, 0] - _PARTING_X) / _PARTING_WIDTH_MM)
    across = np.stack([away, 0.25 * one, 0.55 * one], axis=1)
    side = 1.2 * (1.0 - _top_weight(points)) * smoothstep(-120.0, -80.0, points[:, 2])
    down = np.stack([0.0 * one, -one, -0.55 * one], axis=1)
    return tangent_directions(growth + top[:, None] * across + side[:, None] * down, normals)


class HairVariation(NamedTuple):
    """Parameters of the random deviation of hairs from their interpolated guides.

    angle_deviation : standard deviation of the sideways angle [rad]
    length_deviation : standard deviation of the length relative to the guide [-]
    tuft_strength : attraction of hair tips to the central hair of a tuft, 0 to 1
    frizz : amplitude of smooth random waves, relative to the length of the hair [-]
    coil_mm : radius of the helices of curly hair [mm]
    coils : mean number of turns of the helices per hair
    """

    angle_deviation: float
    length_deviation: float
    tuft_strength: float
    frizz: float
    coil_mm: float = 0.0
    coils: float = 0.0


def grow_hair(
    surface: GrowthSurface,
    roots: Roots,
    comb: Callable[[Doubles, Doubles], GuideShape],
    knots: int,
    variation: HairVariation,
    rng: np.random.Generator,
) -> tuple[RootFrames, Floats]:
    """Return the root frames of hairs, and the offsets (k, 3, n) of their knots from the roots [mm].

    roots : hair roots on quads of the control mesh; guides grow at the corners of these quads
    comb : function that returns guide shapes for two arrays (g, 3): root positions on the average person, and
        skin normals
    knots : number of knots per hair

    In all arrays the hair index comes last, which suits vectorised operations. For results that are equal on
    all machines, sines are computed in float64, and float32 arrays are only added and multiplied.
    """
    hair, around = surface.root_frames(roots), quad_corners(surface.control_mesh, roots.quad)
    point, near = compact_vertices(around)
    root_mm = surface.points_mm[point]
    base_mm, normals = surface.skin.project(root_mm)
    guides = comb(average_points()[point, :3], normals)
    offsets = _trace_guides(surface.skin, root_mm, base_mm, normals, guides, knots)
    t, normal = np.linspace(0.0, 1.0, knots)[:, None], hair.frame_vectors[2]
    found = _interpolate_guides(quad_weights(roots.position), near, offsets)
    found = _vary_directions(found, normal, variation, rng)
    _form_tufts(found, hair.positions_mm, t, variation.tuft_strength, rng)
    tips = found[-1]
    size = np.asarray(variation.frizz * np.sqrt(dot_columns(tips, tips)), np.float32)
    for fade, part in _random_waves(size, t, rng):
        found += fade[..., None].astype(np.float32) * part
    if variation.coil_mm:
        found += _coil_offsets(found[-1], t, variation, rng)
    return hair, _lift_above_skin(found, normal, t.astype(np.float32))


def _trace_guides(
    skin: SkinSurface, root_mm: Doubles, base_mm: Doubles, normal: Doubles, guide: GuideShape, knots: int
) -> Doubles:
    """Trace guide hairs over the skin; return the offsets (g, k, 3) of their knots from their roots [mm].

    root_mm : (g, 3) control points at which the guides grow [mm]
    base_mm, normal : (g, 3) projections of these control points onto the skin [mm], and the skin normals at
        the projections
    guide, knots : shapes of the guides, and number of knots of each guide
    """
    root_offset = root_mm - base_mm  # distance of the control points from the smooth surface
    directions, height, step = guide.directions, np.zeros(len(root_mm)), guide.length_mm / (knots - 1)
    found = [np.zeros_like(root_mm)]
    for k in range(1, knots):
        rise = guide.rise + (guide.tip_rise - guide.rise) * (k - 0.5) / (knots - 1)
        height = np.maximum(height + step * np.sin(rise), _MIN_HEIGHT_MM)
        directions = tangent_directions(directions, normal)
        base_mm, normal = skin.project(base_mm + (step * np.cos(rise))[:, None] * directions)
        found.append(base_mm + root_offset + height[:, None] * normal - root_mm)
    return np.stack(found, axis=1)


def _interpolate_guides(weight: Doubles, guide_index: NDArray[np.int64], offsets: Doubles) -> Floats:
    """Return the knot offsets (k, 3, n) of hairs, interpolated from the guides at the corners of their quads.

    weight, guide_index : (n, 4) interpolation weights and indices of the four guides of each hair
    offsets : (g, k, 3) knot offsets of the guides
    """
    from scipy.sparse import csr_array

    first = np.arange(0, weight.size + 1, weight.shape[1])
    entries = weight.ravel().astype(np.float32), guide_index.ravel(), first
    weights = csr_array(entries, (len(weight), len(offsets)))
    found = weights @ offsets.reshape(len(offsets), -1).astype(np.float32)
    return np.ascontiguousarray(found.T).reshape(*offsets.shape[1:], len(weight))


def _vary_directions(
    offsets: Floats, normal: Floats, variation: HairVariation, rng: np.random.Generator
) -> Floats:
    """Return knot offsets (k, 3, n), for each hair randomly rotated about the normal, tilted and scaled."""
    n = offsets.shape[-1]
    angle = variation.angle_deviation * rng.standard_t(4, size=n)
    lean = 1.0 + variation.angle_deviation * rng.normal(size=n)
    length = np.clip(1.0 + variation.length_deviation * rng.normal(size=n), 0.35, 1.2)
    along, sideways = length * np.cos(angle), length * np.sin(angle)
    along, sideways, rise = (one.astype(np.float32) for one in (along, sideways, length * lean - along))
    found: Floats = sideways * cross_columns(normal, offsets)
    found += (rise * dot_columns(offsets, normal))[:, None] * normal
    found += along * offsets
    return found


def _form_tufts(
    offsets: Floats, root_mm: Doubles, t: Doubles, strength: float, rng: np.random.Generator
) -> None:
    """Form tufts in place: pull the tips of all hairs in a cell of space towards one hair of that cell.

    offsets : (k, 3, n) knot offsets from the roots [mm]
    root_mm : (n, 3) positions of the roots [mm]
    t : (k, 1) position along the hair, 0 at the root, 1 at the tip
    strength : maximum fraction of the distance by which tips are pulled
    """
    points = np.ascontiguousarray(root_mm.T)
    cell = np.zeros(len(root_mm), np.int64)
    for coordinate in np.floor(points / _TUFT_MM).astype(np.int64):
        coordinate -= coordinate.min()
        cell *= coordinate.max() + 1
        cell += coordinate
    tuft_hair = np.empty(cell.max() + 1, np.int64)
    tuft_hair[cell] = np.arange(len(cell))  # one hair of each cell
    tuft_hair = tuft_hair[cell]
    pull = (strength * rng.uniform(0.3, 1.0, len(root_mm)) * t**1.3).astype(np.float32)
    difference = offsets.take(tuft_hair, axis=-1)
    difference -= offsets
    difference += (points.take(tuft_hair, axis=-1) - points).astype(np.float32)
    difference *= pull[:, None]
    offsets += difference


def _random_waves(size: Floats, t: Doubles, rng: np.random.Generator) -> Iterator[tuple[Doubles, Floats]]:
    """Yield terms of a smooth random displacement that is 0 at the roots.

    Each term is a factor (k, 1) per knot and an amplitude (3, n) per hair, whose product is an offset.

    size : (n,) amplitude of the displacement of each hair [mm]
    t : (k, 1) position along the hair, 0 at the root, 1 at the tip
    """
    fade = np.minimum(2 * t, 1.0)
    for waves in (0.5, 1.1):
        for shape in (np.sin(2 * np.pi * waves * t), np.cos(2 * np.pi * waves * t) - 1.0):
            amplitude = rng.random((3, len(size)), np.float32) - np.float32(0.5)
            yield np.sqrt(2.0) / waves * fade * shape, amplitude * size


def _coil_offsets(tips: Floats, t: Doubles, variation: HairVariation, rng: np.random.Generator) -> Floats:
    """Return offsets (k, 3, n) that turn hairs into helices around the line from root to tip [mm].

    tips : (3, n) offsets of the tips from the roots [mm]
    t : (k, 1) position along the hair, 0 at the root, 1 at the tip
    """
    n = tips.shape[-1]
    along = np.asarray(tips / np.maximum(np.sqrt(dot_columns(tips, tips)), _EPSILON), np.float32)
    side: Floats = rng.normal(size=tips.shape).astype(np.float32)
    side -= dot_columns(side, along) * along
    side /= np.maximum(np.sqrt(dot_columns(side, side)), _EPSILON)
    step = 2 * np.pi * t[1] * variation.coils * rng.uniform(0.8, 1.2, n)
    phase = np.asarray(2 * np.pi * rng.random(n))
    radius = variation.coil_mm * rng.uniform(0.6, 1.2, n) * np.minimum(4 * t, 1.0)
    x, y = ((radius * one)[:, None].astype(np.float32) for one in _sine_sequence(phase, step, len(t)))
    return np.asarray(x * side + y * cross_columns(along, side))


def _sine_sequence(angle: Doubles, step: Doubles, knots: int) -> tuple[Doubles, Doubles]:
    """Return cos(angle + i step) and sin(angle + i step) for i < `knots`, each (knots, n), by recurrence."""
    x, y = np.empty((knots, len(angle))), np.empty((knots, len(angle)))
    x[0], y[0], cosine, sine = np.cos(angle), np.sin(angle), np.cos(step), np.sin(step)
    for k in range(1, knots):
        x[k] = x[k - 1] * cosine - y[k - 1] * sine
        y[k] = y[k - 1] * cosine + x[k - 1] * sine
    return x, y


def _lift_above_skin(offsets: Floats, normal: Floats, t: Floats) -> Floats:
    """Lift knots to a minimum height above the skin, approximated by a sphere; return their offsets.

    offsets, normal : (k, 3, n) knot offsets from the roots [mm], and (3, n) skin normals at the roots
    t : (k, 1) position along the hair, 0 at the root, 1 at the tip
    """
    height = dot_columns(offsets, normal)
    flat2 = dot_columns(offsets, offsets) - height**2
    min_height = _MIN_HEIGHT_MM * np.minimum(3 * t, 1.0) - flat2 / (2 * _HEAD_RADIUS_MM)
    offsets += np.maximum(min_height - height, 0.0)[:, None] * normal
    return offsets


def knot_count(look: HairLook) -> int:
    """Return the number of knots per hair, which increases with curl and with length."""
    if look.curl > _COIL_CURL:
        return _COILED_KNOTS
    return _CURVED_KNOTS if look.style == "short" or look.beard_mm > _LONG_BEARD_MM else _STRAIGHT_KNOTS


def scalp_hair(surface: GrowthSurface, look: HairLook, recession: float) -> list[HairGroup]:
    """Return the strands of scalp hair as a list of one group; the list is empty for a bald head."""
    if look.style == "none" or look.density == 0.0:
        return []
    rng = np.random.default_rng((look.seed, 3))
    strands_per_cm2 = surface.hair_fraction * (22.0 + 53.0 * look.density)
    roots = density.sample_roots(surface.control_mesh, density.scalp_density(recession), strands_per_cm2, rng)
    comb = partial(comb_scalp, look=look, recession=recession)
    hair, offsets = grow_hair(surface, roots, comb, knot_count(look), _scalp_variation(look), rng)
    hairs_per_cm2 = MAX_PER_CM2 * look.density
    return [_strand_group(hair, offsets, strands_per_cm2, hairs_per_cm2, _HAIR_RADIUS_MM, rng)]


def beard_hair(surface: GrowthSurface, look: HairLook) -> list[HairGroup]:
    """Return the strands of the beard as a list of one group; the list is empty without a beard."""
    if look.beard_mm == 0.0:
        return []
    rng, strands_per_cm2 = np.random.default_rng((look.seed, 4)), surface.hair_fraction * BEARD_PER_CM2
    roots = density.sample_roots(surface.control_mesh, density.beard_density(), strands_per_cm2, rng)
    tight = max(look.curl - _COIL_CURL, 0.0) * 2
    variation = HairVariation(0.3, 0.22, 0.2, 0.05 + 0.1 * look.curl, 0.5 * tight, 1.5)
    comb = partial(comb_beard, look=look)
    hair, offsets = grow_hair(surface, roots, comb, knot_count(look), variation, rng)
    return [_strand_group(hair, offsets, strands_per_cm2, BEARD_PER_CM2, _BEARD_RADIUS_MM, rng)]


def _strand_group(
    hair: RootFrames,
    offsets: Floats,
    strands_per_cm2: float,
    hairs_per_cm2: float,
    radius_mm: float,
    rng: np.random.Generator,
) -> HairGroup:
    """Return strands with radii and coverage; each strand is wide enough to represent several hairs.

    hair : frames of the strand roots
    offsets : (k, 3, n) knot offsets from the roots, from `grow_hair` [mm]
    strands_per_cm2, hairs_per_cm2 : densities of the strands and of the hairs that they represent [1/cm2]
    radius_mm : mean radius of one hair [mm]
    """
    hairs_per_strand, (knots, _, n) = hairs_per_cm2 / strands_per_cm2, offsets.shape
    radius = np.tile((hairs_per_strand * radius_mm * rng.uniform(0.8, 1.2, (n, 1))).astype(np.float32), knots)
    radius[:, -1] *= np.float32(_TIP_RADIUS_FACTOR)
    steps = np.diff(offsets, axis=0)
    length = np.sqrt(dot_columns(steps, steps)).sum(axis=0, dtype=np.float64)
    area = float(np.mean(2.0 * radius.mean(axis=1) * length))  # from the side; halved below for inclined hair
    local = np.empty((n, knots, 3), np.float32)
    for c in range(3):
        local[..., c] = dot_columns(offsets, hair.frame_vectors[c]).T
    cover = 0.5 * area * strands_per_cm2 / 100.0
    return HairGroup(hair.roots, local, radius, 1.0, hairs_per_strand, cover)


def _scalp_variation(look: HairLook) -> HairVariation:
    tight = max(look.curl - _COIL_CURL, 0.0) * 2
    if look.style == "cropped":
        return HairVariation(0.25, 0.12, 0.1 + 0.2 * tight, 0.04 + 0.06 * look.curl, 0.9 * tight, 2.0)
    return HairVariation(0.14, 0.14, 0.5, 0.025 + 0.04 * look.curl, 1.6 * tight, 2.0)
