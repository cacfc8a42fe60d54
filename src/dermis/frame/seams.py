"""What is done where the map is cut: the stitched atlas, and the remedies of the 2007 talk [Dudash2007]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from dermis.atlas.atlas import SMALLEST
from dermis.scene.settings import Settings

FEATHER_MM = 3.0  # width over which an edited stretch map narrows the blur towards an edge


@dataclass(frozen=True)
class Remedy:
    """How an atlas is laid out and what its blurs find beyond a chart's edge.

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
_BASELINES = ("one-blur", "gpu-gems-3")  # never knew what lies across a seam


def remedy_of(settings: Settings) -> Remedy:
    """What is done at the seams; the baselines take their own remedy where ours is asked for."""
    if settings.technique in _BASELINES and settings.seams == "stitch":
        return REMEDIES["clear-colour"]
    return REMEDIES[settings.seams]


class LaidOut(NamedTuple):
    """Atlases of a frame: the names of their layouts, and texels along the side of each."""

    layouts: tuple[str, ...]
    side: int


def laid_out(settings: Settings, levels: int, occluded: bool) -> LaidOut:
    """The atlases that a frame needs: the least where no light spreads over them and nothing else lies there.

    levels : Gaussians that light is blurred by over the atlas
    occluded : whether an environment's occlusion lies on it
    """
    layouts = remedy_of(settings).layouts
    if levels:
        return LaidOut(layouts, settings.atlas)
    return LaidOut(layouts[:1], settings.atlas) if occluded else LaidOut(("mesh",), SMALLEST)


def stretch_of(settings: Settings) -> str:
    """How blurs follow the map's stretch: a single blur does not."""
    return "none" if settings.technique == "one-blur" else settings.stretch
