"""Hair strands on a mesh of quads; each strand moves with the quad of its root."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Ints, Mask
from dermis.base.summary import ShortRepr
from dermis.mesh.geometry import cross_columns, dot_columns
from dermis.mesh.mesh import Mesh

_MIN_LENGTH_MM = 1e-9


class Roots(NamedTuple):
    """Points on the quads of a mesh at which strands are rooted.

    quad : (n,) row of `Mesh.quads`
    position : (n, 2) bilinear coordinates in the quad, 0 to 1: from the first to the second corner, and from
        the first to the last corner
    """

    quad: Ints
    position: Floats


@dataclass(frozen=True, eq=False, repr=False)
class Strands(ShortRepr):
    """Hair strands: thin round fibres, each a polyline of k knots.

    roots : root of each strand
    knots_mm : (n, k, 3) knots from root to tip, relative to the root: components along the root's quad (from
        its first to its second corner), across it, and along its normal
    radius_mm : (n, k) radius of the fibre at the knots
    absorption : (n, 3) absorption coefficient of the fibre [1/mm]
    cover : (n,) projected area of the hair around each root, per area of skin; None if negligible [-]
    is_lash : (n,) whether each strand is a lash; None if no strand is
    """

    roots: Roots
    knots_mm: Floats
    radius_mm: Floats
    absorption: Floats
    cover: Floats | None = None
    is_lash: Mask | None = None

    def __len__(self) -> int:
        """Return the number of strands."""
        return len(self.roots.quad)

    def select(self, mask: Mask) -> Strands:
        """Return the strands for which `mask` (n,) is true."""
        return Strands(
            Roots(self.roots.quad[mask], self.roots.position[mask]),
            self.knots_mm[mask],
            self.radius_mm[mask],
            self.absorption[mask],
            None if self.cover is None else self.cover[mask],
            None if self.is_lash is None else self.is_lash[mask],
        )

    @property
    def without_hidden(self) -> Strands:
        """Return the strands without those that headwear hides completely, whose radius is 0 at all knots."""
        is_visible: Mask = np.asarray((self.radius_mm > 0.0).any(axis=1))
        return self if is_visible.all() else self.select(is_visible)

    def knot_positions_mm(self, mesh: Mesh, points_mm: NDArray[np.floating]) -> Doubles:
        """Return the positions of the knots (n, k, 3) on a posed skin [mm].

        points_mm : (p, 3) points of the posed mesh
        """
        root, frame = root_frames(mesh, self.roots, points_mm)
        return np.asarray(root[:, None] + np.einsum("nic,nki->nkc", frame, self.knots_mm))

    def root_centre_mm(self, mesh: Mesh) -> Doubles:
        """Return the mean position (3,) of the roots on the mesh at rest [mm]."""
        return np.asarray(_root_positions(mesh, self.roots, mesh.points_mm)[0].mean(axis=1))

    def refined(self, mesh: Mesh, finer_mesh: Mesh, levels: int) -> Strands:
        """Return these strands rooted on the Catmull-Clark subdivision `finer_mesh` of `mesh`.

        levels : number of subdivision steps from `mesh` to `finer_mesh`
        """
        _, frame = root_frames(mesh, self.roots, mesh.points_mm)
        offsets_mm = np.einsum("nic,nki->nkc", frame, self.knots_mm)
        roots = refine_roots(mesh, self.roots, levels)
        return replace(self, roots=roots, knots_mm=to_root_frames(finer_mesh, roots, offsets_mm))


def to_root_frames(mesh: Mesh, roots: Roots, offsets_mm: Doubles) -> Floats:
    """Express knot offsets from each root in the frame of that root, as in `Strands.knots_mm`.

    offsets_mm : (n, k, 3) offsets in head space, on the mesh at rest
    """
    return offsets_in_root_axes(root_frames(mesh, roots, mesh.points_mm)[1], offsets_mm)


def offsets_in_root_axes(root_axes: Doubles, offsets_mm: Doubles) -> Floats:
    """Express knot offsets (n, k, 3), measured from each root, in the frame of that root.

    root_axes : (n, 3, 3) axes of the frames as rows, as returned by `root_frames`
    """
    return np.asarray(np.einsum("nic,nkc->nki", root_axes, offsets_mm), np.float32)


def quad_corners(mesh: Mesh, quad_index: NDArray[np.integer]) -> Ints:
    """Return the point indices (n, 4) at the four corners of quads.

    quad_index : (n,) rows of `Mesh.quads`
    """
    first, second = mesh.quads.take(quad_index, axis=0).T
    vertices = np.empty((4, len(quad_index)), np.int32)
    vertices[:3], vertices[3] = mesh.triangles.take(first, axis=0).T, mesh.triangles[:, 1].take(second)
    return mesh.point.take(vertices).T


def quad_weights(bilinear_position: NDArray[np.floating]) -> Doubles:
    """Return the bilinear weights (n, 4) of a quad's corners.

    bilinear_position : (n, 2) bilinear coordinates, see `Roots`
    """
    s, t = bilinear_position.astype(np.float64).T
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)


def root_frames(mesh: Mesh, roots: Roots, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
    """Return the positions of roots (n, 3) [mm] and their frames (n, 3, 3).

    The rows of a frame are unit vectors along the quad (from its first to its second corner), across it, and
    along its normal.

    points_mm : (p, 3) points of the mesh in a pose
    """
    root, (a, b, c, d) = _root_positions(mesh, roots, points_mm)
    along, normal = (b - a) + (c - d), cross_columns(c - a, d - b)
    along /= np.maximum(np.sqrt(dot_columns(along, along)), _MIN_LENGTH_MM)
    normal -= dot_columns(normal, along) * along
    normal /= np.maximum(np.sqrt(dot_columns(normal, normal)), _MIN_LENGTH_MM)
    return root.T, np.stack([along, cross_columns(normal, along), normal]).transpose(2, 0, 1)


def _root_positions(mesh: Mesh, roots: Roots, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
    """Return the positions of roots (3, n) and of the corners of their quads (4, 3, n) [mm], as columns."""
    columns = np.ascontiguousarray(points_mm.T, np.float64)
    # `take` is ten times faster than indexing
    corners = columns.take(quad_corners(mesh, roots.quad).T, axis=1)
    return interpolate_quads(roots.position, corners), corners.transpose(1, 0, 2)


def interpolate_quads(bilinear_position: NDArray[np.floating], corner_values: Doubles) -> Doubles:
    """Interpolate quantities bilinearly from the corners of quads to one point in each quad.

    Returns an array (c, n) of c quantities at n points.

    bilinear_position : (n, 2) bilinear coordinates of the points, see `Roots`
    corner_values : (c, 4, n) values of c quantities at the corners of n quads
    """
    weight = quad_weights(bilinear_position).T
    result: Doubles = weight[0] * corner_values[:, 0]
    for k in range(1, 4):
        result += weight[k] * corner_values[:, k]
    return result


def refine_roots(mesh: Mesh, roots: Roots, levels: int) -> Roots:
    """Convert roots to the quads and bilinear coordinates of the mesh after Catmull-Clark subdivision.

    The surface points stay the same. The first corner of each finer quad is a corner of the coarser face.

    mesh : mesh before subdivision
    levels : number of subdivision steps
    """
    loose_triangles = len(mesh.triangles) - 2 * len(mesh.quads)
    quad, position = roots.quad.astype(np.int64), roots.position.astype(np.float64)
    for _ in range(levels):
        s, t = position.T
        corner = np.where(t < 0.5, np.where(s < 0.5, 0, 1), np.where(s < 0.5, 3, 2))
        by_corner = np.stack([position, np.stack([t, 1 - s], 1), 1 - position, np.stack([1 - t, s], 1)])
        position = np.clip(2 * by_corner[corner, np.arange(len(quad))], 0.0, 1.0)
        quad, loose_triangles = 3 * loose_triangles + 4 * quad + corner, 0
    return Roots(quad.astype(np.int32), position.astype(np.float32))
