"""Construction of atlases in one of three uv layouts, with a cache on disk."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from dermis.atlas.atlas import GUTTER_MM, GUTTER_TEXELS, Atlas
from dermis.atlas.raster import build_mesh_layout
from dermis.base.disk import Array, Arrays, load_or_make
from dermis.base.errors import refuse
from dermis.base.progress import logged_step
from dermis.mesh.mesh import Mesh

ATLAS_LAYOUTS = ("mesh", "stitched", "unwrapped")
MIN_ATLAS_SIDE = 64
_ATLAS_CACHE_VERSION = 7  # increment when the result of `build_atlas` for a mesh changes


def build_atlas(mesh: Mesh, atlas_side: int, layout: str = "mesh", gutter_mm: float = GUTTER_MM) -> Atlas:
    """Build the atlas of a mesh in one of three uv layouts.

    atlas_side : texels along each side of the map
    layout : "mesh" keeps the mesh's own uv; "stitched" moves the mesh's charts apart and adds gutters that
        continue the surface across the seams, unless the mesh has too many charts; "unwrapped" replaces the
        mesh's uv by new charts
    gutter_mm : width of the gutters of a stitched layout [mm]

    Raises DermisError if `atlas_side` is less than 64 or the layout is unknown.
    """
    if atlas_side < MIN_ATLAS_SIDE:
        expected = f"a size of {MIN_ATLAS_SIDE} texels or more"
        refuse("atlas", expected, f"it is {atlas_side}", "Choose --atlas 1024 or 2048")
    if layout not in ATLAS_LAYOUTS:
        refuse("layout", f"one of {', '.join(ATLAS_LAYOUTS)}", f"got {layout}", "Choose one of these")
    if layout == "stitched":
        from dermis.atlas.stitched.build import build_stitched

        return build_stitched(mesh, atlas_side, gutter_mm) or build_mesh_layout(mesh, atlas_side)
    if layout == "unwrapped":
        from dermis.atlas.unwrap.unwrap import unwrap_mesh

        return build_mesh_layout(unwrap_mesh(mesh), atlas_side)
    return build_mesh_layout(mesh, atlas_side)


def cached_atlas(mesh: Mesh, atlas_side: int, layout: str = "mesh", gutter_mm: float = GUTTER_MM) -> Atlas:
    """Return the result of `build_atlas`, which is cached on disk if a cache folder is writable.

    Clothing and glasses have no texels, so a dressed person has the atlas of the mesh without them.
    """
    if mesh.body is not mesh:
        return cached_atlas(mesh.body, atlas_side, layout, gutter_mm).with_triangles(len(mesh.triangles))
    names = [field.name for field in fields(Atlas)]

    @logged_step("mapping the skin to the atlas")
    def make_atlas_arrays() -> Arrays:
        atlas = build_atlas(mesh, atlas_side, layout, gutter_mm)
        return {name: getattr(atlas, name) for name in names}

    return Atlas(
        **load_or_make("atlas", _atlas_key(mesh, atlas_side, layout, gutter_mm), names, make_atlas_arrays)
    )


def cached_occlusion(mesh: Mesh, atlas: Atlas, inputs_key: str, bake_occlusion: Callable[[], Array]) -> Array:
    """Return the result of `bake_occlusion`, which is cached on disk if a cache folder is writable.

    bake_occlusion : function that computes the occlusion map of the atlas
    inputs_key : text that identifies all inputs of `bake_occlusion` except the mesh and the atlas
    """
    digest = hashlib.sha256(f"{_atlas_key(mesh, atlas.size)} {inputs_key}".encode())
    for array in (mesh.positions, mesh.normals, atlas.corner_uv, np.packbits(atlas.lit_mask)):
        digest.update(np.ascontiguousarray(array).tobytes())
    return load_or_make("occlusion", digest.hexdigest()[:40], ["open"], lambda: {"open": bake_occlusion()})[
        "open"
    ]


def _atlas_key(mesh: Mesh, atlas_side: int, layout: str = "mesh", gutter_mm: float = GUTTER_MM) -> str:
    digest = hashlib.sha256(
        f"{_ATLAS_CACHE_VERSION} {GUTTER_TEXELS} {atlas_side} {layout} {gutter_mm}".encode()
    )
    digest.update(repr([material.kind for material in mesh.materials]).encode())
    for array in (mesh.material, mesh.positions, mesh.uv, mesh.triangles, mesh.dpdu, mesh.dpdv, mesh.point):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:40]
