"""Depth of worn items in the skin, and of hair in clothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.console import print_report
from dermis.human.hair.skin_surface import SkinSurface
from dermis.human.person import Human, outfit
from dermis.human.wear.dress import worn_outside
from dermis.human.wear.look import GARMENT_NAMES, GLASSES_STYLES, HEADWEAR_STYLES
from dermis.mesh.grown_strands import grow_strands
from dermis.mesh.head import Head

_MAX_DEPTH_MM = 25.0  # points deeper than this are on the other side of a thin part
_LIMIT_MM = 0.5
_BESIDE_MM = 6.0  # distance along the cloth from its border beyond which points are not behind it


class WearPenetration(NamedTuple):
    """Points of items inside the skin, and knots of hair inside items.

    points : number of points on the outside of the items
    inside : number of them deeper inside the skin than 0.5 mm
    deepest_mm : depth of the deepest of them, 0 if there is none [mm]
    hair_knots : number of visible knots of hair
    hair_inside : number of them deeper inside clothing than 0.5 mm
    hair_inside_before : that number for the hair of the person without clothing
    """

    points: int
    inside: int
    deepest_mm: float
    hair_knots: int
    hair_inside: int
    hair_inside_before: int


def wear_penetration(person: Human, max_strands: int = 1500) -> WearPenetration:
    """Count the points of items inside the skin of a person, and the knots of hair inside clothing, at rest.

    Depths are below the tangent planes of the nearest vertices.

    max_strands : number of strands that are checked
    """
    head = person.head()
    mesh, count = head.mesh, int(head.body.mesh.point.max()) + 1
    skin = np.unique(mesh.triangles[mesh.material == 0])
    surface = SkinSurface(mesh.positions[skin], mesh.normals[skin])
    points_mm, normals, is_cloth = worn_outside(mesh.points_mm[count:], outfit(person))
    depth = _depths(surface, points_mm)
    inside = depth[(depth > _LIMIT_MM) & (depth < _MAX_DEPTH_MM)]
    hair = _hair_inside(head, points_mm[is_cloth], normals[is_cloth], max_strands)
    return WearPenetration(len(points_mm), len(inside), float(inside.max(initial=0.0)), *hair)


def _hair_inside(head: Head, cloth_mm: Doubles, normals: Doubles, max_strands: int) -> tuple[int, int, int]:
    """Return the numbers of knots, of those inside cloth, and of those inside with hair as without cloth."""
    bare = head.body
    if head.hair is None or bare.hair is None or not len(cloth_mm):
        return 0, 0, 0
    cloth, counts = SkinSurface(cloth_mm, normals), list[int]()
    total = 0
    for groom in (head.hair, bare.hair):
        strands = grow_strands(groom, bare.mesh, bare.mesh.points_mm, max_strands)
        knots = strands.knot_positions_mm(bare.mesh, bare.mesh.points_mm)[:, 1:]
        knots = knots[strands.radius_mm[:, 1:] > 0.0]
        depth = _depths(cloth, knots)
        near = cloth.distances_mm(knots) < np.maximum(np.abs(depth), 0.0) + _BESIDE_MM
        counts.append(int((near & (depth > _LIMIT_MM) & (depth < _MAX_DEPTH_MM)).sum()))
        total = total or len(knots)
    return total, counts[0], counts[1]


def _depths(surface: SkinSurface, points_mm: Doubles) -> Doubles:
    """Return the depths (n,) of points below a surface; depths are negative outside [mm]."""
    base, normal = surface.project(points_mm)
    return np.asarray(((base - points_mm) * normal).sum(axis=1))


def print_wear_penetration(*, people: int = 10, first_seed: int = 0, as_json: bool = False) -> None:
    """Print how many points of each item are inside the skin of people, and how much hair inside clothing.

    Parameters
    ----------
    people:
        Number of people, sampled at random.
    first_seed:
        Seed of the first person.
    as_json:
        Print JSON.
    """
    report: dict[str, dict[str, float]] = {}
    kinds = {"clothing": GARMENT_NAMES, "glasses": GLASSES_STYLES, "headwear": HEADWEAR_STYLES}
    for field, names in kinds.items():
        for name in names:
            items: dict[str, Any] = {field: name}
            found = [
                wear_penetration(replace(Human.sampled(seed), **items))
                for seed in range(first_seed, first_seed + people)
            ]
            report[name] = {
                key: max(getattr(one, key) for one in found)
                if key == "deepest_mm"
                else sum(getattr(one, key) for one in found)
                for key in WearPenetration._fields
            }
    lines = (
        f"{name:12}" + "  ".join(f"{key} {value:g}" for key, value in one.items())
        for name, one in report.items()
    )
    print_report(as_json, report, lambda: list(lines))
