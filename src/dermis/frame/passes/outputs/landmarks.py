"""Where landmarks are, and whether they are seen."""

from __future__ import annotations

from typing import Any

from dermis.frame.landmark_space import LandmarkSpace
from dermis.frame.passes import each, program
from dermis.frame.passes.outputs.geometry import look_of
from dermis.frame.projection import Triple
from dermis.frame.shape import Shape
from dermis.gpu import Bindings, Recorder

TOLERANCE_MM = 2.0
"""By which the mesh at the pixels around a landmark may lie before it where it still counts as seen."""


def draw(
    graph: Recorder,
    space: LandmarkSpace,
    lit: Bindings,
    look: tuple[Any, Triple],
    centres: Any,
    shape: Shape,
) -> None:
    """Find the landmarks.

    lit, look, centres : as of `geometry.draw`
    """
    shader = program(graph.device, "outputs/landmarks.wgsl", (("TOLERANCE_MM", TOLERANCE_MM),))
    bound = {**lit, "look": look_of(shader, *look), "centres": centres, "landmarks": space.table}
    bound |= {"points": shape.surface["points"], "found": space.buffer}
    graph.dispatch("outputs", shader, bound, each(space.count))
