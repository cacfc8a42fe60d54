"""Methods of treating the seams of the atlas: stitching, and the methods of a talk in 2007 [Dudash2007]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from dermis.atlas.build import MIN_ATLAS_SIDE
from dermis.scene.settings import Settings

FEATHER_WIDTH_MM = 3.0  # width over which an edited stretch map narrows the blur towards an edge


@dataclass(frozen=True)
class SeamMethod:
    """Method of treating seams: the layouts of the atlases, and how blurs treat the edges of charts.

    layouts : names of the layouts: "stitched", "mesh" (the uv layout of the mesh) or "unwrapped" (a layout
        with other seams)
    edge : what blurs read beyond the edge of a chart, one of `features.diffusion.blur.CHART_EDGE_MODES`
    feathered : whether the stretch map is changed near edges so that blurs become narrower there
    coloured : whether empty texels have the colour `Settings.seam_colour`; otherwise they are black
    """

    layouts: tuple[str, ...] = ("mesh",)
    edge: str = "cleared"
    feathered: bool = False
    coloured: bool = False


SEAM_METHODS = {
    "stitch": SeamMethod(("stitched",), "repeated"),
    "none": SeamMethod(),
    "clear-colour": SeamMethod(coloured=True),
    "stretch-map": SeamMethod(feathered=True),
    "alpha": SeamMethod(edge="skipped"),
    "multi-uv": SeamMethod(("mesh", "unwrapped"), edge="skipped"),
}


def seam_method(method_name: str, can_stitch: bool) -> SeamMethod:
    """Return the seam method with a given name.

    If the technique cannot stitch, "clear-colour" replaces "stitch".

    can_stitch : whether the technique can carry light across seams
    """
    return SEAM_METHODS["clear-colour" if method_name == "stitch" and not can_stitch else method_name]


class AtlasPlan(NamedTuple):
    """Atlases of a frame: the names of their uv layouts, and the side of each atlas [texels]."""

    layouts: tuple[str, ...]
    side: int


def plan_atlases(method: SeamMethod, settings: Settings, blur_count: int, has_occlusion: bool) -> AtlasPlan:
    """Return the names of the atlas layouts, and the side of the atlases.

    If no light is blurred over an atlas and no atlas stores occlusion, the result is one atlas of minimum
    size.

    method : method of treating seams; its field `layouts` has the names of the layouts
    blur_count : number of Gaussians that blur light over the atlas
    has_occlusion : whether the atlas stores occlusion of the environment
    """
    layouts = method.layouts
    if blur_count:
        return AtlasPlan(layouts, settings.atlas)
    return AtlasPlan(layouts[:1], settings.atlas) if has_occlusion else AtlasPlan(("mesh",), MIN_ATLAS_SIDE)
