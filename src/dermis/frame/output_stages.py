"""The outputs of a frame: which stages make those that are asked, and what these read of the frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dermis.frame import light_stages
from dermis.frame.inputs import Inputs
from dermis.frame.passes import shape
from dermis.frame.passes.outputs import alpha, geometry, labels, landmarks, motion
from dermis.frame.passes.outputs.planes import Drawn, Planes
from dermis.frame.passes.visibility_buffer import draw_layers
from dermis.frame.projection import MIDDLE, Views
from dermis.gpu import Graph

Stage = Callable[[Graph, Planes, Inputs, Drawn], None]
_OF_THE_SURFACE = ("DETAIL",)  # pipeline constants of surface.wgsl


def draw_outputs(graph: Graph, inputs: Inputs, below: Any) -> None:
    """Fill the planes of all outputs that are asked.

    below : what the shading read as `scattered`
    """
    made = inputs.resources.outputs
    if made is None:
        return
    centres = inputs.resources.visibility
    if made.centres is not None:
        centres, views = made.centres, Views(inputs.camera.clips, MIDDLE)
        draw_layers(graph, "outputs", centres, views, inputs.resources.head)
    for planes in made.planes:
        STAGES[planes.stage](graph, planes, inputs, Drawn(centres.texture, below))
    if made.landmarks:
        look, shape_now = _look(inputs), inputs.resources.shape
        landmarks.draw(graph, made.landmarks, inputs.lit, look, centres.texture, shape_now)


def _geometry(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    geometry.draw(graph, planes, inputs.lit, _look(inputs), drawn.centres)


def _surface(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    constants = tuple(one for one in inputs.constants if one[0] in _OF_THE_SURFACE)
    geometry.draw(graph, planes, inputs.lit, _look(inputs), drawn.centres, constants)


def _motion(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    made, before = inputs.resources, inputs.before
    assert made.outputs is not None and before is not None
    vertices = made.shape.vertices
    if before.motion is not None:
        assert made.outputs.before is not None
        shape.draw(graph, made.outputs.before, before.motion)
        vertices = made.outputs.before.vertices
    motion.draw(graph, planes, inputs.lit, _look(inputs), drawn.centres, (before.view, vertices))


def _alpha(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    alpha.draw(graph, planes, inputs.resources.picture)


def _label(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    made = inputs.resources
    assert made.outputs is not None
    space = made.outputs.labels
    if made.strands and space.classes is not None:
        labels.draw_hairs(graph, space, made.strands, inputs.view, made.head, drawn.centres)
    labels.draw(graph, planes, inputs.lit, _look(inputs), drawn.centres, space)


def _look(inputs: Inputs) -> tuple[Any, Any]:
    return inputs.view, inputs.centre_mm


STAGES: Mapping[str, Stage] = {
    "geometry": _geometry,
    "surface": _surface,
    "motion": _motion,
    "alpha": _alpha,
    "light": light_stages.draw_light,
    "visibility": light_stages.draw_visibility,
    "pigments": light_stages.draw_pigments,
    "thickness": light_stages.draw_thickness,
    "label": _label,
}
"""By the names of their shaders, passes/outputs/STAGE.wgsl."""
