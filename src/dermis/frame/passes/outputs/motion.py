"""Motion vectors: how far what a pixel sees has come since the scene before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.passes.meter import rays_of
from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.geometry import look_of
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.passes.shape import MotionBytes
from dermis.frame.projection import Triple
from dermis.gpu import Bindings, Recorder


@dataclass(frozen=True, eq=False)
class Before:
    """The scene before.

    motion : what moved the head's shape, None where it is where it was
    view : record of the shading, with the rays of its camera
    """

    motion: MotionBytes | None
    view: Any


def draw(
    graph: Recorder,
    planes: Planes,
    lit: Bindings,
    look: tuple[Any, Triple],
    centres: Any,
    before: tuple[Any, Bindings],
) -> None:
    """Fill the planes.

    lit, look, centres : as of `geometry.draw`
    before : record of the shading in the scene before, and its vertices
    """
    view, vertices = before
    shader = outputs.stage_program(graph.device, planes)
    bound = {
        **lit,
        "look": look_of(shader, *look),
        "centres": centres,
        "before": shader.record("Before", rays=rays_of(shader, view)),
        "before_table": vertices["vertex_table"],
        "before_buffer": vertices["vertex_buffer"],
    }
    outputs.draw(graph, planes, shader, bound)
