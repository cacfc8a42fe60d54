"""Replacement of the eyeballs of a file by eyeballs of realistic shape."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.base.progress import logged_step
from dermis.mesh import eyeball
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import (
    CORNEA_MM,
    LIMBUS_MM,
    SCLERA_MM,
    build_eyeball,
    cornea_centre_mm,
    limbus_plane_mm,
)
from dermis.mesh.eyes import Eyes
from dermis.mesh.fitted_eyes.balls import DetectedEyeball, Sphere, find_eyeballs
from dermis.mesh.fitted_eyes.eyeball_rig import FittedEyeball, with_eyeballs
from dermis.mesh.fitted_eyes.lids import eye_axes, lids_in_front
from dermis.mesh.geometry import split_quads
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.rig import Stencils

# quads along a cube edge, as many as the human has after one subdivision
_QUADS_PER_CUBE_EDGE = 2 * eyeball.QUADS_PER_EDGE
_EYE_MATERIAL_NAMES = "left eye", "right eye"
# the iris is closer to the nose than the centre of the eye's opening
_INWARD_GAZE_ANGLE_RADIANS = np.radians(2.5)


class _EyeShape(NamedTuple):
    """Shape of a fitted eye.

    Cornea and iris have nearly the same size in all adults. A ball larger than an adult's therefore keeps a
    cornea of adult size. In an eye smaller than an adult's, ball and cornea are scaled by the same factor.

    axis : (3,) unit vector from the centre of the ball to the cornea
    radius_mm, centre_offset_mm : radius and offset of the ball before scaling, see `Eyes` [mm]
    scale : size of the eye relative to an adult's, at most 1 [-]
    """

    axis: Doubles
    radius_mm: float
    centre_offset_mm: float
    scale: float


@logged_step("fitting the eyes")
def with_fitted_eyes(head: Head, coarse_mesh: Mesh | None = None, eye_look: EyeLook | None = None) -> Head:
    """Return a head whose two eyeballs from a file are replaced by standard eyeballs with a cornea.

    The fitted eyeballs have the radius and position of the file's eyeballs, and follow the same bones and
    morph targets as rigid bodies. They look along the axes of the file's corneas or, if the file's eyeballs
    have no corneas, through the opening of the lids. If the file does not have two eyeballs, the head is
    returned unchanged, with the reason in its `note`.

    coarse_mesh : mesh of a subdivided head before subdivision, in which the lids still touch the eyeballs;
        None if the head is not subdivided
    eye_look : appearance of the eyes
    """
    mesh, control = head.mesh, head.control_rig
    balls, reason = find_eyeballs(coarse_mesh or mesh)
    if balls is None:
        return replace(head, note=reason)
    ball_triangles = _ball_triangles(mesh, control.stencils, balls)
    shapes = _eye_shapes(
        np.delete(mesh.positions[mesh.triangles], np.concatenate(ball_triangles), axis=0), balls
    )
    points, quads = build_eyeball(_QUADS_PER_CUBE_EDGE)
    pairs = list(zip(balls, shapes, strict=True))
    eyeballs = [
        FittedEyeball(b.sphere.centre, _eyeball_points(b.sphere, shape), b.points) for b, shape in pairs
    ]
    rig = with_eyeballs(control, eyeballs)
    begin, count = len(control.positions_mm), len(points)
    if control.stencils is not None:
        rig = replace(rig, stencils=_extend_stencils(control.stencils, begin, 2 * count))
    new_mesh = _replace_eyeballs(mesh, ball_triangles, [one.points for one in eyeballs], quads)
    starts = np.array([begin, begin + count], np.int32)
    apex, back, side = (starts + np.int32(k) for k in eyeball.axis_points(_QUADS_PER_CUBE_EDGE))
    material = np.arange(-2, 0, dtype=np.int32) + len(new_mesh.materials)
    radii, offsets = np.array([(shape.radius_mm, shape.centre_offset_mm) for shape in shapes]).T
    gaze = np.stack([eye_axes(shape.axis) @ ball.gaze for ball, shape in pairs])
    eyes = Eyes(apex, back, side, material, eye_look or EyeLook(), radii, offsets, gaze)
    return replace(head, mesh=new_mesh, rig=rig, eyes=eyes)


def _ball_triangles(
    mesh: Mesh, stencils: Stencils | None, detected_eyeballs: tuple[DetectedEyeball, DetectedEyeball]
) -> tuple[Index, Index]:
    """Return the indices of the triangles of the left and of the right eyeball.

    mesh : mesh of the head, which may be subdivided
    stencils : stencils of a subdivided mesh; None without subdivision
    detected_eyeballs : left and right eyeball, detected before subdivision
    """
    first = mesh.point[mesh.triangles[:, 0]]
    if stencils is not None:
        first = stencils.point[stencils.first[first]]
    left, right = (np.flatnonzero(np.isin(first, ball.points)) for ball in detected_eyeballs)
    return left, right


def _eye_shapes(
    corners_mm: Doubles, detected_eyeballs: tuple[DetectedEyeball, DetectedEyeball]
) -> list[_EyeShape]:
    """Return the shapes of the left and of the right fitted eye.

    If an eyeball of the file has no cornea, its axis points through the opening of the lids.

    corners_mm : (f, 3, 3) corners of all triangles except the triangles of eyeballs [mm]
    detected_eyeballs : left and right eyeball of the file
    """
    lids = [lids_in_front(corners_mm, ball.sphere, ball.gaze) for ball in detected_eyeballs]
    (left, a), (right, b) = (one.opening_angles for one in lids)
    outwards, up = (left - right) / 2 - _INWARD_GAZE_ANGLE_RADIANS * (left != right), (a + b) / 2
    shapes = []
    for ball, lid, side in zip(detected_eyeballs, lids, (1.0, -1.0), strict=True):
        scale, sunk, axis = min(1.0, ball.sphere.radius / SCLERA_MM), 0.0, ball.gaze
        if not ball.cornea:
            axis = lid.turned_direction(side * outwards, up)
            sunk = lid.cornea_recess_mm(axis, scale) / scale
        radius = ball.sphere.radius / scale
        offset = limbus_plane_mm(SCLERA_MM) - limbus_plane_mm(radius) + sunk
        shapes.append(_EyeShape(axis, radius, offset, scale))
    return shapes


def _eyeball_points(ball: Sphere, eye_shape: _EyeShape) -> Doubles:
    """Return the points (n, 3) of a fitted eyeball in head space [mm]."""
    return np.asarray(ball.centre + eye_shape.scale * _unscaled_points(eye_shape) @ eye_axes(eye_shape.axis))


def _unscaled_points(eye_shape: _EyeShape) -> Doubles:
    """Return the points (n, 3) of an eyeball before scaling, about its centre and with axis +Z [mm]."""
    points, _ = build_eyeball(_QUADS_PER_CUBE_EDGE)
    x, y, z = (points / np.linalg.norm(points, axis=1, keepdims=True)).T
    angle, azimuth = np.arccos(np.clip(z, -1.0, 1.0)), np.arctan2(y, x)
    centre, radius = cornea_centre_mm() - eye_shape.centre_offset_mm, eye_shape.radius_mm
    limbus = (radius**2 - CORNEA_MM**2 + centre**2) / (2 * centre)  # distance along the axis
    sclera_edge, edge = float(np.arccos(limbus / radius)), float(np.arcsin(LIMBUS_MM / SCLERA_MM))
    on_cornea = float(np.arccos((limbus - centre) / CORNEA_MM)) * angle / edge
    on_sclera = sclera_edge + (angle - edge) * (np.pi - sclera_edge) / (np.pi - edge)
    across = np.where(angle < edge, CORNEA_MM * np.sin(on_cornea), radius * np.sin(on_sclera))
    along = np.where(angle < edge, centre + CORNEA_MM * np.cos(on_cornea), radius * np.cos(on_sclera))
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), along], axis=1)


def _extend_stencils(stencils: Stencils, first_point: int, point_count: int) -> Stencils:
    """Return stencils for a mesh with additional points, each equal to one additional control point.

    first_point : index of the first additional control point
    point_count : number of additional points
    """
    own = np.arange(point_count, dtype=np.int32)
    return Stencils(
        np.concatenate([stencils.first, stencils.first[-1] + 1 + own]),
        np.concatenate([stencils.point, first_point + own]),
        np.concatenate([stencils.weight, np.ones(point_count, np.float32)]),
    )


def _replace_eyeballs(
    mesh: Mesh, ball_triangles: tuple[Index, Index], eyeball_points: list[Doubles], eyeball_quads: Index
) -> Mesh:
    """Return a mesh with fitted eyeballs in place of the file's eyeballs; other points keep their indices.

    ball_triangles : indices of the triangles of each eyeball of the file
    eyeball_points : (n, 3) points of each fitted eyeball [mm]
    eyeball_quads : (q, 4) quads of a fitted eyeball
    """
    remains = np.ones(len(mesh.triangles), bool)
    remains[np.concatenate(ball_triangles)] = False
    vertex, triangles = np.unique(mesh.triangles[remains], return_inverse=True)
    used, material = np.unique(mesh.material[remains], return_inverse=True)
    old_materials = [mesh.materials[mesh.material[ball[0]]] for ball in ball_triangles]
    pairs = zip(_EYE_MATERIAL_NAMES, old_materials, strict=True)
    new_materials = tuple(Material(name, "opaque", old.colour, eye=True) for name, old in pairs)
    new = _eyeball_meshes(eyeball_points, eyeball_quads, new_materials)
    new_index = np.full(len(mesh.triangles), -1)
    new_index[remains] = np.arange(np.count_nonzero(remains))
    old_quads = new_index[mesh.quads][(new_index[mesh.quads] >= 0).all(axis=1)]
    faces = np.count_nonzero(remains)
    return Mesh(
        positions=np.concatenate([mesh.positions[vertex], new.positions]),
        normals=np.concatenate([mesh.normals[vertex], new.normals]),
        uv=np.concatenate([mesh.uv[vertex], new.uv]),
        point=np.concatenate([mesh.point[vertex], int(mesh.point.max()) + 1 + new.point]).astype(np.int32),
        triangles=np.concatenate([triangles.reshape(-1, 3), len(vertex) + new.triangles]).astype(np.int32),
        material=np.concatenate([material.reshape(-1), len(used) + new.material]).astype(np.int32),
        materials=(*(mesh.materials[k] for k in used), *new_materials),
        quads=np.concatenate([old_quads, faces + new.quads]).astype(np.int32),
    )


def _eyeball_meshes(
    eyeball_points: list[Doubles], eyeball_quads: Index, materials: tuple[Material, ...]
) -> Mesh:
    """Return one mesh of both fitted eyeballs, each with its own material.

    eyeball_points : (n, 3) points of each eyeball [mm]
    eyeball_quads : (q, 4) quads of an eyeball
    """
    count, faces = len(eyeball_points[0]), len(eyeball_quads)
    return build_mesh(
        np.concatenate(eyeball_points),
        np.tile(eyeball.eyeball_uv(_QUADS_PER_CUBE_EDGE), (2, 1)),
        split_quads(np.concatenate([eyeball_quads, count + eyeball_quads])),
        np.repeat([0, 1], 2 * faces),
        materials,
        point=np.arange(2 * count),
        quads=np.arange(4 * faces).reshape(-1, 2),
    )
