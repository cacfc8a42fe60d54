"""One frame, read from top to bottom."""

from __future__ import annotations

from dermis.frame.inputs import Inputs
from dermis.frame.output_stages import draw_outputs, labels_of_hairs
from dermis.frame.passes import (
    background,
    bloom,
    interreflection,
    meter,
    moving_occlusion,
    post,
    shade,
    shadows,
    shape,
    strands,
    visibility_buffer,
)
from dermis.frame.passes.painting import expression
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Graph


def draw_frame(graph: Graph, inputs: Inputs, technique: Technique) -> None:
    """Light the skin, scatter the light below it, shade the image; only stale passes run."""
    made = inputs.resources
    shape.draw(graph, made.shape, inputs.motion)
    if made.person:
        shape.draw(graph, made.person, inputs.motion.at_rest)
    if made.face and inputs.movements is not None:
        expression.draw(graph, made.face, inputs.movements)
    bounded = ("SHAPES", 1) in inputs.light_constants
    shadows.draw(graph, made.shadow_maps, inputs.shadow_views, made.head, bounded)
    if made.strands:
        graph.repeat(strands.pose, made.strands.tables, made.shape)
        if len(inputs.shadow_views.clips):
            strands.shadow(graph, made.strands, inputs.lit)
    if made.sky and inputs.around:
        moving_occlusion.draw(graph, made.sky, *inputs.around, inputs.layouts)
    for layout in inputs.layouts:
        if layout.interreflection:
            interreflection.draw(graph, layout.lit, layout.interreflection, inputs.light_constants)
    below = technique.scatter(graph, inputs)
    visibility_buffer.draw(graph, made.visibility, inputs.camera, made.head)
    look, apart = (inputs.lit, inputs.view, inputs.constants), technique.apart(made.own)
    radiance = shade.draw(graph, *look, made.visibility, below, made.picture, apart)
    radiance = technique.finish(graph, inputs, radiance)
    seen = inputs.lit, inputs.view, inputs.light_constants
    if made.strands:
        over, labels = (made.visibility.texture, radiance), labels_of_hairs(graph, inputs)
        radiance = strands.draw(graph, made.strands, seen, made.head, *over, labels)
    if made.meter:
        meter.draw(graph, made.meter, seen, made.visibility.texture, radiance)
    if made.backdrop:
        radiance = background.draw(graph, made.backdrop, seen[:2], radiance, made.meter, inputs.settings)
    if made.glow:
        radiance = bloom.draw(graph, made.glow, radiance, inputs.settings.bloom)
    post.draw(graph, radiance, made.picture, inputs.settings, made.meter)
    draw_outputs(graph, inputs, below)
