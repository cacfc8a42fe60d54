"""Strands that a hair style or beard can have: their roots on the skin, their guides and their clumps."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.base.disk import Arrays, cached_arrays
from dermis.human.curves import smoothstep
from dermis.human.hair import density
from dermis.human.hair.density import average_control_points, recession_effect
from dermis.human.hair.guides import (
    CORNROW_SPACING_MM,
    bind_guides,
    cornrow_position,
    cut_fractions,
    fringe_weight,
    grow_guides,
    parting_side,
)
from dermis.human.hair.root_finder import RootFinder
from dermis.human.hair.root_sampling import spread_thresholds
from dermis.human.hair.styles import BeardArea, Style
from dermis.mesh.groom import KNOTS_PER_GUIDE, Guides, StrandRoots
from dermis.mesh.strands import Roots, quad_corners, quad_weights, refine_roots

STRANDS_PER_CM2 = 150.0
"""Density of the strand roots on the scalp; strands grow from all or some of them [1/cm2]."""
BEARD_STRANDS_PER_CM2 = 220.0
"""Density of the strand roots in beards [1/cm2]."""
_CACHE_VERSION = 16  # of this module's algorithm, part of the keys of cached tables
_MAX_CACHED_STYLES, _MAX_CACHED_LOOKS = 4, 24  # single styles; hair styles with or without a beard
# Distances between guides from which strands are less, and then not at all, interpolated between them [mm].
_GUIDE_SEPARATION_MM = 25.0, 55.0
_HAIRLINE_MARGIN_MM = 12.0  # distance below the hairline to which widow's peaks and baby hairs reach
_BEARD_EDGE_DENSITY = 0.05, 0.9  # relative densities between which hairs of a beard reach full length
_SEED = 20
_CENTRE_ROOT_COUNT = 2000  # number of roots whose mean is the centre of the hair
_GUIDE_FIELDS = "corner", "local_mm", "weight", "rest_mm", "cut"
_ROOT_FIELDS = "quad", "position", "guide", "guide_weight", "clump", "place", "along_mm", "threshold"


class StyleStrands(NamedTuple):
    """Guides and roots of scalp hair and beard, shared by all people with the same styles.

    guides : guide curves of scalp hair and beard
    roots : roots of all strands that scalp hair and beard can have
    centre_mm : (3,) mean position of the roots on the mean person [mm]
    """

    guides: Guides
    roots: StrandRoots
    centre_mm: Doubles


@lru_cache(_MAX_CACHED_LOOKS)
def strands_of_style(
    scalp_style: Style | None, beard_style: Style | None, root_finder: RootFinder, subdivision_levels: int
) -> StyleStrands:
    """Return the guides and the roots of a hair style and a beard.

    scalp_style : style of the hair of the head; None for a bald head
    beard_style : style of the beard; None for no beard
    root_finder : root finder of the mean person
    subdivision_levels : subdivision levels of the mesh on whose quads the roots lie
    """
    worn = [style for style in (scalp_style, beard_style) if style is not None]
    parts = [_cached_style_arrays(style, root_finder) for style in worn]
    guides = Guides(*(np.concatenate([part[name] for part in parts]) for name in _GUIDE_FIELDS))
    counts = [len(part["quad"]) for part in parts]
    # A prefix of all strands has equal fractions of each part, because each is in progressive order.
    order = np.argsort(np.concatenate([(np.arange(n) + 0.5) / n for n in counts]), kind="stable")
    place = np.argsort(order)  # new index of each strand
    first_guide = np.cumsum([0, *(len(part["cut"]) for part in parts)])
    first_strand = np.cumsum([0, *counts])
    columns = {name: np.concatenate([part[name] for part in parts]) for name in _ROOT_FIELDS}
    columns["guide"] += np.repeat(first_guide[:-1], counts)[:, None].astype(np.int32)
    columns["clump"] = place[columns["clump"] + np.repeat(first_strand[:-1], counts)].astype(np.int32)
    columns["part"] = np.repeat(np.arange(len(parts), dtype=np.int32), counts)
    columns = {name: column.take(order, axis=0) for name, column in columns.items()}
    quad, position = columns.pop("quad"), columns.pop("position")
    some = slice(None, _CENTRE_ROOT_COUNT)
    corners_mm = root_finder.once_subdivided_mesh.points_mm[quad_corners(root_finder.mesh, quad[some])]
    centre_mm = np.einsum("nk,nkc->nc", quad_weights(position[some]), corners_mm).mean(axis=0)
    roots = refine_roots(root_finder.mesh, Roots(quad, position), subdivision_levels)
    return StyleStrands(guides, StrandRoots(roots, **columns), centre_mm)


@lru_cache(_MAX_CACHED_STYLES)
def _cached_style_arrays(style: Style, root_finder: RootFinder) -> Arrays:
    names, points_mm = [*_GUIDE_FIELDS, *_ROOT_FIELDS], root_finder.once_subdivided_mesh.points_mm
    parameters = f"groom {_CACHE_VERSION} {style}"
    return cached_arrays(points_mm, parameters, names, lambda: _build_style_arrays(style, root_finder))


def _build_style_arrays(style: Style, root_finder: RootFinder) -> Arrays:
    """Return the guides and roots of one style, as a dictionary from field names to arrays.

    The names are those of the fields of `Guides` and of `StrandRoots`.
    """
    mesh, beard = root_finder.mesh, style.comb == "beard"
    where, _ = _density_of_area(style.area if beard else None)
    roots = _cached_roots(style.area if beard else None, root_finder)
    corners = quad_corners(mesh, roots.quad)
    points, guide = np.unique(corners, return_inverse=True)
    guide = guide.reshape(corners.shape)
    points_mm = root_finder.once_subdivided_mesh.points_mm
    knots, _, heights = grow_guides(root_finder, points_mm[points], style)
    weight = quad_weights(roots.position)
    root_mm = np.einsum("nk,nkc->nc", weight, points_mm[corners])
    if style.comb == "fall":
        same = parting_side(points_mm[points], style)[guide] * parting_side(root_mm, style)[:, None] >= 0
        in_fringe = fringe_weight(points_mm[points], style) > 0.5
        same &= in_fringe[guide] == (fringe_weight(root_mm, style) > 0.5)[:, None]
        one_sided = weight * same
        total = one_sided.sum(axis=1, keepdims=True)
        weight = np.where(total > 1e-3, one_sided / np.maximum(total, 1e-9), weight)
    weight = _near_guide_weights(weight, guide, knots)
    place = _root_locations(weight, average_control_points()[corners])
    if beard:
        points = np.einsum("nk,nkc->nc", weight, average_control_points()[corners])
        place[:, 3] = smoothstep(*_BEARD_EDGE_DENSITY, where.relative_density(points))
    guides = bind_guides(mesh, points_mm, knots, heights, cut_fractions(knots, style))
    half_length_mm = np.einsum("nk,nkc->nc", weight, knots[guide, KNOTS_PER_GUIDE // 2])
    clump = _clump_centre_strands(root_mm, half_length_mm, style)
    columns = (
        *(roots.quad, roots.position, guide, weight, clump, place, -root_mm[clump, 2]),
        spread_thresholds(root_mm),
    )
    types = np.int32, np.float32, np.int32, np.float32, np.int32, np.float32, np.float32, np.float32
    found = {
        name: np.asarray(column, kind)
        for name, column, kind in zip(_ROOT_FIELDS, columns, types, strict=True)
    }
    return found | {name: getattr(guides, name) for name in _GUIDE_FIELDS}


def _density_of_area(beard_area: BeardArea | None) -> tuple[density.HairDensity, float]:
    """Return the relative density of roots in a part of the skin, and their density where it is 1 [1/cm2].

    beard_area : part of the face that a beard covers; None for the scalp
    """
    if beard_area is not None:
        return density.beard_density(beard_area), BEARD_STRANDS_PER_CM2
    return density.scalp_density(0.0, _HAIRLINE_MARGIN_MM), STRANDS_PER_CM2


def _cached_roots(beard_area: BeardArea | None, root_finder: RootFinder) -> Roots:
    """Return the roots in a part of the skin, which all styles share, see `_density_of_area`."""

    def sample() -> Arrays:
        rng = np.random.default_rng(_SEED)
        roots = density.sample_roots(root_finder.mesh, *_density_of_area(beard_area), rng)
        return {"quad": roots.quad, "position": roots.position}

    parameters = f"hair roots {_CACHE_VERSION} {beard_area}"
    found = cached_arrays(root_finder.once_subdivided_mesh.points_mm, parameters, list(Roots._fields), sample)
    return Roots(found["quad"], found["position"])


def _near_guide_weights(guide_weight: Doubles, guide: NDArray[np.int64], knots: Doubles) -> Doubles:
    """Return weights (n, 4) in which guides far from a strand's main guide count less.

    The main guide of a strand is the guide with the largest weight. The reduction keeps a strand between
    guides on opposite sides of the head from passing through the head.

    guide_weight, guide : (n, 4) original weights of the guides, and their indices
    knots : (g, k, 3) knots of all guides [mm]
    """
    main = np.take_along_axis(guide, guide_weight.argmax(axis=1)[:, None], axis=1)
    some = knots[:, :: KNOTS_PER_GUIDE // 8]
    apart = np.linalg.norm(some[guide] - some[main], axis=-1).max(axis=2)
    agreeing = guide_weight * smoothstep(_GUIDE_SEPARATION_MM[1], _GUIDE_SEPARATION_MM[0], apart)
    return np.asarray(agreeing / agreeing.sum(axis=1, keepdims=True))


def _root_locations(corner_weight: Doubles, corner_points: Doubles) -> Doubles:
    """Return the array `StrandRoots.place` (n, 4), which describes where on the head each root is.

    The columns are the angle around the head from the front [degrees], the height above the midpoint of the
    eyes [mm], how much the hair thins there at the strongest recession, 0 to 1, and the position from the
    nape (0) to the top of the head (1).

    corner_weight : (n, 4) weights of the corners of the quad on which each strand is rooted
    corner_points : (n, 4, 4) rows of `average_control_points` at these corners
    """
    points = np.einsum("nk,nkc->nc", corner_weight, corner_points)
    angle = density.hairline_angle(points)
    height = points[:, 1] + density.hairline_waves(points)
    thinning = -recession_effect("hair", 1.0, points)
    top = smoothstep(-30.0, 85.0, points[:, 1] + 0.15 * (points[:, 2] - density.HEAD_AXIS_Z))
    return np.stack([angle, height, np.clip(thinning, 0.0, 1.0), top], axis=1)


def _clump_centre_strands(root_mm: Doubles, half_length_mm: Doubles, style: Style) -> NDArray[np.int64]:
    """Return for each strand the index (n,) of the strand at the centre of its clump.

    In cornrows, the clump of a strand is found by moving its root sideways onto the centreline of its row;
    the strand whose root is nearest to this position is the centre. In other styles, the centres are the
    first strands, which are blue noise, and each strand belongs to the clump of the nearest centre.

    root_mm : (n, 3) roots on the mean person [mm]
    half_length_mm : (n, 3) points of the strands at half the length of their guides [mm]
    """
    from scipy.spatial import cKDTree

    if style.comb == "rows":
        across = cornrow_position(root_mm)
        along = root_mm[:, 1:]
        found = cKDTree(np.column_stack([CORNROW_SPACING_MM * across, along])).query(
            np.column_stack([CORNROW_SPACING_MM * np.round(across), along])
        )[1]
        return np.asarray(found, np.int64)
    count = max(1, round(len(root_mm) / (STRANDS_PER_CM2 * (style.clump_mm / 10.0) ** 2)))
    # Hairs that part from each other are not in one clump.
    near = np.column_stack([root_mm, 0.5 * half_length_mm])
    return np.asarray(cKDTree(near[:count]).query(near)[1], np.int64)
