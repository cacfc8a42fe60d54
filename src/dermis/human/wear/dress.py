"""Dressed heads: mesh, rig and materials of a head, followed by those of worn items."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Mask
from dermis.human.model import Layout, head_template
from dermis.human.wear.clothing import (
    garment_materials,
    garment_obstacle,
    garment_outside,
    garment_points_mm,
    worn_garment,
)
from dermis.human.wear.eyewear import GLASSES_MESHES, glasses_materials
from dermis.human.wear.file_clothing import (
    file_garment_materials,
    file_garment_obstacle,
    file_garment_points_mm,
    worn_file_garment,
)
from dermis.human.wear.hair_obstacles import HeadwearObstacle, Obstacle, fit_groom
from dermis.human.wear.hats import HEADWEAR_MESHES, headwear_materials
from dermis.human.wear.headwear import headwear_room
from dermis.human.wear.look import Clothing, FileClothing, Glasses, Headwear, Item
from dermis.human.wear.skin_sheet import point_normals
from dermis.human.wear.worn import Worn
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material, build_mesh
from dermis.mesh.rig import MorphTargets, Rig, Stencils

_MAX_TEMPLATES = 32  # about 12 MB each; people dressed by chance wear hundreds of combinations of items

Outfit = tuple[Item, ...]
"""Items that a person wears."""


class Wearable(NamedTuple):
    """Functions that build one kind of item, such as glasses.

    mesh : mesh of an item, which does not depend on the person or on colours
    points_mm : points (m, 3) of an item on a person with control points (p, 3) [mm]
    materials : materials of an item
    obstacle : limits of hair, from the points (m, 3) of the item on a person, the control points (p, 3) of
        the person and the item [mm]; None for items that hair may cross
    """

    mesh: Callable[[Any], Worn]
    points_mm: Callable[[Floats, Any], Doubles]
    materials: Callable[[Any], tuple[Material, ...]]
    obstacle: Callable[[Doubles, Doubles, Any], Obstacle] | None = None


WEARABLES: Mapping[type[Item], Wearable] = {
    Clothing: Wearable(
        worn_garment,
        garment_points_mm,
        garment_materials,
        lambda points, control, item: garment_obstacle(points, item),
    ),
    FileClothing: Wearable(
        worn_file_garment,
        file_garment_points_mm,
        file_garment_materials,
        lambda points, control, item: file_garment_obstacle(points, item),
    ),
    Glasses: Wearable(GLASSES_MESHES.worn, GLASSES_MESHES.points_mm, glasses_materials),
    Headwear: Wearable(
        HEADWEAR_MESHES.worn,
        HEADWEAR_MESHES.points_mm,
        headwear_materials,
        lambda points, control, item: HeadwearObstacle(headwear_room(item.style, control)),
    ),
}
"""Functions that build items, by the type of item."""


def worn_points_mm(control_mm: Floats, outfit: Outfit) -> Floats:
    """Return the points (m, 3) of all items on a person [mm].

    control_mm : (p, 3) control points of the person at rest
    """
    points = [WEARABLES[type(item)].points_mm(control_mm, item) for item in outfit]
    return np.concatenate(points).astype(np.float32)


def worn_outside(points_mm: Doubles, outfit: Outfit) -> tuple[Doubles, Doubles, Mask]:
    """Return points (n, 3) [mm] on the outside of items, unit normals there, and a mask of those of clothing.

    points_mm : (m, 3) points of all items, from `worn_points_mm` [mm]
    """
    found, done = list[tuple[Doubles, Doubles, Mask]](), 0
    for item in outfit:
        worn = WEARABLES[type(item)].mesh(item)
        own = points_mm[done : done + worn.point_count].astype(np.float64)
        normals, done = point_normals(own, worn.point[worn.triangles]), done + worn.point_count
        outside = garment_outside(item) if type(item) is Clothing else np.ones(len(own), bool)
        found.append(
            (own[outside], normals[outside], np.full(int(outside.sum()), isinstance(item, Clothing)))
        )
    points, normals, is_cloth = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return points, normals, is_cloth


def dress(head: Head, outfit: Outfit, template: Head | None) -> Head:
    """Return a head that wears an outfit of at least one item.

    template : head of the mean person in this outfit, from `dressed_template`; None to build that head itself
    """
    mesh, first_point = head.mesh, int(head.mesh.point.max()) + 1
    rig, points = head.control_rig, worn_points_mm(head.control_rig.positions_mm, outfit)
    positions, uv, triangles = [mesh.positions], [mesh.uv], [mesh.triangles]
    point, material, materials = [mesh.point], [mesh.material], mesh.materials
    vertex_count, done = len(mesh.positions), 0
    obstacles, control = list[Obstacle](), rig.positions_mm.astype(np.float64)
    for item in outfit:
        make = WEARABLES[type(item)]
        worn = make.mesh(item)
        own = points[done : done + worn.point_count]
        rig = _dressed_rig(rig, worn, own)
        if make.obstacle is not None and head.hair is not None:
            obstacles.append(make.obstacle(own.astype(np.float64), control, item))
        positions.append(own[worn.point])
        uv.append(worn.uv)
        triangles.append(worn.triangles + vertex_count)
        point.append(worn.point + first_point + done)
        material.append(worn.material + len(materials))
        materials = (*materials, *make.materials(item))
        vertex_count, done = vertex_count + len(worn.point), done + worn.point_count
    dressed = build_mesh(
        np.concatenate(positions),
        np.concatenate(uv),
        np.concatenate(triangles),
        np.concatenate(material),
        materials,
        point=np.concatenate(point),
        quads=mesh.quads,
    )
    rig = replace(rig, template=None if template is None else template.control_rig)
    hair = head.hair and fit_groom(head.hair, mesh.points_mm, obstacles)
    return replace(head, mesh=dressed, rig=rig, template=template, undressed=head, hair=hair)


def dressed_template(layout: Layout, levels: int, outfit: Outfit) -> Head:
    """Return the head of the mean person in an outfit, cached for the last outfits.

    It is the template of all people who wear these items in any colour, and who share its atlas.
    """
    stamps = tuple(item.stamp for item in outfit)
    return _dressed_template(layout, levels, tuple(item.without_colour for item in outfit), stamps)


@lru_cache(_MAX_TEMPLATES)
def _dressed_template(
    layout: Layout, levels: int, outfit: Outfit, stamps: tuple[tuple[int, int] | None, ...]
) -> Head:
    return dress(head_template(layout, levels).head, outfit, None)


def _dressed_rig(rig: Rig, worn: Worn, points_mm: Floats) -> Rig:
    assert rig.skeleton is not None
    skeleton = replace(
        rig.skeleton,
        bone=np.concatenate([rig.skeleton.bone, worn.bone]),
        weight=np.concatenate([rig.skeleton.weight, worn.weight]),
    )
    control = len(rig.positions_mm)
    stencils = None if rig.stencils is None else _with_single_points(rig.stencils, control, worn.point_count)
    return replace(
        rig,
        positions_mm=np.concatenate([rig.positions_mm, points_mm.astype(np.float32)]),
        targets=_with_displacements(rig.targets, worn, control),
        skeleton=skeleton,
        stencils=stencils,
    )


def _with_displacements(targets: MorphTargets, worn: Worn, first_point: int) -> MorphTargets:
    """Return morph targets that also displace the points of an item, which begin at `first_point`."""
    own = np.repeat(np.arange(len(targets.names)), np.diff(targets.first))
    target = np.concatenate([own, worn.target])
    order = np.argsort(target, kind="stable")
    point = np.concatenate([targets.point, worn.target_point + first_point]).astype(np.int32)
    delta = np.concatenate([targets.delta_mm, worn.delta_mm])
    first = np.concatenate([[0], np.cumsum(np.bincount(target, minlength=len(targets.names)))])
    return replace(targets, first=first.astype(np.int32), point=point[order], delta_mm=delta[order])


def _with_single_points(stencils: Stencils, first_point: int, count: int) -> Stencils:
    """Return stencils with `count` more points, which are the control points from `first_point` on."""
    end = int(stencils.first[-1])
    return Stencils(
        np.concatenate([stencils.first, end + 1 + np.arange(count)]).astype(np.int32),
        np.concatenate([stencils.point, first_point + np.arange(count)]).astype(np.int32),
        np.concatenate([stencils.weight, np.ones(count, np.float32)]),
    )
