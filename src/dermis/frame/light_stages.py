"""The outputs of light and of what is below the skin: their stages, and what these read of the frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dermis.frame.inputs import Inputs
from dermis.frame.passes import blend
from dermis.frame.passes.outputs import light, pigments, thickness
from dermis.frame.passes.outputs.light import Shading
from dermis.frame.passes.outputs.planes import Drawn, Planes
from dermis.gpu import Graph
from dermis.scene.techniques import TECHNIQUES


def draw_light(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    """Shade the pixels' centres, and let what spreads over the picture spread."""
    made, shading = inputs.resources.outputs, _shading(inputs, drawn.below)
    assert made is not None
    technique, apart = TECHNIQUES[inputs.settings.technique], made.light.apart
    light.draw(graph, planes, shading, drawn.centres, apart and apart.layers)
    if apart is not None and "diffuse" in planes.channels:
        light.add_spread(graph, planes, *technique.spread(graph, inputs, apart))
    if "translucent" in planes.channels:
        through = _draw_through(graph, inputs, made.light.through)
        light.take_through(graph, planes, shading, drawn.centres, through)


def draw_visibility(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    """Find which share of each light arrives."""
    made = inputs.resources.outputs
    assert made is not None
    light.draw_visibility(graph, planes, _shading(inputs, drawn.below), drawn.centres, made.light.parts)


def draw_pigments(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    """Read the skin's pigments."""
    made = inputs.resources.outputs
    assert made is not None and made.light.pigmented is not None
    look = inputs.view, inputs.centre_mm
    pigments.draw(graph, planes, inputs.lit, look, drawn.centres, made.light.pigmented)


def draw_thickness(graph: Graph, planes: Planes, inputs: Inputs, drawn: Drawn) -> None:
    """Measure the flesh below the skin."""
    made, thin = inputs.resources.outputs, inputs.layouts[0].translucency
    assert made is not None and thin is not None
    thickness.measure(graph, thin, made.light.thickness)
    look = inputs.view, inputs.centre_mm
    thickness.draw(graph, planes, inputs.lit, look, drawn.centres, made.light.thickness)


def _shading(inputs: Inputs, below: Any) -> Shading:
    return Shading(inputs.lit, inputs.view, inputs.centre_mm, inputs.constants, below)


def _draw_through(graph: Graph, inputs: Inputs, into: tuple[Any, ...]) -> Any:
    """The light through thin parts, added up as the blurred light is; a texture of the atlas."""
    technique, made, layouts = TECHNIQUES[inputs.settings.technique], inputs.resources, inputs.layouts
    for layout, blur, texture in zip(layouts, inputs.blurs, into, strict=False):
        technique.leave_through(graph, made.levels, blur, layout.translucency, texture)
    if len(layouts) > 1:
        first, second = (replace(one, scattered=into[k]) for k, one in enumerate(layouts))
        blend.draw(graph, first, second, into[-1])
    return into[-1]
