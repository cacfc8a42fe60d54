"""Grooms: hair that the GPU grows along guide curves, which move with the skin of a quad mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, refine_roots

KNOTS_PER_GUIDE = 40
"""Number of knots of each guide."""
NO_CEILING_MM = 1000.0
"""Largest height of strands above the skin where nothing covers them [mm]."""
HIDDEN_CEILING_MM = -200.0
"""Largest height of strands above the skin below which headwear hides them [mm]."""
ANCHORS_PER_GUIDE_KNOT = 4
"""Number of quads that each knot of a guide follows."""
# Pitch of twists relative to their radius; that of braids is 8, see strands_grow.wgsl.
_ROPE_PITCH_RATIO = 7.0
# Length of the shorter wave of frizz, its amplitude relative to `frizz_mm`, the factor by which flyaways
# exceed it (see `frizz_offset` in strands_grow.wgsl), and the fraction of flyaways from which they matter.
_FRIZZ_WAVE_MM, _FRIZZ_WAVE_RATIO, _FLYAWAY_RATIO, _MIN_COUNTED_FLYAWAYS = 31.0, 0.4, 5.0, 0.05


@dataclass(frozen=True, eq=False, repr=False)
class Guides(ShortRepr):
    """Guide curves of `KNOTS_PER_GUIDE` knots from root to tip; each knot follows the quads nearest to it.

    The arrays are for g guides with k knots each, where each knot follows m quads.

    corner : (g, k, m, 4) control points at the corners of the quads, in order around each quad
    local_mm : (g, k, m, 3) position of each knot relative to the mean of each quad's corners: components
        along the quad (from its first to its second corner), across it and along its normal [mm]
    weight : (g, k, m) weights of the quads, which add up to 1 for each knot [-]
    rest_mm : (g, k, 4) position of each knot on the mean person at rest, and its height above the skin [mm]
    cut : (g,) where the style cuts each guide, as a fraction of the guide's length [-]
    ceiling_mm : (g, k) largest height of strands above the skin at each knot near the rim of headwear, and
        `-NO_CEILING_MM` where headwear hides them [mm]; None for hair without headwear
    """

    corner: Ints
    local_mm: Floats
    weight: Floats
    rest_mm: Floats
    cut: Floats
    ceiling_mm: Floats | None = None

    @property
    def ceilings_mm(self) -> Floats:
        """Return `ceiling_mm`, or `NO_CEILING_MM` at all knots."""
        if self.ceiling_mm is not None:
            return self.ceiling_mm
        return np.full(self.rest_mm.shape[:2], NO_CEILING_MM, np.float32)


@dataclass(frozen=True, eq=False, repr=False)
class StrandRoots(ShortRepr):
    """Roots of all strands that a hair style can have, with their guides and clumps.

    The order is progressive: the first n roots are spread evenly over the skin for each n.

    Which of the strands grow depends on hair density, hairline and baldness of the person.

    roots : n roots on quads of the control mesh
    guide, guide_weight : (n, 4) guides between which each strand is interpolated, and their weights
    clump : (n,) index of the strand at the centre of the clump to which each strand belongs
    place : (n, 4) four properties of the spot where each root is: its angle from the front [degrees]; its
        height above the midpoint of the eyes [mm]; how much its hair thins if the crown goes bald, 0 to 1;
        and its position from the nape (0) to the top of the head (1), or from the edge of a beard (0) to
        its middle (1)
    along_mm : (n,) position of each strand's clump along its cornrow [mm]
    part : (n,) index of the row of `Groom.parameters` for each strand: the row of scalp hair or of the beard
    threshold : (n,) density of hair, 0 to 1, from which each strand grows; a random number of the person is
        added to it, modulo 1
    """

    roots: Roots
    guide: Ints
    guide_weight: Floats
    clump: Ints
    place: Floats
    along_mm: Floats
    part: Ints
    threshold: Floats

    def __len__(self) -> int:
        """Return the number of roots."""
        return len(self.clump)


@dataclass(frozen=True, eq=False, repr=False)
class Groom(ShortRepr):
    """Hair of a person: the guides and roots of a hair style, and parameters of the person.

    guides, roots : guides and strand roots of the style
    parameters : (p,) structured array with one row of parameters for scalp hair and one for the beard
    possible : number of roots that the density of the person's hair needs, from the start of `roots`
    strands : number of roots to use, from the start of `roots`; if it is less than `possible`, the strands
        are widened to keep coverage
    knots : number of knots per strand
    hairline_mm : (91,) heights of the hairline at angles of 0 to 180 degrees from the front [mm]
    centre_mm : (3,) centre of the roots on the mean person [mm]
    """

    guides: Guides
    roots: StrandRoots
    parameters: NDArray[np.void]
    possible: int
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
        """Return the number of roots at which a strand may grow.

        Where hair density is low or the person is bald, some of these roots grow no strand.
        """
        return self.strands


def bend_radius_mm(hair_parameters: NDArray[np.void]) -> Doubles:
    """Return the least radius of curvature (p,) of curls, twists and frizz of scalp hair and beard [mm].

    The radius of curvature is r + p^2 / (4 pi^2 r) for a helix of radius r and pitch p, and at least
    w^2 / (4 pi^2 a) for a sine wave of amplitude a and wavelength w.

    hair_parameters : (p,) rows of `Groom.parameters`
    """
    rope = hair_parameters["rope_mm"].astype(float)
    radius = np.maximum(np.where(rope > 0.0, rope, hair_parameters["curl_mm"]), 1e-3)
    pitch = np.where(rope > 0.0, _ROPE_PITCH_RATIO * rope, hair_parameters["pitch_mm"])
    bend = radius + (pitch / (2.0 * np.pi)) ** 2 / radius
    flying = hair_parameters["flyaways"] > _MIN_COUNTED_FLYAWAYS
    frizz = _FRIZZ_WAVE_RATIO * hair_parameters["frizz_mm"] * np.where(flying, _FLYAWAY_RATIO, 1.5)
    waved = (_FRIZZ_WAVE_MM / (2.0 * np.pi)) ** 2 / np.maximum(frizz, 1e-3)
    return np.asarray(np.minimum(bend, waved))
