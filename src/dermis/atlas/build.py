"""Atlases of a mesh in one of its layouts, built or read from the cache."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from dermis.atlas.atlas import GUTTER, REACH_MM, Atlas
from dermis.atlas.raster import build_own_layout
from dermis.base.disk import Array, Arrays, stored
from dermis.base.errors import refuse
from dermis.base.progress import preparing
from dermis.mesh.mesh import Mesh

LAYOUTS = ("mesh", "stitched", "unwrapped")
SMALLEST = 64
_FORM = 6  # increment when `build_atlas` gives other results for the same mesh


def build_atlas(mesh: Mesh, size: int, layout: str = "mesh", reach_mm: float = REACH_MM) -> Atlas:
    """The atlas of `size` x `size` texels.

    layout : "mesh" is the mesh's own uv; "stitched" has its charts moved apart, with gutters that continue
        the surface beyond their edges, or the mesh's own uv where there are too many charts for that;
        "unwrapped" has charts whose seams are elsewhere
    reach_mm : width of the gutters [mm]

    Raises DermisError when the size is under 64.
    """
    if size < SMALLEST:
        expected = f"a size of {SMALLEST} texels or more"
        refuse("atlas", expected, f"it is {size}", "Choose --atlas 1024 or 2048")
    if layout not in LAYOUTS:
        refuse("layout", f"one of {', '.join(LAYOUTS)}", f"{layout} came", "Choose one of these")
    if layout == "stitched":
        from dermis.atlas.stitched.build import build_stitched

        return build_stitched(mesh, size, reach_mm) or build_own_layout(mesh, size)
    if layout == "unwrapped":
        from dermis.atlas.unwrap.unwrap import with_other_seams

        return build_own_layout(with_other_seams(mesh), size)
    return build_own_layout(mesh, size)


def cached_atlas(mesh: Mesh, size: int, layout: str = "mesh", reach_mm: float = REACH_MM) -> Atlas:
    """`build_atlas`, read back from disk when it was made before; the disk may fail without harm."""
    names = [field.name for field in fields(Atlas)]

    @preparing("laying the skin out on the atlas")
    def make() -> Arrays:
        atlas = build_atlas(mesh, size, layout, reach_mm)
        return {name: getattr(atlas, name) for name in names}

    return Atlas(**stored("atlas", _key(mesh, size, layout, reach_mm), names, make))


def cached_occlusion(mesh: Mesh, atlas: Atlas, form: str, bake: Callable[[], Array]) -> Array:
    """What `bake` returns for a mesh and its atlas, kept on disk in the same way.

    form : everything else that the result depends on
    """
    return _baked("occlusion", mesh, atlas, form, bake)


def _baked(folder: str, mesh: Mesh, atlas: Atlas, form: str, bake: Callable[[], Array]) -> Array:
    return stored(folder, _baked_key(mesh, atlas, form), ["open"], lambda: {"open": bake()})["open"]


def _baked_key(mesh: Mesh, atlas: Atlas, form: str) -> str:
    digest = hashlib.sha256(f"{_key(mesh, atlas.size)} {form}".encode())
    for array in (mesh.positions, mesh.normals, atlas.place, np.packbits(atlas.own)):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:40]


def _key(mesh: Mesh, size: int, layout: str = "mesh", reach_mm: float = REACH_MM) -> str:
    digest = hashlib.sha256(f"{_FORM} {GUTTER} {size} {layout} {reach_mm}".encode())
    digest.update(repr([material.kind for material in mesh.materials]).encode())
    for array in (mesh.material, mesh.positions, mesh.uv, mesh.triangles, mesh.dpdu, mesh.dpdv, mesh.point):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:40]
