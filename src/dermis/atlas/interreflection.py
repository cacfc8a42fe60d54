"""Form factors between patches of skin that face each other through the air, for interreflection."""

from __future__ import annotations

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.shipped import shipped_arrays
from dermis.base.arrays import Doubles, Floats, Index, Mask
from dermis.base.disk import load_or_make
from dermis.base.progress import logged_step
from dermis.mesh.geometry import expand_runs, merge_near_points
from dermis.mesh.mesh import Mesh

Words = NDArray[np.uint32]

CELLS_PER_SIDE = 128
"""Cells along each side of the uv square. A cell receives light; a patch of 2 x 2 cells emits it."""
SAMPLES_PER_PATCH = 8
"""Number of sample points of a patch; its radiosity is computed at these points."""
# Number of directions of parallel lines; fewest and most lines along a bundle's side.
LINE_BUNDLE_COUNT, LINES_PER_SIDE_RANGE = 128, (96, 256)
_TRIAL_BUNDLE_COUNT, _TRIAL_LINES_PER_SIDE = 12, 64  # for a test whether any skin faces other skin
_FORM_FACTOR_CACHE_VERSION = 5  # increment when `compute_form_factors` gives other results
_MAX_TRACED_TRIANGLES = 300_000  # above this, points closer than _MERGE_DISTANCE_LINE_SPACINGS are merged
_MERGE_DISTANCE_LINE_SPACINGS = 1.5  # distance below which points are merged, in spacings of adjacent lines
_MIN_FORM_FACTOR = 1e-3  # smaller form factors are dropped, and the remaining ones of a cell scaled up
_LINE_RANDOM_SEED = 20
_MAX_TRACING_THREADS = 8
_TRIANGLES_PER_BATCH = 1 << 14  # limits the memory of each thread
_LINE_INDEX_STRIDE = 4096  # stride of line indices: more than the lines along a bundle's side


@dataclass(frozen=True, eq=False)
class FormFactors:
    """Form factors from the cells and patches of the uv square to the patches that they face.

    The uv square is divided into cells, which receive light, and into patches of 2 x 2 cells, which emit it.
    The form factors of all cells are a sparse matrix, and so are those of all patches. Both are stored row by
    row: the entries of row k start at index `..._first[k]` and end before index `..._first[k + 1]`.

    cell_first : (CELLS_PER_SIDE^2 + 1,) index of the first entry of each cell
    cell_target : (k,) index of the patch that the cell faces
    cell_factor : (k,) float32 form factor from the cell to this patch, 0 to 1 [-]
    nearest_patch : (CELLS_PER_SIDE^2,) index of the patch that contains each cell, or of the nearest patch
    confidence : (CELLS_PER_SIDE^2,) float32 number of traced lines that leave each cell, divided by the
        median number, at most 1 [-]
    patch_first, patch_target, patch_factor : as `cell_first`, `cell_target` and `cell_factor`, but for form
        factors from patches, not cells, to patches
    sample_triangle : (p * SAMPLES_PER_PATCH,) uint32 triangle that contains each sample point of the p
        patches
    sample_weights : (p * SAMPLES_PER_PATCH,) uint32 packed weights of that triangle's second and third corner
    """

    cell_first: Words
    cell_target: Words
    cell_factor: Floats
    nearest_patch: Words
    confidence: Floats
    patch_first: Words
    patch_target: Words
    patch_factor: Floats
    sample_triangle: Words
    sample_weights: Words

    @property
    def patch_count(self) -> int:
        """Return the number of patches."""
        return len(self.patch_first) - 1


def cached_form_factors(mesh: Mesh, corner_uv: Floats, mapped_triangles: Mask) -> FormFactors:
    """Return the result of `compute_form_factors`, read from the package or the disk cache if possible.

    corner_uv : (f, 3, 2) uv of the triangles' corners in the atlas
    mapped_triangles : (f,) mask of triangles that have texels
    """
    names = [field.name for field in fields(FormFactors)]
    if shipped := shipped_arrays(mesh, form_factor_table_name(mapped_triangles), names):
        return FormFactors(**shipped)
    cut_out = [np.packbits(mesh.cut_out_mask)] if mesh.cut_out_mask.any() else []
    digest = hashlib.sha256(
        f"{_FORM_FACTOR_CACHE_VERSION} {CELLS_PER_SIDE} {SAMPLES_PER_PATCH} "
        f"{LINE_BUNDLE_COUNT} {LINES_PER_SIDE_RANGE} {_MIN_FORM_FACTOR}".encode()
    )
    for array in (mesh.positions, mesh.triangles, corner_uv, np.packbits(mapped_triangles), *cut_out):
        digest.update(np.ascontiguousarray(array).tobytes())

    @logged_step("computing form factors of the skin")
    def make_form_factor_arrays() -> dict[str, NDArray[np.generic]]:
        form_factors = compute_form_factors(mesh, corner_uv, mapped_triangles)
        return {name: getattr(form_factors, name) for name in names}

    return FormFactors(
        **load_or_make("interreflection", digest.hexdigest()[:40], names, make_form_factor_arrays)
    )


def form_factor_table_name(mapped_triangles: Mask) -> str:
    """Return the table name by which `shipped_arrays` finds form factors that the package contains.

    mapped_triangles : (f,) mask of triangles that have texels
    """
    mapped_hash = hashlib.sha256(np.packbits(mapped_triangles).tobytes()).hexdigest()[:16]
    return f"form factors {_FORM_FACTOR_CACHE_VERSION} {mapped_hash}"


def compute_form_factors(mesh: Mesh, corner_uv: Floats, mapped_triangles: Mask) -> FormFactors:
    """Compute form factors of skin from bundles of random parallel lines [Sbert1993].

    The lines are distributed uniformly over all directions and positions. The form factor from one patch to
    another is the fraction of the lines leaving the first patch that meet the second patch before any other
    surface.

    corner_uv : (f, 3, 2) uv of the triangles' corners in the atlas
    mapped_triangles : (f,) mask of triangles that have texels; the other triangles only block light, or are
        ignored if they have an opacity map, such as hair cards
    """
    facing, line_counts = _trace_lines(
        mesh, corner_uv, mapped_triangles, _TRIAL_BUNDLE_COUNT, _TRIAL_LINES_PER_SIDE
    )
    if len(facing):
        lines = int(np.clip(np.sqrt(len(mesh.triangles)), *LINES_PER_SIDE_RANGE))
        facing, line_counts = _trace_lines(mesh, corner_uv, mapped_triangles, LINE_BUNDLE_COUNT, lines)
    return _form_factors(facing, line_counts, mesh, corner_uv, mapped_triangles)


def _trace_lines(
    mesh: Mesh, corner_uv: Floats, mapped_triangles: Mask, bundle_count: int, lines_per_side: int
) -> tuple[Index, Doubles]:
    """Trace lines through the air between the cells of the uv square, see `FormFactors`.

    Returns the index pairs (m, 2) of cells that a line connects, one pair for each line and direction. Also
    returns the number of lines that leave each cell, (CELLS_PER_SIDE^2,).

    corner_uv : (f, 3, 2) uv of the triangles' corners in the atlas
    mapped_triangles : (f,) mask of triangles that have texels
    bundle_count : number of bundles of parallel lines, one per direction
    lines_per_side : number of lines along each side of a bundle
    """
    blocks = ~mesh.cut_out_mask
    corner_uv, mapped_triangles = corner_uv[blocks], mapped_triangles[blocks]
    used, corner = np.unique(mesh.triangles[blocks], return_inverse=True)
    vertices, corner = mesh.positions[used].astype(np.float64), corner.reshape(-1, 3)
    vertices -= 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    per_mm = 0.5 * lines_per_side / (float(np.linalg.norm(vertices, axis=1).max()) or 1.0)
    if len(corner) > _MAX_TRACED_TRIANGLES:
        vertices, corner = merge_near_points(vertices, corner, _MERGE_DISTANCE_LINE_SPACINGS / per_mm)
        proper = np.flatnonzero((corner != np.roll(corner, 1, axis=1)).all(axis=1))
        corner, corner_uv, mapped_triangles = corner[proper], corner_uv[proper], mapped_triangles[proper]
    x, y, z = np.ascontiguousarray(vertices.T)[:, :, None]
    rng = np.random.default_rng(_LINE_RANDOM_SEED)
    bundle_axes = [
        (
            per_mm * _line_axes(direction, rng.uniform(0.0, 2.0 * np.pi)),
            lines_per_side + rng.uniform(-0.5, 0.5, 2),
        )
        for direction in _hemisphere_directions(bundle_count)
    ]

    def trace_bundle(bundle: tuple[Doubles, Doubles]) -> tuple[Index, Index]:
        axes, offset = bundle
        # a matrix product would depend on the number of threads in its last bits
        points = x * axes[:, 0] + y * axes[:, 1] + z * axes[:, 2] + np.append(offset, 0.0)
        met = []
        for first in range(0, max(len(corner), 1), _TRIANGLES_PER_BATCH):
            part = slice(first, first + _TRIANGLES_PER_BATCH)
            line, depth, outward, triangle, weights = intersect_lines(points[corner[part]])
            cell = np.where(
                mapped_triangles[part][triangle], _cell_index(corner_uv[part][triangle], weights), -1
            )
            met.append((line, depth, outward, cell))
        line, depth, outward, cell = (np.concatenate(parts) for parts in zip(*met, strict=True))
        return _facing_cells(line, depth, outward, cell), cell[cell >= 0]

    line_counts, facing = np.zeros(CELLS_PER_SIDE * CELLS_PER_SIDE), [np.zeros((0, 2), np.int64)]
    with ThreadPoolExecutor(min(os.cpu_count() or 1, _MAX_TRACING_THREADS)) as pool:
        for pairs, cells in pool.map(trace_bundle, bundle_axes):
            facing.append(pairs)
            line_counts += np.bincount(cells, minlength=len(line_counts))
    return np.concatenate(facing), line_counts


def intersect_lines(corners: Doubles) -> tuple[Index, Doubles, Mask, Index, Doubles]:
    """Intersect triangles with all lines parallel to z whose x and y are integers.

    Returns five arrays with one entry for each of n intersections: the line index, z, whether the surface
    faces +z, the triangle index, and the barycentric weights (n, 3) of the triangle's corners.

    corners : (f, 3, 3) corners of the triangles
    """
    x, y, z = np.ascontiguousarray(corners.transpose(2, 1, 0))
    (left, width), (bottom, height) = _crossed_lines(x), _crossed_lines(y)
    count = width * height
    triangle, line_in_box = expand_runs(np.zeros_like(count), count)
    row, column = np.divmod(line_in_box, width[triangle])
    line_x, line_y = left[triangle] + column, bottom[triangle] + row
    (ax, bx, cx), (ay, by, cy) = x[:, triangle] - line_x, y[:, triangle] - line_y
    a, b, c = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
    area = a + b + c
    least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    hit = np.flatnonzero(((area > 0.0) & (least >= 0.0)) | ((area < 0.0) & (most <= 0.0)))
    triangle, area = triangle[hit], area[hit]
    weights = np.stack([a[hit], b[hit], c[hit]], axis=1) / area[:, None]
    depth_a, depth_b, depth_c = weights.T * z[:, triangle]
    line = (line_y[hit] * _LINE_INDEX_STRIDE + line_x[hit]).astype(np.int64)
    return line, depth_a + depth_b + depth_c, area > 0.0, triangle, weights


def _crossed_lines(corner_coordinates: Doubles) -> tuple[Doubles, Index]:
    """Return the lowest integer in each triangle's extent along one axis, and the number of integers in it.

    corner_coordinates : (3, f) coordinate of the triangles' corners along this axis
    """
    low = np.ceil(np.minimum(np.minimum(corner_coordinates[0], corner_coordinates[1]), corner_coordinates[2]))
    high = np.floor(
        np.maximum(np.maximum(corner_coordinates[0], corner_coordinates[1]), corner_coordinates[2])
    )
    return low, np.maximum(high - low + 1, 0).astype(np.int64)


def _facing_cells(line_index: Index, depth: Doubles, faces_forward: Mask, cell_index: Index) -> Index:
    """Return index pairs (m, 2) of cells of the uv square that see each other along a line through the air.

    The first cell is where the line leaves a surface, and the second is where it meets the next surface. Each
    line is followed in both directions, so each connection gives two pairs. Where a surface has no texels, -1
    stands for the cell.

    line_index, depth, faces_forward : (n,) results of `intersect_lines`
    cell_index : (n,) cell of each intersection, -1 if the surface has no texels
    """
    order = np.lexsort((depth, line_index))
    line_index, faces_forward, cell_index = line_index[order], faces_forward[order], cell_index[order]
    # Light leaves a body where the surface faces along the line, and meets the next one where it faces back.
    through_air = (line_index[1:] == line_index[:-1]) & faces_forward[:-1] & ~faces_forward[1:]
    pair = np.stack([cell_index[:-1][through_air], cell_index[1:][through_air]], axis=1)
    return np.concatenate([pair, pair[:, ::-1]])


def _cell_index(corner_uv: Floats, weights: Doubles) -> Index:
    uv = np.einsum("nk,nkc->nc", weights, corner_uv)
    x, y = np.clip((CELLS_PER_SIDE * uv).astype(np.int64), 0, CELLS_PER_SIDE - 1).T
    return np.asarray(y * CELLS_PER_SIDE + x)


def _hemisphere_directions(direction_count: int) -> Doubles:
    """Return (direction_count, 3) unit vectors that are evenly distributed over a hemisphere."""
    index = np.arange(direction_count) + 0.5
    z, phi = index / direction_count, np.pi * (1.0 + np.sqrt(5.0)) * index
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def _line_axes(direction: Doubles, roll_angle: float) -> Doubles:
    """Return the right, up and forward axes (3, 3) of a bundle of lines; forward is `direction`.

    roll_angle : angle by which right and up are rolled about `direction` [rad]
    """
    right = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    right /= np.linalg.norm(right)
    up = np.cross(direction, right)
    c, s = np.cos(roll_angle), np.sin(roll_angle)
    return np.stack([c * right + s * up, c * up - s * right, direction])


def _form_factors(
    facing_cells: Index, line_counts: Doubles, mesh: Mesh, corner_uv: Floats, mapped_triangles: Mask
) -> FormFactors:
    """Return form factors, estimated from the random lines that connect cells of the uv square.

    The form factor from a cell or patch to another patch is the fraction of the lines leaving the former that
    reach the latter.

    facing_cells : (m, 2) index pairs of cells, one pair for each connecting line and direction, from
        `_trace_lines`
    line_counts : (CELLS_PER_SIDE^2,) number of lines that leave each cell
    corner_uv : (f, 3, 2) uv of the triangles' corners in the atlas
    mapped_triangles : (f,) mask of triangles that have texels
    """
    patch_of, triangle, weights = _divide_into_patches(mesh, corner_uv, mapped_triangles)
    count = len(triangle) // SAMPLES_PER_PATCH
    has_texels = (facing_cells >= 0).all(axis=1)
    cell, target = facing_cells[has_texels, 0], patch_of[facing_cells[has_texels, 1]]
    patch, known = patch_of[cell], target >= 0
    left_patch = np.bincount(patch_of[patch_of >= 0], line_counts[patch_of >= 0], count).astype(np.float64)
    usual = np.median(line_counts[line_counts > 0]) if (line_counts > 0).any() else 1.0
    known_patch = known & (patch >= 0)
    return FormFactors(
        *_sparse_form_factors(cell[known], target[known], line_counts, count),
        _nearest_patch(patch_of),
        np.minimum(line_counts / usual, 1.0).astype(np.float32),
        *_sparse_form_factors(patch[known_patch], target[known_patch], left_patch, count),
        triangle,
        weights,
    )


def _nearest_patch(patch_of_cell: Index) -> Words:
    """Return the index of the patch that contains each cell of the uv square, or of the nearest patch in uv.

    patch_of_cell : (CELLS_PER_SIDE^2,) index of the patch that contains each cell, -1 if there is none
    """
    from scipy.ndimage import distance_transform_edt

    known = patch_of_cell.reshape(CELLS_PER_SIDE, CELLS_PER_SIDE)
    if not (known >= 0).any():
        return np.zeros(CELLS_PER_SIDE * CELLS_PER_SIDE, np.uint32)
    nearest = distance_transform_edt(known < 0, return_distances=False, return_indices=True)
    return np.asarray(known[tuple(nearest)].ravel(), np.uint32)


def _sparse_form_factors(
    row_index: Index, target_patch: Index, line_counts: Doubles, patch_count: int
) -> tuple[Words, Words, Floats]:
    """Return form factors as a sparse matrix: the start of each row, the patch indices and the factors.

    Row k contains the form factors from cell (or patch) k to the patches that it faces.

    row_index : (m,) index of the cell or patch from which each of m random lines starts
    target_patch : (m,) index of the patch that this line reaches
    line_counts : (r,) number of lines that start from each of the r cells or patches
    patch_count : number of patches
    """
    entry, lines = np.unique(row_index * max(patch_count, 1) + target_patch, return_counts=True)
    row_index, column = entry // max(patch_count, 1), entry % max(patch_count, 1)
    factor = lines / line_counts[row_index]
    large = factor >= _MIN_FORM_FACTOR
    total, total_large = (
        np.bincount(row_index[some], factor[some], len(line_counts)) for some in (slice(None), large)
    )
    factor = factor[large] * (total / np.maximum(total_large, 1e-12))[row_index[large]]
    first = np.concatenate([[0], np.cumsum(np.bincount(row_index[large], minlength=len(line_counts)))])
    return first.astype(np.uint32), column[large].astype(np.uint32), factor.astype(np.float32)


def _divide_into_patches(mesh: Mesh, corner_uv: Floats, mapped_triangles: Mask) -> tuple[Index, Words, Words]:
    """Divide the uv square into patches, and choose the sample points of each patch.

    Returns the patch index of each cell (CELLS_PER_SIDE^2,), which is -1 for cells without texels. Also
    returns the triangles and the packed weights of the sample points, as in `FormFactors`.

    corner_uv : (f, 3, 2) uv of the triangles' corners in the atlas
    mapped_triangles : (f,) mask of triangles that have texels
    """
    triangle, weights, rank = _sample_points(mesh, mapped_triangles)
    half, cell = CELLS_PER_SIDE // 2, _cell_index(corner_uv[triangle], weights)
    patch = (cell // CELLS_PER_SIDE // 2) * half + cell % CELLS_PER_SIDE // 2
    order = np.lexsort((rank, patch))
    occupied, first, size = np.unique(patch[order], return_index=True, return_counts=True)
    patch_index = np.full(half * half, -1, np.int64)
    patch_index[occupied] = np.arange(len(occupied))
    chosen = order[(first[:, None] + np.arange(SAMPLES_PER_PATCH) % np.maximum(size, 1)[:, None]).ravel()]
    packed = np.rint(65535 * weights[chosen]).astype(np.uint32)
    y, x = np.divmod(np.arange(CELLS_PER_SIDE * CELLS_PER_SIDE), CELLS_PER_SIDE)
    patch_of = patch_index[(y // 2) * half + x // 2]
    words = packed[:, 1] | (packed[:, 2] << np.uint32(16))
    return patch_of, triangle[chosen].astype(np.uint32), words.astype(np.uint32)


def _sample_points(mesh: Mesh, mapped_triangles: Mask) -> tuple[Index, Doubles, Doubles]:
    """Return random points on the triangles that have texels, with a random rank for each point.

    Returns the triangle indices (n,), the barycentric weights (n, 3) and the ranks (n,). Every triangle has
    at least one point, which makes the points too dense on small triangles. The ranks correct this: a subset
    that consists of the points of lowest rank is uniformly distributed over the surface.

    mapped_triangles : (f,) mask of triangles that have texels
    """
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    area = np.where(mapped_triangles, 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), 0.0)
    each = 1 + np.floor(
        CELLS_PER_SIDE * CELLS_PER_SIDE * SAMPLES_PER_PATCH * area / max(area.sum(), 1e-30)
    ).astype(np.int64)
    triangle = np.repeat(np.flatnonzero(mapped_triangles), each[mapped_triangles])
    rng, count = np.random.default_rng(_LINE_RANDOM_SEED), each[triangle]
    u, v = np.sqrt(rng.random(len(triangle))), rng.random(len(triangle))
    weights = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
    return triangle, weights, rng.exponential(size=len(triangle)) * count / np.maximum(area[triangle], 1e-30)
