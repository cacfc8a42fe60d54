"""Remedies for seams: the stitched atlas, and those of the 2007 talk [Dudash2007]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from dermis.atlas.build import SMALLEST
from dermis.scene.settings import Settings

FEATHER_MM = 3.0  # width over which an edited stretch map narrows the blur towards an edge


@dataclass(frozen=True)
class Remedy:
    """How an atlas is laid out, and what blurs read beyond a chart's edge.

    layouts : of the atlas: "stitched", "mesh" for the mesh's own uv, "unwrapped" for one with other seams
    edge : one of `diffuse.EDGES`
    feathered : whether the stretch map is edited so that blurs narrow towards the edges
    coloured : whether empty texels show `Settings.seam_colour` rather than black
    """

    layouts: tuple[str, ...] = ("mesh",)
    edge: str = "cleared"
    feathered: bool = False
    coloured: bool = False


REMEDIES = {
    "stitch": Remedy(("stitched",), "repeated"),
    "none": Remedy(),
    "clear-colour": Remedy(coloured=True),
    "stretch-map": Remedy(feathered=True),
    "alpha": Remedy(edge="skipped"),
    "multi-uv": Remedy(("mesh", "unwrapped"), edge="skipped"),
}


def remedy_of(seams: str, stitches: bool) -> Remedy:
    """The remedy by its name.

    stitches : whether the technique can stitch; others clear the colour instead
    """
    return REMEDIES["clear-colour" if seams == "stitch" and not stitches else seams]


class LaidOut(NamedTuple):
    """Atlases of a frame: the names of their layouts, and texels along the side of each."""

    layouts: tuple[str, ...]
    side: int


def laid_out(remedy: Remedy, settings: Settings, levels: int, occluded: bool) -> LaidOut:
    """The atlases that a frame needs: of the least size where neither light nor occlusion lies on them.

    levels : number of Gaussians that blur light over the atlas
    occluded : whether an environment's occlusion lies on it
    """
    layouts = remedy.layouts
    if levels:
        return LaidOut(layouts, settings.atlas)
    return LaidOut(layouts[:1], settings.atlas) if occluded else LaidOut(("mesh",), SMALLEST)
