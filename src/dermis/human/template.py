"""What people share: the topology of a layout at a level of subdivision, and one atlas for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from dermis.human.hair.rooting import Rooting, eye_middles
from dermis.human.model import Layout, human_head
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.subdivide import Refinement, refinement

_SHARE = 1 / 6
MEAN = {
    f"macrodetails/{people}-{sex}-young": _SHARE
    for people in ("african", "asian", "caucasian")
    for sex in ("female", "male")
}
"""Weights of the person whom atlas and tables are made for, and whose brows are where the artist has them."""


@dataclass(frozen=True, eq=False)
class Template:
    """What all people with a layout and a level have in common.

    head : the mean person, bare
    rooting : where brows and lashes grow on it
    refinement : how meshes are refined; None at level 0
    """

    head: Head
    rooting: Rooting
    refinement: Refinement | None

    def shaped(self, plain: Head) -> Head:
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
    head = plain = human_head(MEAN, Maps(), layout, EyeLook())
    found = refinement(plain.mesh, levels) if levels else None
    if found is not None:
        rig = replace(plain.control, stencils=found.stencils)
        head = replace(plain, mesh=found.mesh(plain.mesh), rig=rig, levels=levels)
    mean_mm = plain.control.positions_mm.astype(np.float64)
    return Template(head, Rooting(plain.mesh, mean_mm, eye_middles(plain.mesh), head.mesh), found)
