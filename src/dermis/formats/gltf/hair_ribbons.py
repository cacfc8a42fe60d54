"""Hair that follows one bone, as flat ribbons in exported glTF heads."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index
from dermis.formats.deformable_mesh import DeformableMesh, VertexMorphTarget
from dermis.formats.gltf.binary import VERTEX_TARGET, BufferBuilder
from dermis.formats.gltf.document import Tree
from dermis.formats.gltf.hair_colours import grouped_colours
from dermis.formats.gltf.primitives import to_metres
from dermis.mesh.strand_groups import sufficient_knots
from dermis.mesh.strands import Roots, Strands

_MAX_KNOT_COUNT = 22  # of a ribbon
_MAX_DEVIATION_MM = 1.5  # largest distance of nine tenths of the knots of hairs from their ribbons
_COLOUR_COUNT, _ROWS_PER_COLOUR = 8, 64
_TEXTURE_COLUMNS, _COLUMNS_PER_RIBBON = 256, 36
_STREAK_WIDTH, _GAP_WIDTH = 4, 2  # columns of a streak, which shows one hair, and between streaks
_STREAK_CONTRAST = 0.5  # standard deviation of the logarithm of the brightness of streaks
_MIN_STREAK_LENGTH = 0.75  # relative to the length of the ribbon
_MAX_ROLL = 0.9  # largest roll of ribbons about their tangents, so that some face each viewer [rad]
_MAX_NORMAL_TURN = 0.15  # tangent of the largest angle by which the normal of a ribbon is turned
_MIN_VECTOR_LENGTH = 1e-9


@dataclass(frozen=True, eq=False)
class RibbonPrimitive:
    """Hair as ribbons with the normals of a smooth surface around the head.

    Each ribbon represents several hairs, which its texture shows with gaps between them. The total width of
    all ribbons is that of all hairs.

    deformable : mesh of the head with its deformation
    strands : all hairs
    max_knots : largest number of knots of all ribbons
    """

    deformable: DeformableMesh
    strands: Strands
    max_knots: int

    @cached_property
    def _ribbons(self) -> tuple[Strands, Doubles]:
        """Return the hairs along which the ribbons run, and their knots (n, k, 3) in the rest pose [mm].

        The number of knots is the smallest one that keeps the deviation small.
        """
        mesh = self.deformable.head.mesh
        points = replace(mesh, positions=self.deformable.positions_mm).points_mm
        knot = sufficient_knots(self.strands, _MAX_DEVIATION_MM, _MAX_KNOT_COUNT)
        kept = min(len(self.strands), self.max_knots // len(knot))
        roots = Roots(self.strands.roots.quad[:kept], self.strands.roots.position[:kept])
        fewer = Strands(
            roots,
            self.strands.knots_mm[:kept][:, knot],
            self.strands.radius_mm[:kept][:, knot],
            self.strands.absorption[:kept],
        )
        return fewer, fewer.knot_positions_mm(mesh, points)

    @property
    def root_bone(self) -> int:
        """Return the index of the bone that moves the roots of the hair most."""
        return self.deformable.root_bone(self._ribbons[0].roots)

    def add_primitive(self, buffer_builder: BufferBuilder) -> Tree:
        """Append the vertices and triangles of the ribbons to the buffer, and return a glTF primitive.

        The caller adds the material. The extras of the primitive mark it as hair, so that `read_gltf` skips
        it.
        """
        positions, normals = self.vertices()
        attributes = {
            "POSITION": buffer_builder.add_accessor(to_metres(positions), VERTEX_TARGET, with_bounds=True),
            "NORMAL": buffer_builder.add_accessor(normals.astype(np.float32), VERTEX_TARGET),
            "TEXCOORD_0": buffer_builder.add_normalised(self.streaks_and_uv()[1], VERTEX_TARGET),
        }
        index = buffer_builder.add_triangles(self.triangles(), len(positions))
        return {"attributes": attributes, "indices": index, "extras": {"dermis": {"hair": True}}}

    def add_target(self, buffer_builder: BufferBuilder, morph_target: VertexMorphTarget) -> dict[str, int]:
        """Return an empty dictionary, as the ribbons have no morph targets."""
        return {}

    def is_moved_by(self, morph_target: VertexMorphTarget) -> bool:
        """Return False: the ribbons follow a bone and not the skin."""
        return False

    def vertices(self) -> tuple[Doubles, Doubles]:
        """Return the vertices [mm] and normals of the ribbons, (n * m, 3) each.

        Each ribbon has m = 2 k - 1 vertices: pairs from root to tip, and one at the tip.
        """
        strands, knots = self._ribbons
        tangent = _unit(np.gradient(knots, axis=1))
        outward = knots - self._axis_points(knots)
        outward = _unit(outward - (outward * tangent).sum(axis=-1, keepdims=True) * tangent)
        rng = np.random.default_rng(1)
        roll, turn = rng.uniform(-1.0, 1.0, (2, len(strands), 1, 1))
        across = np.cross(tangent, outward)
        side = np.cos(_MAX_ROLL * roll) * across + np.sin(_MAX_ROLL * roll) * outward
        width_factor = len(self.strands) / len(strands)
        widest = strands.radius_mm.max(axis=1, keepdims=True)
        half_width = (widest * (strands.radius_mm > 0.0))[..., None] * width_factor  # 0 below headwear
        edges = np.stack([knots - half_width * side, knots + half_width * side], axis=2)
        normal = _unit(outward + _MAX_NORMAL_TURN * turn * across)
        return _join_tips(edges, knots), _join_tips(np.stack([normal, normal], axis=2), normal)

    @staticmethod
    def _axis_points(knots_mm: Doubles) -> Doubles:
        """Return for each knot the nearest point of the vertical line below the mean of the roots [mm]."""
        middle = knots_mm[:, 0].mean(axis=0)
        axis = np.broadcast_to(middle, knots_mm.shape).copy()
        axis[..., 1] = np.minimum(knots_mm[..., 1], middle[1])
        return axis

    def triangles(self) -> Index:
        """Return the vertex indices of the triangles of all ribbons, (f, 3)."""
        strands, _ = self._ribbons
        knot_count = strands.knots_mm.shape[1]
        a = 2 * np.arange(knot_count - 2)
        quads = [np.stack([a, a + 1, a + 3], axis=1), np.stack([a, a + 3, a + 2], axis=1)]
        tip = 2 * (knot_count - 1)
        own = np.concatenate([*quads, [[tip - 2, tip - 1, tip]]])
        start = (tip + 1) * np.arange(len(strands))
        return np.asarray((start[:, None, None] + own).reshape(-1, 3), np.int64)

    def streaks_and_uv(self) -> tuple[Floats, Floats]:
        """Return a texture of hairs (h, w, 4), linear with alpha, and the uv (n * m, 2) of all vertices.

        The texture consists of one tile above the other, one for each colour. A tile shows hairs as vertical
        streaks of different lengths, with the roots at its top. Each ribbon shows some columns of one tile.
        """
        strands, _ = self._ribbons
        colours, group = grouped_colours(strands, _COLOUR_COUNT)
        rng = np.random.default_rng(0)
        streak, place = np.divmod(np.arange(_TEXTURE_COLUMNS), _STREAK_WIDTH + _GAP_WIDTH)
        brightness = np.exp(_STREAK_CONTRAST * rng.standard_normal(streak[-1] + 1))
        length = rng.uniform(_MIN_STREAK_LENGTH, 1.0, streak[-1] + 1)
        row = (np.arange(_ROWS_PER_COLOUR) + 0.5) / _ROWS_PER_COLOUR
        alpha = (place < _STREAK_WIDTH) & (row[:, None] < length[streak])
        picture = np.empty((_COLOUR_COUNT, _ROWS_PER_COLOUR, _TEXTURE_COLUMNS, 4), np.float32)
        picture[..., :3] = colours[:, None, None] * (brightness / brightness.mean())[streak][:, None]
        picture[..., 3] = alpha
        knot_count = strands.knots_mm.shape[1]
        start = rng.integers(0, _TEXTURE_COLUMNS - _COLUMNS_PER_RIBBON, len(strands))
        edge = np.array([*[0.0, 1.0] * (knot_count - 1), 0.5]) * _COLUMNS_PER_RIBBON
        u = (start[:, None] + edge) / _TEXTURE_COLUMNS
        along = np.append(np.repeat(np.arange(knot_count - 1), 2), knot_count - 1) / (knot_count - 1)
        inside = (0.5 + (_ROWS_PER_COLOUR - 1) * along) / _ROWS_PER_COLOUR
        v = (group[:, None] + inside) / _COLOUR_COUNT
        uv = np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float32)
        return picture.reshape(-1, _TEXTURE_COLUMNS, 4), uv


def _unit(vectors: Doubles) -> Doubles:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, _MIN_VECTOR_LENGTH))


def _join_tips(pairs: Doubles, tips: Doubles) -> Doubles:
    """Return one vector per vertex of all ribbons: both edges at all knots but the last, then the tip.

    pairs : (n, k, 2, 3) vectors at both edges
    tips : (n, k, 3) vectors in the middle, of which those at the last knots are used
    """
    edges = pairs[:, :-1].reshape(len(pairs), -1, 3)
    return np.concatenate([edges, tips[:, -1:]], axis=1).reshape(-1, 3)
