"""Depth of knots of hair inside the skin of people."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.console import print_lines
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HAIR_STYLES
from dermis.human.hair.skin_surface import SkinSurface
from dermis.human.person import Human
from dermis.mesh.grown_strands import grow_strands
from dermis.mesh.head import Head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

LIMIT_MM = 0.5
"""Depth above which knots count as inside the skin [mm]."""
_MAX_DEPTH_MM = 40.0  # knots deeper than this are on the other side of a thin part or below the bust


class HairPenetration(NamedTuple):
    """Knots of hair inside the skin.

    knots : number of knots, without those at the roots
    inside : number of knots deeper inside the skin than the limit
    deepest_mm : depth of the deepest of them, 0 if there is none [mm]
    """

    knots: int
    inside: int
    deepest_mm: float


def with_style(person: Human, style: str) -> Human:
    """Return a person who wears another hair style, at its usual length."""
    look = replace(person.hair_look, style=style, length_mm=None, fade=None)  # type: ignore[arg-type]  # defaults
    return replace(person, hair=look)


def hair_penetration(person: Human, limit_mm: float, max_strands: int = 3000) -> HairPenetration:
    """Count the knots of a person's hair that are deeper inside the skin than a limit, in the rest pose.

    The depth of a knot is its distance below the tangent planes of the nearest vertices of the skin.

    limit_mm : depth above which knots are counted [mm]
    max_strands : number of strands that are checked
    """
    head = person.head()
    if head.hair is None:
        return HairPenetration(0, 0, 0.0)
    strands = grow_strands(head.hair, head.mesh, head.mesh.points_mm, max_strands)
    knots = strands.knot_positions_mm(head.mesh, head.mesh.points_mm)[:, 1:].reshape(-1, 3)
    return _penetration(head, knots, limit_mm)


def device_hair_penetration(renderer: Renderer, person: Human, limit_mm: float) -> HairPenetration:
    """Count the knots of the strands that a device grows for shadows, as `hair_penetration` does.

    limit_mm : depth above which knots are counted [mm]
    """
    head = person.head()
    if head.hair is None:
        return HairPenetration(0, 0, 0.0)
    scene, settings = Scene(head), Settings(size=(64, 64), atlas=256)
    renderer.draw(scene, settings)
    resources = renderer.prepare(scene, settings).resources.hair
    assert resources is not None
    tables, device = resources.tables, renderer.device
    rows = np.frombuffer(device.handle.queue.read_buffer(tables.buffers.casters), np.float32).reshape(-1, 4)
    first, length = tables.fine.hairs * (tables.fine.knots + 2), tables.casters.knots + 2
    strands = rows[first : first + tables.casters.hairs * length].reshape(-1, length, 4)
    grown = strands[strands[:, 2, 3] > 0.0]
    return _penetration(head, grown[:, 3:, :3].reshape(-1, 3).astype(float), limit_mm)


def print_hair_penetration(adapter: str = "auto", people: int = 20, styles: str = "") -> None:
    """Print how many knots of hair are more than 0.5 mm inside the skin, for people in each hair style.

    The knots are those of the strands that the adapter grows for shadows.

    Parameters
    ----------
    adapter:
        Adapter on which the hair grows.
    people:
        Number of people, sampled at random, for each style.
    styles:
        Names of hair styles, separated by commas; all by default.
    """
    renderer, total = Renderer(adapter), HairPenetration(0, 0, 0.0)
    for style in styles.split(",") if styles else HAIR_STYLES[1:]:
        found = [
            device_hair_penetration(renderer, with_style(Human.sampled(seed), style), LIMIT_MM)
            for seed in range(people)
        ]
        all_people = _sum_penetrations(found)
        total = _sum_penetrations([total, all_people])
        print_lines(_penetration_line(style, all_people))
    print_lines(_penetration_line(f"all, on {renderer.device.adapter.name}", total))


def _sum_penetrations(found: list[HairPenetration]) -> HairPenetration:
    deepest_mm = max((one.deepest_mm for one in found), default=0.0)
    return HairPenetration(sum(one.knots for one in found), sum(one.inside for one in found), deepest_mm)


def _penetration_line(name: str, found: HairPenetration) -> str:
    return f"{name}: {found.inside} of {found.knots} knots inside, deepest {found.deepest_mm:.2f} mm"


def _penetration(head: Head, knots_mm: Doubles, limit_mm: float) -> HairPenetration:
    """Return the penetration of knots (n, 3), without roots, into the skin of a head at rest."""
    mesh = head.mesh
    skin = np.unique(mesh.triangles[mesh.material == 0])
    depth = _depths(SkinSurface(mesh.positions[skin], mesh.normals[skin]), knots_mm)
    inside = depth[(depth > limit_mm) & (depth < _MAX_DEPTH_MM)]
    return HairPenetration(len(knots_mm), len(inside), float(inside.max(initial=0.0)))


def _depths(surface: SkinSurface, points_mm: Doubles) -> Doubles:
    """Return the depths (n,) of points below the skin; depths are negative outside [mm]."""
    base, normal = surface.project(points_mm)
    return np.asarray(((base - points_mm) * normal).sum(axis=1))
