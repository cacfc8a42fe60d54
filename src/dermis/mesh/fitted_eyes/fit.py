"""A head from a file with eyeballs of true shape in the place of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.base.progress import logged_step
from dermis.mesh import eyeball
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import CORNEA_MM, LIMBUS_MM, SCLERA_MM, cornea_centre_mm, globe, plane_mm
from dermis.mesh.eyes import Eyes
from dermis.mesh.fitted_eyes.balls import Ball, Sphere, find_balls
from dermis.mesh.fitted_eyes.globe_rig import Globe, with_globes
from dermis.mesh.fitted_eyes.lids import axes_along, lids_before
from dermis.mesh.geometry import halves
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.rig import Stencils

_SIDE = 2 * eyeball.SIDE  # as fine as the human's own once it is subdivided
_NAMES = "left eye", "right eye"
_INWARDS = np.radians(2.5)  # an iris lies nearer to the nose than the middle of what is seen of the white


class _Shape(NamedTuple):
    """Of a fitted eye.

    Corneas and irises hardly differ between people: those of larger balls are of usual size, and only smaller
    balls are small in all.

    axis : (3,) unit vector along which its cornea lies
    ball_mm, middle_mm : see `Eyes`
    scale : how long a mm of a usual eye is in the head [mm]
    """

    axis: Doubles
    ball_mm: float
    middle_mm: float
    scale: float


@logged_step("fitting the eyes")
def with_fitted_eyes(head: Head, coarse: Mesh | None = None, look: EyeLook | None = None) -> Head:
    """The head with the package's eyes where its file calls something eyes that is two balls.

    The new balls have the radius and the place of those, look along their corneas or straight ahead, and
    follow their bones and targets rigidly. Where they cannot be fitted, the head stays as it is, and its
    `note` says why.

    coarse : the mesh of a head that is subdivided, as it was before, when the lids lay on the balls
    look : of the eyes
    """
    mesh, control = head.mesh, head.control
    found, why = find_balls(coarse or mesh)
    if found is None:
        return replace(head, note=why)
    those = _of_balls(mesh, control.stencils, found)
    shapes = _shapes(np.delete(mesh.positions[mesh.triangles], np.concatenate(those), axis=0), found)
    points, quads = globe(_SIDE)
    places = [_placed(ball.sphere, shape) for ball, shape in zip(found, shapes, strict=True)]
    balls = [Globe(ball.sphere.middle, own, ball.points) for ball, own in zip(found, places, strict=True)]
    corner = mesh.point if control.corner is None else control.corner
    rig = with_globes(replace(control, corner=corner), balls)
    begin, count = len(control.positions_mm), len(points)
    if control.stencils is not None:
        rig = replace(rig, stencils=_with_rows(control.stencils, begin, 2 * count))
    made = _with_meshes(mesh, those, places, quads)
    apex, back, side = (np.array([begin + k, begin + count + k], np.int32) for k in eyeball.marks(_SIDE))
    material = np.arange(-2, 0, dtype=np.int32) + len(made.materials)
    balls_mm, middles_mm = np.array([(shape.ball_mm, shape.middle_mm) for shape in shapes]).T
    sight = np.stack([axes_along(shape.axis) @ ball.sight for ball, shape in zip(found, shapes, strict=True)])
    eyes = Eyes(apex, back, side, material, look or EyeLook(), balls_mm, middles_mm, sight)
    return replace(head, mesh=made, rig=rig, eyes=eyes)


def _of_balls(mesh: Mesh, stencils: Stencils | None, balls: tuple[Ball, Ball]) -> tuple[Index, Index]:
    """The triangles of each ball in the mesh, which may be subdivided."""
    first = mesh.point[mesh.triangles[:, 0]]
    if stencils is not None:
        first = stencils.point[stencils.first[first]]
    left, right = (np.flatnonzero(np.isin(first, ball.points)) for ball in balls)
    return left, right


def _shapes(corners_mm: Doubles, balls: tuple[Ball, Ball]) -> list[_Shape]:
    """The shapes of both eyes; those that no cornea tells of fit the lids before them.

    corners_mm : (f, 3, 3) of all other triangles
    """
    lids = [lids_before(corners_mm, ball.sphere, ball.sight) for ball in balls]
    (left, a), (right, b) = (one.iris for one in lids)
    outwards, up = (left - right) / 2 - _INWARDS * (left != right), (a + b) / 2
    found = []
    for ball, before, side in zip(balls, lids, (1.0, -1.0), strict=True):
        scale, sunk, axis = min(1.0, ball.sphere.radius / SCLERA_MM), 0.0, ball.sight
        if not ball.cornea:
            axis = before.looking(side * outwards, up)
            sunk = before.sunk_mm(axis, scale) / scale
        radius = ball.sphere.radius / scale
        found.append(_Shape(axis, radius, plane_mm(SCLERA_MM) - plane_mm(radius) + sunk, scale))
    return found


def _placed(ball: Sphere, shape: _Shape) -> Doubles:
    """(n, 3) points of an eyeball in the head [mm]."""
    return np.asarray(ball.middle + shape.scale * _points(shape) @ axes_along(shape.axis))


def _points(shape: _Shape) -> Doubles:
    """(n, 3) points of an eyeball around its middle, of any radius, with a usual cornea [mm]."""
    points, _ = globe(_SIDE)
    along = points / np.linalg.norm(points, axis=1, keepdims=True)
    angle, turn = np.arccos(np.clip(along[:, 2], -1.0, 1.0)), np.arctan2(along[:, 1], along[:, 0])
    centre = cornea_centre_mm() - shape.middle_mm
    meeting = (shape.ball_mm**2 - CORNEA_MM**2 + centre**2) / (2 * centre)  # along the axis
    white, edge = float(np.arccos(meeting / shape.ball_mm)), float(np.arcsin(LIMBUS_MM / SCLERA_MM))
    clear = float(np.arccos((meeting - centre) / CORNEA_MM)) * angle / edge
    behind = white + (angle - edge) * (np.pi - white) / (np.pi - edge)
    off = np.where(angle < edge, CORNEA_MM * np.sin(clear), shape.ball_mm * np.sin(behind))
    far = np.where(angle < edge, centre + CORNEA_MM * np.cos(clear), shape.ball_mm * np.cos(behind))
    return np.stack([off * np.cos(turn), off * np.sin(turn), far], axis=1)


def _with_rows(stencils: Stencils, begin: int, count: int) -> Stencils:
    """The stencils with control points more that are points themselves, from one number on."""
    own = np.arange(count, dtype=np.int32)
    return Stencils(
        np.concatenate([stencils.first, stencils.first[-1] + 1 + own]),
        np.concatenate([stencils.point, begin + own]),
        np.concatenate([stencils.weight, np.ones(count, np.float32)]),
    )


def _with_meshes(mesh: Mesh, balls: tuple[Index, Index], places: list[Doubles], quads: Index) -> Mesh:
    """The mesh with eyeballs in the place of those of some triangles; its points keep their numbers."""
    stays = np.ones(len(mesh.triangles), bool)
    stays[np.concatenate(balls)] = False
    vertex, triangles = np.unique(mesh.triangles[stays], return_inverse=True)
    used, material = np.unique(mesh.material[stays], return_inverse=True)
    colours = [mesh.materials[mesh.material[ball[0]]].colour for ball in balls]
    made = [Material(name, "opaque", colour, eye=True) for name, colour in zip(_NAMES, colours, strict=True)]
    new = _meshes(places, quads, tuple(made))
    pairs = np.full(len(mesh.triangles), -1)
    pairs[stays] = np.arange(np.count_nonzero(stays))
    kept = pairs[mesh.quads][(pairs[mesh.quads] >= 0).all(axis=1)]
    faces = np.count_nonzero(stays)
    both = {
        name: np.concatenate([getattr(mesh, name)[vertex], getattr(new, name)])
        for name in ("positions", "normals", "uv")
    }
    return Mesh(
        **both,
        point=np.concatenate([mesh.point[vertex], int(mesh.point.max()) + 1 + new.point]).astype(np.int32),
        triangles=np.concatenate([triangles.reshape(-1, 3), len(vertex) + new.triangles]).astype(np.int32),
        material=np.concatenate([material.reshape(-1), len(used) + new.material]).astype(np.int32),
        materials=(*(mesh.materials[k] for k in used), *made),
        quads=np.concatenate([kept, faces + new.quads]).astype(np.int32),
    )


def _meshes(places: list[Doubles], quads: Index, materials: tuple[Material, ...]) -> Mesh:
    """Eyeballs alone, a material each."""
    count, faces = len(places[0]), len(quads)
    return build_mesh(
        np.concatenate(places),
        np.tile(eyeball.layout(_SIDE), (2, 1)),
        halves(np.concatenate([quads, count + quads])),
        np.repeat([0, 1], 2 * faces),
        materials,
        point=np.arange(2 * count),
        quads=np.arange(4 * faces).reshape(-1, 2),
    )
