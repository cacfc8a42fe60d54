"""The curvature of the surface, smoothed over the distance that light travels in skin."""

from __future__ import annotations

from dermis.frame.curvature import Curvature
from dermis.frame.geometry import HeadResources
from dermis.frame.passes import each, program
from dermis.gpu import Recorder

_STAGE = "curvature"


def draw(graph: Recorder, head: HeadResources, curvature: Curvature) -> None:
    """Find the curvature of the head as it is posed."""
    device, groups = graph.device, each(curvature.vertices)
    # each step reads what the one before wrote; the last leaves its result where the shading reads it
    spaces = [curvature.smoothed, curvature.between]
    if curvature.steps % 2:
        spaces.reverse()
    bound = head.resources | curvature.tables | {"curvatures": spaces[0]}
    graph.dispatch(_STAGE, program(device, "curvature.wgsl"), bound, groups)
    smooth = program(device, "curvature_smooth.wgsl")
    for step in range(curvature.steps):
        before, after = spaces[step % 2], spaces[1 - step % 2]
        bound = curvature.tables | {"before": before, "curvatures": after}
        graph.dispatch(_STAGE, smooth, bound, groups)
