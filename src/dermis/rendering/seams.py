"""What is done where the map is cut: the stitched atlas, and the remedies of the 2007 talk [Dudash2007]."""

from __future__ import annotations

from dataclasses import dataclass

FEATHER_MM = 3.0  # width over which an edited stretch map narrows the blur towards an edge


@dataclass(frozen=True)
class Remedy:
    """How an atlas is laid out and what its blurs find beyond a chart's edge.

    layouts : of the atlas: "stitched", "mesh" for the mesh's own uv, "unwrapped" for one with other seams
    edge : one of `diffuse.EDGES`
    feathered : whether the stretch map is edited so that blurs narrow towards the edges
    """

    layouts: tuple[str, ...] = ("mesh",)
    edge: str = "cleared"
    feathered: bool = False


REMEDIES = {
    "stitch": Remedy(("stitched",), "repeated"),
    "none": Remedy(),
    "clear-colour": Remedy(),
    "stretch-map": Remedy(feathered=True),
    "alpha": Remedy(edge="skipped"),
    "multi-uv": Remedy(("mesh", "unwrapped"), edge="skipped"),
}
