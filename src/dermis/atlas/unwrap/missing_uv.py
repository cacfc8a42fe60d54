"""New uv layouts for triangles that have no uv in the mesh's file."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np

from dermis.atlas.unwrap.unwrap import unwrap_mesh
from dermis.base.arrays import Index, Mask
from dermis.base.disk import Arrays, load_or_make
from dermis.base.progress import logged_step
from dermis.mesh.geometry import compact_vertices
from dermis.mesh.mesh import Mesh

_LAYOUT_CACHE_VERSION = 1  # increment when `unwrap_mesh` returns other layouts


def unwrap_triangles(mesh: Mesh, triangle_mask: Mask) -> tuple[Mesh, Index]:
    """Unwrap some triangles; return the new mesh, and for each new vertex the index of the old vertex.

    The order of the triangles is unchanged; vertices on the new seams are duplicated. The layout is cached on
    disk.

    triangle_mask : (f,) mask of the triangles that need a layout
    """
    used_vertices, corners = compact_vertices(mesh.triangles[triangle_mask])
    point = np.unique(mesh.point[used_vertices], return_inverse=True)[1]
    part = Mesh(
        mesh.positions[used_vertices],
        mesh.normals[used_vertices],
        np.zeros((len(used_vertices), 2), np.float32),
        point.reshape(-1).astype(np.int32),
        corners.astype(np.int32),
        mesh.material[triangle_mask],
        mesh.materials,
    )
    arrays = _cached_layout(part)
    # Corners keep their order, so that each new vertex comes from the vertex at the same corner.
    source = np.empty(len(arrays["uv"]), np.int64)
    source[arrays["triangles"].ravel()] = mesh.triangles[triangle_mask].ravel()
    remaining = mesh.triangles[~triangle_mask]
    kept, others = compact_vertices(remaining) if len(remaining) else (used_vertices[:0], corners[:0])
    triangles = np.empty_like(mesh.triangles)
    triangles[~triangle_mask] = others
    triangles[triangle_mask] = arrays["triangles"] + len(kept)
    vertex = np.concatenate([kept, source])
    laid_out = replace(
        mesh,
        positions=mesh.positions[vertex],
        normals=mesh.normals[vertex],
        uv=np.concatenate([mesh.uv[kept], arrays["uv"]]),
        point=mesh.point[vertex],
        triangles=triangles,
    )
    vars(laid_out)["outline"] = mesh.outline
    return laid_out, vertex


def _cached_layout(unwrapped_mesh: Mesh) -> Arrays:
    """Unwrap a mesh; return uv (v, 2) and triangles (f, 3), from the cache on disk if possible."""
    digest = hashlib.sha256(f"{_LAYOUT_CACHE_VERSION}".encode())
    for array in (unwrapped_mesh.positions, unwrapped_mesh.point, unwrapped_mesh.triangles):
        digest.update(np.ascontiguousarray(array).tobytes())

    @logged_step("unwrapping the mesh")
    def make_layout_arrays() -> Arrays:
        laid_out = unwrap_mesh(unwrapped_mesh)
        used_vertices, triangles = compact_vertices(laid_out.triangles)
        return {"uv": laid_out.uv[used_vertices], "triangles": triangles.astype(np.int32)}

    return load_or_make("layouts", digest.hexdigest()[:40], ["uv", "triangles"], make_layout_arrays)
