"""The parametric human: heads of people with expressions, neck, jaw and moving eyes, and their template."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.human import lids, teeth
from dermis.human.hair.root_finder import RootFinder, eye_centres
from dermis.human.lids import fit_lid_targets
from dermis.human.makehuman import Points, mesh_point_count, model_data, morphed_points_mm
from dermis.human.movement import expression_targets, gaze_turns, skeleton
from dermis.mesh import eyeball
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyes import Eyes
from dermis.mesh.geometry import halves
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material, build_mesh
from dermis.mesh.rig import Rig
from dermis.mesh.subdivide import Refinement, refinement

Layout = Literal["own", "hm08"]
Index = NDArray[np.int64]

CREDIT = "MakeHuman community, CC0"
_EYE_COLOUR, _TOOTH_COLOUR, _TONGUE_COLOUR = (0.85, 0.83, 0.8), (0.7, 0.66, 0.56), (0.45, 0.16, 0.14)
LEFT_EYE, RIGHT_EYE = "helper-l-eye", "helper-r-eye"
MATERIALS = {
    "body": Material("skin"),
    LEFT_EYE: Material("left eye", "opaque", _EYE_COLOUR),
    RIGHT_EYE: Material("right eye", "opaque", _EYE_COLOUR),
    "helper-upper-teeth": Material("upper teeth", "opaque", _TOOTH_COLOUR, "upper teeth"),
    "helper-lower-teeth": Material("lower teeth", "opaque", _TOOTH_COLOUR, "lower teeth"),
    "helper-tongue": Material("tongue", "opaque", _TONGUE_COLOUR, "tongue"),
    "cap": Material("cut", "opaque", (0.02, 0.02, 0.02)),
}
"""Groups of quads, and what they are."""
_EQUAL_WEIGHT = 1 / 6
MEAN_WEIGHTS = {
    f"macrodetails/{people}-{sex}-young": _EQUAL_WEIGHT
    for people in ("african", "asian", "caucasian")
    for sex in ("female", "male")
}
"""Weights of the person whom atlas and tables are made for, and whose brows are where the artist has them."""


class _LayoutFaces(NamedTuple):
    """The faces of a layout, the same for all people.

    point : (v,) of each vertex
    uv : (v, 2)
    quads : (q, 4) vertices
    material : (q,) index into `MATERIALS`
    """

    point: Index
    uv: Points
    quads: Index
    material: Index


def build_head(weights: Mapping[str, float], maps: Maps, layout: Layout, eyes: EyeLook) -> Head:
    """The head of a person, see `Human.head`.

    weights : of published targets
    """
    points_mm, faces = morphed_points_mm(weights), _layout_faces(layout)
    sockets = _sockets(points_mm)
    (left, left_centre), (right, right_centre) = map(lids.place_eyeball, sockets)
    points = np.concatenate([lids.fit_lids(points_mm, sockets)[: mesh_point_count()], left, right])
    mesh = build_mesh(
        points[faces.point],
        faces.uv,
        halves(faces.quads),
        np.repeat(faces.material, 2),
        tuple(MATERIALS.values()),
        point=faces.point,
        quads=np.arange(2 * len(faces.quads)).reshape(-1, 2),
    )
    bones = skeleton(points_mm[mesh_point_count() :], (left_centre, right_centre), len(left))
    moved = replace(expression_targets(), delta_mm=fit_lid_targets(points_mm, sockets))
    apex, back, _ = eyeball.marks()
    contact = lids.lid_contact(mesh_point_count(), len(left), apex, back)
    rig = Rig(points.astype(np.float32), moved, bones, turns=gaze_turns(), contact=contact)
    return Head("human", mesh, maps, CREDIT, rig, _eyes(eyes))


def control_points_mm(weights: Mapping[str, float]) -> NDArray[np.float32]:
    """(p, 3) where the control points of a person lie, see `Human.positions_mm` [mm]."""
    points_mm = morphed_points_mm(weights)
    sockets = _sockets(points_mm)
    balls = [lids.place_eyeball(eye)[0] for eye in sockets]
    return np.concatenate([lids.fit_lids(points_mm, sockets)[: mesh_point_count()], *balls]).astype(
        np.float32
    )


def _sockets(points_mm: Points) -> tuple[lids.EyeSocket, lids.EyeSocket]:
    """The left and the right eye."""
    left, right = (lids.fit_socket(points_mm[_published_eyeball(name)]) for name in (LEFT_EYE, RIGHT_EYE))
    return left, right


@cache
def _published_eyeball(name: str) -> Index:
    """Points of a published ball."""
    found = model_data()
    group = list(map(str, found["group_names"])).index(name)
    return np.unique(found["quads"][found["group"] == group]).astype(np.int64)


def _eyes(look: EyeLook) -> Eyes:
    size = len(lids.eyeball_mesh()[0])
    apex, back, side = (
        np.array([mesh_point_count() + mark, mesh_point_count() + size + mark], np.int32)
        for mark in eyeball.marks()
    )
    material = np.array([list(MATERIALS).index(name) for name in (LEFT_EYE, RIGHT_EYE)], np.int32)
    return Eyes(apex, back, side, material, look)


@cache
def _layout_faces(layout: Layout) -> _LayoutFaces:
    uv, quads, corner, material = _quads(layout)
    both = np.stack([quads, corner], axis=-1).reshape(-1, 2)
    pairs, vertex = np.unique(both, axis=0, return_inverse=True)
    return _LayoutFaces(pairs[:, 0], uv[pairs[:, 1]], vertex.reshape(-1, 4), material)


def _quads(layout: Layout) -> tuple[Points, Index, Index, Index]:
    """All quads, with eyeballs of true shape instead of the published ones.

    uv (u, 2), points of quads (q, 4), their corners in uv (q, 4), and what they are made of (q,).
    """
    found = model_data()
    if layout == "own":
        uv, corner = found["uv"].astype(np.float64), found["quads_uv"].astype(np.int64)
    else:  # which has no cut
        uv, corner = found["uv1"] * [1.0, -1.0] + [0.0, 1.0], found["quads_uv1"].astype(np.int64)
    names = [str(found["group_names"][group]) for group in found["group"][: len(corner)]]
    stays = np.array([name not in (LEFT_EYE, RIGHT_EYE) for name in names])
    material = np.array([list(MATERIALS).index(name) for name in names])
    ball, quads = lids.eyeball_mesh()
    size, points = len(ball), found["quads"][: len(corner)].astype(np.int64)
    for upper, name in ((True, "helper-upper-teeth"), (False, "helper-lower-teeth")):
        own, points_mm = teeth.layout(upper)
        those = np.array(names) == name
        corner[those] = len(uv) + np.searchsorted(own, points[those])
        uv = np.concatenate([uv, points_mm])
    eyes = [np.full(len(quads), list(MATERIALS).index(name)) for name in (LEFT_EYE, RIGHT_EYE)]
    return (
        np.concatenate([uv, eyeball.layout()]),
        np.concatenate([points[stays], mesh_point_count() + quads, mesh_point_count() + size + quads]),
        np.concatenate([corner[stays], len(uv) + quads, len(uv) + quads]),
        np.concatenate([material[stays], *eyes]),
    )


@dataclass(frozen=True, eq=False)
class Template:
    """What all people with a layout and a level have in common.

    head : the mean person, bare
    rooting : where brows and lashes grow on it
    refinement : how meshes are refined; None at level 0
    """

    head: Head
    root_finder: RootFinder
    refinement: Refinement | None

    def refine_head(self, plain: Head) -> Head:
        """A person's head on the finer mesh, drawn by the template's atlas and tables.

        plain : before any subdivision, of the same layout
        """
        rig = replace(plain.control, stencils=self.head.control.stencils, template=self.head.control)
        mesh = plain.mesh if self.refinement is None else self.refinement.mesh(plain.mesh)
        return replace(plain, mesh=mesh, rig=rig, levels=self.head.levels, template=self.head)


@cache
def template(layout: Layout, levels: int) -> Template:
    """The template of a layout.

    levels : of subdivision
    """
    head = plain = build_head(MEAN_WEIGHTS, Maps(), layout, EyeLook())
    found = refinement(plain.mesh, levels) if levels else None
    if found is not None:
        rig = replace(plain.control, stencils=found.stencils)
        head = replace(plain, mesh=found.mesh(plain.mesh), rig=rig, levels=levels)
    mean_mm = plain.control.positions_mm.astype(np.float64)
    return Template(head, RootFinder(plain.mesh, mean_mm, eye_centres(plain.mesh), head.mesh), found)
