"""Grooms: hair that the device grows from guide curves, which move with the skin of a quad mesh."""

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

    The arrays are for g guides, k knots per guide and a quads per knot.

    corner : (g, k, a, 4) control points at the corners of the quads, in order around each quad
    local_mm : (g, k, a, 3) position of each knot relative to each quad: components along the quad, across it
        and along its normal, from the mean of the corners [mm]
    weight : (g, k, a) weights of the quads, which add up to 1 for each knot [-]
    rest_mm : (g, k, 4) position of each knot on the mean person at rest, and its height above the skin [mm]
    cut : (g,) fraction of the length of each guide at which the style cuts it [-]
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
    clump : (n,) index of the strand in the middle of the clump to which each strand belongs
    place : (n, 4) place of each root on the head: angle from the front [degrees]; height above the midpoint
        of the eyes [mm], to be compared with the height of the hairline; thinning of the hair if the crown
        recedes, 0 to 1; and position from the nape (0) to the top of the head (1)
    along_mm : (n,) position of each clump along its cornrow, so that the braids of consecutive clumps join
        [mm]
    part : (n,) index of the part of the groom, such as scalp or beard
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
    """Hair of a person: guides and roots that all people with a style share, and parameters of the person.

    guides, roots : guides and possible strands of the style
    parameters : (p,) structured array with the parameters of each part of the groom, such as scalp or beard
    strands : number of possible strands to use, from the start of `roots`; if some are unused, the strands
        are widened to keep coverage
    knots : number of knots per strand
    hairline_mm : (91,) heights of the hairline at angles of 0 to 180 degrees from the front [mm]
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

        The guides stay the same, because they follow control points, which the subdivided mesh keeps.

        mesh : mesh before subdivision
        levels : number of subdivision steps
        """
        roots = replace(self.roots, roots=refine_roots(mesh, self.roots.roots, levels))
        return replace(self, roots=roots)

    def __len__(self) -> int:
        """Return the number of strands, including strands that the look of the person leaves out."""
        return self.strands
