"""What head and hair cover of each pixel."""

from __future__ import annotations

from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.passes.post import Picture
from dermis.gpu import Recorder


def draw(graph: Recorder, planes: Planes, picture: Picture) -> None:
    """Fill the planes from the finished picture."""
    shader = outputs.stage_program(graph.device, planes)
    outputs.draw(graph, planes, shader, {"exposed": picture.exposed})
