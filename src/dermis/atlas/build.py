"""Builds the atlas of a mesh in one of its layouts."""

from __future__ import annotations

from dermis.atlas.atlas import REACH_MM, Atlas
from dermis.atlas.raster import build_own_layout
from dermis.base.errors import refuse
from dermis.mesh.mesh import Mesh

LAYOUTS = ("mesh", "stitched", "unwrapped")
SMALLEST = 64


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
        from dermis.atlas.unwrap.elsewhere import with_other_seams

        return build_own_layout(with_other_seams(mesh), size)
    return build_own_layout(mesh, size)
