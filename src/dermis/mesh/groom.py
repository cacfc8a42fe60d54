"""Grooms: hair that a device grows from guide curves, which are bound to the skin of a mesh of quads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Ints
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, refine_roots

GUIDE_KNOTS = 40
"""Number of knots of each guide."""
GUIDE_ANCHORS = 4
"""Number of quads that each knot of a guide follows."""


@dataclass(frozen=True, eq=False)
class Guides:
    """Guide curves of `GUIDE_KNOTS` knots from root to tip; each knot follows the quads nearest to it.

    corner : (g, k, a, 4) control points at the corners of the quads, in order around each quad
    local_mm : (g, k, a, 3) position of the knot in the frame of each quad: along it, across it, and along its
        normal, from the mean of its corners [mm]
    weight : (g, k, a) weight of each quad, with a sum of 1 [-]
    rest_mm : (g, k, 4) position of the knot on the mean person at rest, and its height above the skin [mm]
    cut : (g,) fraction of each guide from its root to where the style cuts it [-]
    """

    corner: Ints
    local_mm: Floats
    weight: Floats
    rest_mm: Floats
    cut: Floats


@dataclass(frozen=True, eq=False)
class StrandRoots:
    """Possible strands of a hair style, in random order; the look of a person decides which of them grow.

    roots : n roots on quads of the control mesh
    guide, guide_weight : (n, 4) guides between which each strand is interpolated, and their weights
    clump : (n,) strand at the middle of the clump to which each strand belongs
    place : (n, 4) angle from the front [degrees], and height above the midpoint of the eyes [mm], by which
        the hairline decides whether the strand grows; thinning on a receding crown, 0 to 1; and position
        between the nape, 0, and the top of the head, 1
    along_mm : (n,) position of the clump along its row, by which the braids of a row continue each other [mm]
    part : (n,) index of the part of the groom, such as scalp and beard
    """

    roots: Roots
    guide: Ints
    guide_weight: Floats
    clump: Ints
    place: Floats
    along_mm: Floats
    part: Ints

    def __len__(self) -> int:
        """Return the number of possible strands."""
        return len(self.clump)


@dataclass(frozen=True, eq=False)
class Groom:
    """Hair of a person: the tables of a style, which people share, and the numbers of the person.

    guides, roots : tables of the style
    parameters : (p,) structured array, one element for each part of the groom
    strands : number of strands to grow, the first of `roots`; they are wider, to keep coverage
    knots : number of knots per strand
    hairline_mm : (91,) height of the hairline by angle from the front, every 2 degrees [mm]
    centre_mm : (3,) centre of the roots on the mean person [mm]
    """

    guides: Guides
    roots: StrandRoots
    parameters: NDArray[np.void]
    strands: int
    knots: int
    hairline_mm: Floats
    centre_mm: Doubles

    def refined(self, mesh: Mesh, levels: int) -> Groom:
        """Return this groom with roots on the Catmull-Clark subdivision of a mesh.

        The guides follow the control points, which the subdivided mesh has too.

        mesh, levels : mesh before subdivision, and number of subdivision steps
        """
        roots = replace(self.roots, roots=refine_roots(mesh, self.roots.roots, levels))
        return replace(self, roots=roots)

    def __len__(self) -> int:
        """Return the number of strands, of which the look of the person may leave out some."""
        return self.strands
