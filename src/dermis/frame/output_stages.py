"""The outputs of a frame: which stages make those that are asked, and what these read of the frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from dermis.base.registry import Registry
from dermis.frame import light_stages
from dermis.frame.inputs import Inputs
from dermis.frame.passes import shape
from dermis.frame.passes.outputs import alpha, geometry, labels, landmarks, motion
from dermis.frame.passes.outputs.planes import Drawn, Planes
from dermis.frame.passes.visibility_buffer import Layers, draw_layers
from dermis.frame.projection import MIDDLE, Views
from dermis.gpu import Bindings, Graph

Stage = Callable[[Graph, Planes, Inputs, Drawn], None]
_OF_THE_SURFACE = ("DETAIL",)  # pipeline constants of surface.wgsl


def labels_of_hairs(graph: Graph, inputs: Inputs) -> Bindings | None:
    """What the pass that draws hairs is given to label them too; None where nobody asks."""
    made = inputs.resources.outputs
    if made is None or not _labels_hairs(inputs):
        return None
    return labels.of_hairs(made.labels, _draw_centres(graph, inputs))


def draw_outputs(graph: Graph, inputs: Inputs, below: Any) -> None:
    """Fill the planes of all outputs that are asked.

    below : what the shading read as `scattered`
    """
    made = inputs.resources.outputs
    if made is None:
        return
    centres = _centres(inputs).texture if _labels_hairs(inputs) else _draw_centres(graph, inputs)
    for planes in made.planes:
        STAGES[planes.stage](graph, planes, inputs, Drawn(centres, below))
    if made.landmarks:
        look, shape_now = _look(inputs), inputs.resources.shape
        landmarks.draw(graph, made.landmarks, inputs.lit, look, centres, shape_now)


def _labels_hairs(inputs: Inputs) -> bool:
    made = inputs.resources
    space = made.outputs.labels if made.outputs else None
    return made.strands is not None and space is not None and space.classes is not None


def _centres(inputs: Inputs) -> Layers:
    """Where the triangles at the pixels' centres are."""
    made = inputs.resources
    return (made.outputs and made.outputs.centres) or made.visibility


def _draw_centres(graph: Graph, inputs: Inputs) -> Any:
    """Find them, unless the picture's only sample lies there; a texture."""
    centres = _centres(inputs)
    if centres is not inputs.resources.visibility:
        draw_layers(graph, "outputs", centres, Views(inputs.camera.clips, MIDDLE), inputs.resources.head)
    return centres.texture


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
    made = inputs.resources.outputs
    assert made is not None
    labels.draw(graph, planes, inputs.lit, _look(inputs), drawn.centres, made.labels)


def _look(inputs: Inputs) -> tuple[Any, Any]:
    return inputs.view, inputs.centre_mm


STAGES: Registry[Stage] = Registry(
    "stage of outputs",
    {
        "geometry": _geometry,
        "surface": _surface,
        "motion": _motion,
        "alpha": _alpha,
        "light": light_stages.draw_light,
        "visibility": light_stages.draw_visibility,
        "pigments": light_stages.draw_pigments,
        "thickness": light_stages.draw_thickness,
        "label": _label,
    },
)
"""By the names of their shaders, passes/outputs/STAGE.wgsl."""
