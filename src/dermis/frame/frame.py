"""Passes of one frame in order, from the posed shape to the picture and its outputs."""

from __future__ import annotations

from dataclasses import replace
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
from dermis.frame.features.hair.swing import SwingStep
from dermis.frame.features.outputs.stage_inputs import PictureDiffusion, StageInputs
from dermis.frame.features.surface.painting.paint import draw_expression
from dermis.frame.inputs import FrameInputs
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Graph, Texture


def draw_frame(graph: Graph, inputs: FrameInputs, technique: Technique) -> None:
    """Declare all passes of a frame: pose, shadows, light in the skin, shading, post-processing and outputs.

    The graph runs only the passes whose inputs have changed.
    """
    resources, bindings, view = inputs.resources, inputs.bindings, inputs.view
    shape.draw(graph, resources.shape.shape, inputs.pose_bytes)
    if resources.shape.rest_shape:
        shape.draw(graph, resources.shape.rest_shape, inputs.pose_bytes.at_rest)
    if resources.expression_maps and inputs.face_movements is not None:
        draw_expression(graph, resources.expression_maps, inputs.face_movements, inputs.skin_state)
    area_lights = ("SHAPES", 1) in inputs.light_constants
    shadows.draw(graph, resources.shadow_maps, inputs.shadow_views, resources.head, area_lights)
    hair_geometry, strands = (resources.shape.shape, resources.head), None
    if resources.hair:
        has_sky = ("ENVIRONMENT", 1) in inputs.light_constants
        strands = hair.draw_guides(graph, resources.hair, hair_geometry, inputs.swing)
        hair.draw_shadows(graph, strands, hair_geometry, inputs.shadow_views, bindings, has_sky)
    if resources.sky and inputs.sky_view:
        maps = [(layout, layout.occlusion) for layout in inputs.layouts]
        occlusion.draw(graph, resources.sky, *inputs.sky_view, maps)
    for layout in inputs.layouts:
        if layout.interreflection:
            interreflection.draw(graph, layout.bindings, layout.interreflection, inputs.light_constants)
    scattered = technique.scatter(graph, inputs)
    visibility.draw(graph, resources.visibility, inputs.camera_views, resources.head)
    image, layers = resources.post.picture.radiance, technique.subsurface_layers(resources.technique)
    targets = image, inputs.settings.size, layers
    shaded = bindings, view, inputs.constants, resources.visibility, scattered
    radiance = shading.draw(graph, *shaded, *targets)
    radiance = technique.add_subsurface_light(graph, inputs, radiance)
    stage_inputs = _stage_inputs(graph, inputs, technique, scattered)
    shared, triangles = (bindings, view, inputs.light_constants), resources.visibility.texture
    if strands:
        labels = outputs.hair_label_bindings(graph, resources.outputs, stage_inputs)
        radiance = hair.draw(graph, strands, hair_geometry, shared, triangles, radiance, labels)
    post.draw(graph, resources.post, inputs.settings, radiance, *shared, triangles)
    outputs.draw(graph, resources.outputs, stage_inputs)


def draw_swing_step(graph: Graph, inputs: FrameInputs, step: SwingStep) -> None:
    """Declare the passes of a step of the simulation of hair, for a frame that is not rendered."""
    resources = inputs.resources
    assert inputs.swing is not None and resources.hair is not None
    geometry = resources.shape.shape, resources.head
    shape.draw(graph, geometry[0], step.pose_bytes)
    hair.draw_guides(graph, resources.hair, geometry, replace(inputs.swing, steps=(step,)))


def _stage_inputs(
    graph: Graph, inputs: FrameInputs, technique: Technique, scattered_light: Texture
) -> StageInputs:
    """Collect the inputs of the shader stages that compute outputs."""
    resources, diffused = inputs.resources, None
    layers = technique.subsurface_layers(resources.output_layers)
    if layers is not None:
        diffused = PictureDiffusion(layers, partial(technique.blur_subsurface_layers, graph, inputs))
    return StageInputs(
        lighting=inputs.bindings,
        view=inputs.view,
        centre_mm=inputs.centre_mm,
        constants=inputs.constants,
        scattered=scattered_light,
        camera=inputs.camera_views,
        head=resources.head,
        visibility=resources.visibility,
        centres=(resources.outputs and resources.outputs.centres) or resources.visibility,
        shape=resources.shape.shape,
        picture=resources.post.picture,
        has_hair=resources.hair is not None,
        previous=inputs.previous,
        translucency=inputs.layouts[0].translucency,
        picture_diffusion=diffused,
        sum_transmitted=partial(technique.sum_translucency, graph, inputs),
    )
