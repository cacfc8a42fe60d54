"""Candidate positions all over the average human, and the curves of its left side that carry landmarks."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import read_rows
from dermis.human.hair import brows
from dermis.human.model import MATERIAL_OF_GROUP
from dermis.human.regions.average import AVERAGE_HUMAN, average_head, quads_of_parts
from dermis.human.skin.surface import BORDER_FIELDS, average_surface, lid_rings
from dermis.mesh.strands import Roots, quad_corners, quad_weights, refine_roots

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

LEVELS = 3
STEPS = 8  # candidates along a side of a quad
_UPPER, _LOWER = np.arange(13), np.r_[12:28, 0]  # rows of lid_rings.csv, from corner to corner
_EDGE, _CREST = 1, 2  # columns of lid_rings.csv
_SEAM_MM = np.array([[0.0, -67.3], [10, -66.7], [18, -67.2], [22.2, -67.9]])  # x, y where the lips meet
_CORNER_MM = 22.2
_NEAR_MM = 1.2  # search radius around a position in the front plane
# Artist's values on the average human, seen from the front and the side: the outline of the face from in
# front of the ear at the height of the eyes, over the angle of the jaw, to the chin [mm].
_JAW_MM = np.array([[69.5, 0, -57], [68.6, -15, -56], [67, -30, -53], [65.2, -42, -50], [61.6, -52, -45],
                    [58.4, -62, -40], [54.8, -72, -35], [50.4, -81, -31], [45, -88.5, -26], [38, -95, -20],
                    [30, -100.4, -10], [20, -104.6, 0], [10, -106.3, 7], [0, -106.8, 12.5]])  # fmt: skip


class Surface:
    """Dense surface of the average human.

    quad, position : (n,) quad of each candidate and (n, 2) position in it
    at_mm : (n, 3) positions on the average human [mm]
    """

    def __init__(self) -> None:
        self.head = AVERAGE_HUMAN.head(subdivide=LEVELS)
        grid = np.arange(STEPS + 1) / STEPS
        steps = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
        quads = len(average_head().mesh.quads)
        self.quad = np.repeat(np.arange(quads), len(steps))
        self.position = np.tile(steps, (quads, 1)).astype(np.float32)
        fine = refine_roots(average_head().mesh, Roots(self.quad.astype(np.int32), self.position), LEVELS)
        self._corner, self._share = quad_corners(self.head.mesh, fine.quad), quad_weights(fine.position)
        self.points_mm = self.head.mesh.points_mm
        self.at_mm = self._of(self.points_mm)
        self.lips, self.mouth, self.lids = self._of(self._fields()).T

    def _of(self, values: Doubles) -> Doubles:
        return np.asarray(np.einsum("nk,nkc->nc", self._share, values[self._corner]))

    def _fields(self) -> Doubles:
        """Return the (p, 3) fields `BORDER_FIELDS` at the points of the fine mesh."""
        told = average_surface()[1].astype(np.float64)
        control = np.zeros((len(self.head.control_rig.positions_mm), len(BORDER_FIELDS)))
        control[: len(told)] = told
        assert self.head.control_rig.stencils is not None
        return self.head.control_rig.stencils.points(control)

    @cached_property
    def skin(self) -> NDArray[np.bool_]:
        """Return the (n,) mask of candidates on skin."""
        mesh = average_head().mesh
        return np.asarray(mesh.material[mesh.quads[self.quad, 0]] == 0)

    @cached_property
    def face(self) -> NDArray[np.bool_]:
        """Return the (n,) mask of candidates on skin outside mouth and ears."""
        return self.skin & ~np.isin(
            self.quad, np.concatenate([quads_of_parts()["mouth"], quads_of_parts()["ears"]])
        )

    def nearest(self, wanted: Doubles, among: NDArray[np.bool_] | None = None) -> int:
        """Return the index of the candidate nearest to a position (3,) [mm]."""
        those = np.flatnonzero(self.face if among is None else among)
        return int(those[np.linalg.norm(self.at_mm[those] - wanted, axis=1).argmin()])

    def frontmost(self, x: float, y: float) -> int:
        """Return the index of the candidate that is seen from the front at the position x, y [mm]."""
        off = np.hypot(self.at_mm[:, 0] - x, self.at_mm[:, 1] - y)
        near = np.flatnonzero(self.face & (off < _NEAR_MM))
        first = near[self.at_mm[near, 2] > self.at_mm[near, 2].max() - _NEAR_MM]
        return int(first[off[first].argmin()])

    def opposite(self, candidate: int) -> int:
        """Return the index of the mirrored candidate."""
        mirrored = self.at_mm[candidate] * [-1, 1, 1]
        alike = self.skin if self.skin[candidate] else ~self.skin
        same = alike & (np.abs(self.mouth - self.mouth[candidate]) < 1.0)
        return self.nearest(mirrored, same)

    def lid(self, upper: bool) -> Doubles:
        """Return the (r, 3) edge of a lid at the eye, from the inner to the outer corner [mm]."""
        rows = lid_rings()[0][_UPPER if upper else _LOWER[::-1]]
        edge, crest = (self.points_mm[rows[:, column]] for column in (_EDGE, _CREST))
        told = average_surface()[1][:, BORDER_FIELDS.index("lids")].astype(np.float64)
        low, high = told[rows[:, _EDGE]], told[rows[:, _CREST]]
        part = (-low / (high - low))[:, None]
        return np.asarray((1 - part) * edge + part * crest)

    def on_lid(self, position: Doubles) -> int:
        """Return the index of the candidate on the edge of the lids nearest to a position (3,) [mm]."""
        return self.nearest(position, self.skin & (np.abs(self.lids) < 0.12) & (self.at_mm[:, 0] > 0))

    def lip_border(self, upper: bool) -> Doubles:
        """Return the (n, 3) outer border of a lip, from the corner of the mouth to its centre [mm]."""
        seam = np.interp(np.abs(self.at_mm[:, 0]), *_SEAM_MM.T)
        side = (self.at_mm[:, 1] > seam + 0.4) if upper else (self.at_mm[:, 1] < seam - 0.4)
        those = self.face & side & (np.abs(self.lips) < 0.3) & (np.abs(self.at_mm[:, 0] - 10.5) < 11.0)
        those &= self.at_mm[:, 2] > 15
        found = self.at_mm[those]
        x = np.linspace(20.0, 0.0, 24)
        near = [found[np.abs(found[:, 0] - each) < 0.8].mean(axis=0) for each in x]
        path = np.column_stack([x, np.stack(near)[:, 1:]])
        return np.concatenate([self.at_mm[[self.mouth_corner()]], path])

    def mouth_corner(self) -> int:
        """Return the index of the candidate at the left corner of the mouth."""
        x, y = _CORNER_MM, float(_SEAM_MM[-1, 1])
        return self.frontmost(x, y)

    def inner_lip(self, upper: bool) -> Doubles:
        """Return the (n, 3) rim of the upper or lower lip, from the corner inwards [mm].

        The rim lies in front of the line on which closed lips touch, so it is visible whether the mouth is
        open or closed.
        """
        return np.asarray(self.points_mm[_lip_rim(upper)])

    def on_inner_lip(self, position: Doubles, upper: bool) -> int:
        """Return the index of the candidate nearest to a position on the rim of the upper or lower lip."""
        mesh = average_head().mesh
        corners = quad_corners(mesh, np.arange(len(mesh.quads)))
        own = np.asarray(np.isin(corners, _lip_rim(upper)[1:]).any(axis=1))
        return self.nearest(position, self.skin & own[self.quad])

    def jaw(self) -> Doubles:
        """Return the (n, 3) outline of the face, from the height of the eyes to the chin [mm]."""
        return _JAW_MM

    def midline(self, y: float) -> int:
        """Return the index of the candidate on the midline at a height [mm]."""
        middle = self.face & (np.abs(self.at_mm[:, 0]) < 0.05) & (self.at_mm[:, 2] > 0)
        those = np.flatnonzero(middle)
        return int(those[np.abs(self.at_mm[those, 1] - y).argmin()])

    def brow(self, across: float) -> Doubles:
        """Return (n, 3) points along the brow from its inner end [mm].

        across : position across the brow, from its lower edge, -1, to its upper edge, 1
        """
        x, y = brows.brow_outline(across).T
        return self.at_mm[[self.frontmost(*each) for each in zip(x, y, strict=True)]]

    def apex(self, name: str) -> int:
        """Return the index of the candidate at the corneal apex of an eye."""
        mesh = average_head().mesh
        material = mesh.material[mesh.quads[self.quad, 0]] == list(MATERIAL_OF_GROUP.values()).index(
            next(one for one in MATERIAL_OF_GROUP.values() if one.name == name)
        )
        those = np.flatnonzero(material)
        return int(those[self.at_mm[those, 2].argmax()])


def points_along(path: Doubles, shares: Doubles) -> Doubles:
    """Return (n, 3) points at fractions (n,) of the length of a path."""
    run = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    return np.stack([np.interp(shares * run[-1], run, column) for column in path.T], axis=-1)


def _lip_rim(upper: bool) -> Index:
    """Return the points of the left half of the rim of a lip, from the corner inwards."""
    rim = np.array([int(row["rim"]) for row in read_rows("dermis.human", "lip_rings")])
    corner = int(average_surface()[0][rim, 0].argmax())
    return rim[corner::-1] if upper else rim[corner:]
