"""Head of the parametric human with eyes, expressions and bones, and the template shared by all people."""

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
from dermis.human.lips import close_lips, mouth_edge
from dermis.human.makehuman import Points, group_points, makehuman_arrays, mesh_point_count, morphed_points_mm
from dermis.human.movement import build_skeleton, expression_targets, gaze_rotations
from dermis.mesh import eyeball
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyes import Eyes
from dermis.mesh.geometry import split_quads
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material, build_mesh
from dermis.mesh.rig import Rig
from dermis.mesh.subdivide import Refinement, refinement

Layout = Literal["own", "hm08"]
Index = NDArray[np.int64]

MAKEHUMAN_CREDIT = "MakeHuman community, CC0"
_EYE_COLOUR, _TOOTH_COLOUR, _TONGUE_COLOUR = (0.85, 0.83, 0.8), (0.7, 0.66, 0.56), (0.45, 0.16, 0.14)
LEFT_EYE, RIGHT_EYE = "helper-l-eye", "helper-r-eye"
MATERIAL_OF_GROUP = {
    "body": Material("skin"),
    LEFT_EYE: Material("left eye", "opaque", _EYE_COLOUR),
    RIGHT_EYE: Material("right eye", "opaque", _EYE_COLOUR),
    "helper-upper-teeth": Material("upper teeth", "opaque", _TOOTH_COLOUR, "upper teeth"),
    "helper-lower-teeth": Material("lower teeth", "opaque", _TOOTH_COLOUR, "lower teeth"),
    "helper-tongue": Material("tongue", "opaque", _TONGUE_COLOUR, "tongue"),
    "cap": Material("cut", "opaque", (0.02, 0.02, 0.02)),
}
"""Material of each group of quads."""
_EQUAL_MACRO_WEIGHT = 1 / 6
MEAN_PERSON_WEIGHTS = {
    f"macrodetails/{people}-{sex}-young": _EQUAL_MACRO_WEIGHT
    for people in ("african", "asian", "caucasian")
    for sex in ("female", "male")
}
"""Morph target weights of the mean person; the uv atlas, tables and brows are defined on this person."""


class _LayoutFaces(NamedTuple):
    """Vertices and quads of the human mesh in one uv layout; they are the same for all people.

    point : (v,) index of the control point of each vertex
    uv : (v, 2) texture coordinates
    quads : (q, 4) vertex indices
    material : (q,) index into `MATERIAL_OF_GROUP`
    """

    point: Index
    uv: Points
    quads: Index
    material: Index


def build_head(target_weights: Mapping[str, float], maps: Maps, layout: Layout, eye_look: EyeLook) -> Head:
    """Return the bare head of a person before subdivision, without hair.

    target_weights : mapping from names of MakeHuman's morph targets to weights
    maps : maps of the skin
    layout : uv layout
    eye_look : look of the eyes
    """
    points_mm, faces = _rest_points_mm(target_weights), _layout_faces(layout)
    sockets = _eye_sockets(points_mm)
    (left, left_centre), (right, right_centre) = map(lids.place_eyeball, sockets)
    points = np.concatenate([lids.fit_lids(points_mm, sockets)[: mesh_point_count()], left, right])
    mesh = build_mesh(
        points[faces.point],
        faces.uv,
        split_quads(faces.quads),
        np.repeat(faces.material, 2),
        tuple(MATERIAL_OF_GROUP.values()),
        point=faces.point,
        quads=np.arange(2 * len(faces.quads)).reshape(-1, 2),
    )
    bones = build_skeleton(points_mm[mesh_point_count() :], (left_centre, right_centre), len(left))
    targets = replace(expression_targets(), delta_mm=fit_lid_targets(points_mm, sockets))
    apex, back, _ = eyeball.axis_points()
    contact = lids.lid_contact(mesh_point_count(), len(left), apex, back)
    rig = Rig(
        points.astype(np.float32),
        targets,
        bones,
        bone_rotations=gaze_rotations(),
        contact=contact,
        mouth_edge=np.append(mouth_edge(), teeth.biting_edge_point()).astype(np.int32),
    )
    return Head("human", mesh, maps, MAKEHUMAN_CREDIT, rig, _build_eyes(eye_look))


def control_points_mm(target_weights: Mapping[str, float]) -> NDArray[np.float32]:
    """Return the control points (p, 3) of a person in rest pose, relative to the midpoint of the eyes [mm].

    target_weights : mapping from names of MakeHuman's morph targets to weights
    """
    points_mm = _rest_points_mm(target_weights)
    sockets = _eye_sockets(points_mm)
    balls = [lids.place_eyeball(eye)[0] for eye in sockets]
    skin = lids.fit_lids(points_mm, sockets)[: mesh_point_count()]
    return np.concatenate([skin, *balls]).astype(np.float32)


def _rest_points_mm(target_weights: Mapping[str, float]) -> Points:
    """Return MakeHuman's points (n, 3) of a person with closed lips and with teeth behind them [mm]."""
    return teeth.place_teeth(close_lips(morphed_points_mm(target_weights)))


def _eye_sockets(points_mm: Points) -> tuple[lids.EyeSocket, lids.EyeSocket]:
    """Return the sockets of the left and the right eye, from MakeHuman's points of a person."""
    left, right = (lids.fit_socket(points_mm[group_points(name)]) for name in (LEFT_EYE, RIGHT_EYE))
    return left, right


def _build_eyes(eye_look: EyeLook) -> Eyes:
    size = len(lids.eyeball_mesh()[0])
    first = mesh_point_count() + np.array([0, size], np.int32)
    apex, back, side = (np.asarray(first + point, np.int32) for point in eyeball.axis_points())
    material = np.array([list(MATERIAL_OF_GROUP).index(name) for name in (LEFT_EYE, RIGHT_EYE)], np.int32)
    return Eyes(apex, back, side, material, eye_look)


@cache
def _layout_faces(layout: Layout) -> _LayoutFaces:
    uv, quads, corner, material = _combined_quads(layout)
    both = np.stack([quads, corner], axis=-1).reshape(-1, 2)
    pairs, vertex = np.unique(both, axis=0, return_inverse=True)
    return _LayoutFaces(pairs[:, 0], uv[pairs[:, 1]], vertex.reshape(-1, 4), material)


def _combined_quads(layout: Layout) -> tuple[Points, Index, Index, Index]:
    """Return the quads of a uv layout, with anatomical eyeballs in place of MakeHuman's.

    The arrays are uv (u, 2), control point indices (q, 4), uv indices (q, 4) and material indices (q,).
    """
    arrays = makehuman_arrays()
    if layout == "own":
        uv, corner = arrays["uv"].astype(np.float64), arrays["quads_uv"].astype(np.int64)
    else:  # without the cut surface of the neck
        uv, corner = arrays["uv1"] * [1.0, -1.0] + [0.0, 1.0], arrays["quads_uv1"].astype(np.int64)
    names = [str(arrays["group_names"][group]) for group in arrays["group"][: len(corner)]]
    is_kept = np.array([name not in (LEFT_EYE, RIGHT_EYE) for name in names])
    material = np.array([list(MATERIAL_OF_GROUP).index(name) for name in names])
    ball, quads = lids.eyeball_mesh()
    size, points = len(ball), arrays["quads"][: len(corner)].astype(np.int64)
    for upper, name in ((True, "helper-upper-teeth"), (False, "helper-lower-teeth")):
        tooth_points, tooth_uv = teeth.teeth_layout(upper)
        is_tooth = np.array(names) == name
        corner[is_tooth] = len(uv) + np.searchsorted(tooth_points, points[is_tooth])
        uv = np.concatenate([uv, tooth_uv])
    eyes = [np.full(len(quads), list(MATERIAL_OF_GROUP).index(name)) for name in (LEFT_EYE, RIGHT_EYE)]
    return (
        np.concatenate([uv, eyeball.eyeball_uv()]),
        np.concatenate([points[is_kept], mesh_point_count() + quads, mesh_point_count() + size + quads]),
        np.concatenate([corner[is_kept], len(uv) + quads, len(uv) + quads]),
        np.concatenate([material[is_kept], *eyes]),
    )


@dataclass(frozen=True, eq=False)
class Template:
    """Data shared by all people with the same uv layout and subdivision level.

    head : bare head of the mean person, at this level
    root_finder : finder of brow and lash roots on the mean person
    refinement : subdivision stencils and topology; None at level 0
    """

    head: Head
    root_finder: RootFinder
    refinement: Refinement | None

    def refine_head(self, control_head: Head) -> Head:
        """Return a person's head after subdivision, with the same uv atlas as the mean person's head, `head`.

        control_head : the person's head before subdivision, in the same uv layout as `head`
        """
        rig = replace(
            control_head.control_rig, stencils=self.head.control_rig.stencils, template=self.head.control_rig
        )
        mesh = control_head.mesh
        if self.refinement is not None:
            mesh = self.refinement.subdivided_mesh(mesh)
        return replace(control_head, mesh=mesh, rig=rig, levels=self.head.levels, template=self.head)


@cache
def head_template(layout: Layout, levels: int) -> Template:
    """Return the template for a uv layout and a number of subdivision levels; templates are cached."""
    head = control_head = build_head(MEAN_PERSON_WEIGHTS, Maps(), layout, EyeLook())
    refined = refinement(control_head.mesh, levels) if levels else None
    if refined is not None:
        rig = replace(control_head.control_rig, stencils=refined.stencils)
        head = replace(control_head, mesh=refined.subdivided_mesh(control_head.mesh), rig=rig, levels=levels)
    mean_mm = control_head.control_rig.positions_mm.astype(np.float64)
    root_finder = RootFinder(control_head.mesh, mean_mm, eye_centres(control_head.mesh), head.mesh)
    return Template(head, root_finder, refined)
