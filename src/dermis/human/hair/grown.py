"""Hairs as they are grown, before they are joined."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.human.hair.skin import Skin
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, finer_roots, frames, points_of


class Rooted:
    """Roots on the head as it is drawn.

    places, frame : (n, 3) and (n, 3, 3), from `frames` [mm]
    """

    def __init__(self, roots: Roots, places: Doubles, frame: Doubles) -> None:
        self.roots, self.places, self.frame = roots, places, frame

    @property
    def normals(self) -> Doubles:
        """(n, 3) of the skin."""
        return np.asarray(self.frame[:, 2])

    @cached_property
    def along(self) -> Floats:
        """(3, 3, n) the frames, roots last."""
        return np.ascontiguousarray(self.frame.transpose(1, 2, 0), np.float32)


class Ground:
    """What hair grows on: the head as it is drawn, and its mesh before it was subdivided.

    skin : of the head, where hairs lie
    share : of the usual number of hairs that grows, each as much wider
    """

    def __init__(self, head: Head, plain: Mesh, skin: Skin, share: float = 1.0) -> None:
        self.plain, self.skin, self.share = plain, skin, share
        self._mesh, self._levels = head.mesh, head.levels
        self._columns = np.ascontiguousarray(points_of(head.mesh).T)

    @property
    def points_mm(self) -> Doubles:
        """(p, 3) of the drawn mesh, the control points first; numbers lie as `frames` reads them."""
        return self._columns.T

    def rooted(self, roots: Roots) -> Rooted:
        """Roots on quads of the plain mesh."""
        finer = finer_roots(self.plain, roots, self._levels)
        return Rooted(finer, *frames(self._mesh, finer, self.points_mm))


class Grown(NamedTuple):
    """Hairs of one kind.

    knots, radius : (n, k, 3) in the frames of the roots, as `Strands` has them, and (n, k) [mm]
    darker : factor of their pigments
    bundle : how many hairs each stands for
    cover : of roots by the hair around them
    """

    roots: Roots
    knots: Floats
    radius: Floats
    darker: float
    bundle: float = 1.0
    cover: float = 0.0
