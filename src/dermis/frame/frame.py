"""One frame, read from top to bottom."""

from __future__ import annotations

from functools import partial

from dermis.frame.features import (
    hair,
    interreflection,
    occlusion,
    outputs,
    post,
    shading,
    shadows,
    shape,
    visibility,
)
from dermis.frame.features.outputs.stage_inputs import SeenFrame, SpreadLight
from dermis.frame.features.surface.painting.paint import draw_expression
from dermis.frame.inputs import Inputs
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Graph, Texture


def draw_frame(graph: Graph, inputs: Inputs, technique: Technique) -> None:
    """Light the skin, scatter the light below it, shade the image; only stale passes run."""
    made, lit, view = inputs.resources, inputs.lit, inputs.view
    shape.draw(graph, made.shape.shape, inputs.motion)
    if made.shape.person:
        shape.draw(graph, made.shape.person, inputs.motion.at_rest)
    if made.face and inputs.movements is not None:
        draw_expression(graph, made.face, inputs.movements)
    area_lights = ("SHAPES", 1) in inputs.light_constants
    shadows.draw(graph, made.shadow_maps, inputs.shadow_views, made.head, area_lights)
    if made.hair:
        hair.draw_shadows(graph, made.hair, made.shape.shape, inputs.shadow_views, lit)
    if made.sky and inputs.around:
        maps = [(layout, layout.occlusion) for layout in inputs.layouts]
        occlusion.draw(graph, made.sky, *inputs.around, maps)
    for layout in inputs.layouts:
        if layout.interreflection:
            interreflection.draw(graph, layout.lit, layout.interreflection, inputs.light_constants)
    below = technique.scatter(graph, inputs)
    visibility.draw(graph, made.visibility, inputs.camera, made.head)
    image, apart = made.post.picture.radiance, technique.apart(made.technique)
    radiance = shading.draw(
        graph, lit, view, inputs.constants, made.visibility, below, image, inputs.settings.size, apart
    )
    radiance = technique.finish(graph, inputs, radiance)
    seen = _seen(graph, inputs, technique, below)
    look = lit, view, inputs.light_constants
    if made.hair:
        over, labels = (made.visibility.texture, radiance), outputs.hair_labels(graph, made.outputs, seen)
        radiance = hair.draw(graph, made.hair, look, made.head, *over, labels)
    post.draw(graph, made.post, inputs.settings, radiance, *look, made.visibility.texture)
    outputs.draw(graph, made.outputs, seen)


def _seen(graph: Graph, inputs: Inputs, technique: Technique, below: Texture) -> SeenFrame:
    """Return what the outputs read of the frame."""
    made, spread = inputs.resources, None
    layers = technique.apart(made.spread)
    if layers is not None:
        spread = SpreadLight(layers, partial(technique.spread, graph, inputs))
    return SeenFrame(
        lit=inputs.lit,
        view=inputs.view,
        centre_mm=inputs.centre_mm,
        constants=inputs.constants,
        scattered=below,
        camera=inputs.camera,
        head=made.head,
        visibility=made.visibility,
        shape=made.shape.shape,
        picture=made.post.picture,
        hair=made.hair is not None,
        previous=inputs.previous,
        thin=inputs.layouts[0].translucency,
        spread=spread,
        through=partial(technique.leave_through, graph, inputs),
    )
