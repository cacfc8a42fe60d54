"""Stages that compute outputs: each declares the passes of a shader, and has the name of this shader."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from dermis.base.registry import Registry
from dermis.frame.features.outputs import light
from dermis.frame.features.outputs.labels import draw_labels
from dermis.frame.features.outputs.landmarks import draw_landmarks
from dermis.frame.features.outputs.output_images import OutputImages, draw_output_images, stage_program
from dermis.frame.features.outputs.resources import Resources
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.features.shading.view import ray_record
from dermis.frame.features.shape import shape
from dermis.frame.features.visibility.layers import draw_layers
from dermis.frame.projection import PIXEL_CENTRE, Views
from dermis.gpu import Bindings, Graph
from dermis.gpu.wgsl_source import ShaderListMember
from dermis.scene.outputs import OUTPUTS, Output

DrawStage = Callable[[Graph, OutputImages, Resources, StageInputs], None]
_SURFACE_CONSTANT_NAMES = ("DETAIL",)  # pipeline constants of surface.wgsl


def hair_label_bindings(graph: Graph, resources: Resources | None, inputs: StageInputs) -> Bindings | None:
    """Return the resources that the hair pass needs to label pixels, None if no labels are requested."""
    if not _needs_hair_labels(resources, inputs):
        return None
    assert resources is not None and resources.labels is not None
    _draw_centre_triangles(graph, inputs)
    return resources.labels.hair_bindings(inputs.centres.texture)


def draw(graph: Graph, resources: Resources | None, inputs: StageInputs) -> None:
    """Declare the passes of all requested outputs."""
    if resources is None:
        return
    if not _needs_hair_labels(resources, inputs):  # else `hair_label_bindings` has drawn the centres
        _draw_centre_triangles(graph, inputs)
    for images in resources.images:
        DRAW_STAGES[images.stage](graph, images, resources, inputs)
    if resources.landmarks:
        assert resources.labels is not None
        has_hair = _needs_hair_labels(resources, inputs)
        draw_landmarks(graph, resources.landmarks, inputs, resources.labels.hair_labels, has_hair)


def _needs_hair_labels(resources: Resources | None, inputs: StageInputs) -> bool:
    labels = resources.labels if resources else None
    return inputs.has_hair and labels is not None and labels.hair_classes is not None


def _draw_centre_triangles(graph: Graph, inputs: StageInputs) -> None:
    """Declare passes that find the triangle at each pixel centre, unless the centre is the only sample."""
    if inputs.centres is not inputs.visibility:
        draw_layers(graph, "outputs", inputs.centres, Views(inputs.camera.clips, PIXEL_CENTRE), inputs.head)


def _draw_geometry(
    graph: Graph, output_images: OutputImages, resources: Resources, inputs: StageInputs
) -> None:
    shader = stage_program(graph.device, output_images)
    draw_output_images(graph, output_images, shader, inputs.bindings(shader))


def _draw_surface(
    graph: Graph, output_images: OutputImages, resources: Resources, inputs: StageInputs
) -> None:
    constants = tuple(one for one in inputs.constants if one[0] in _SURFACE_CONSTANT_NAMES)
    shader = stage_program(graph.device, output_images, constants)
    draw_output_images(graph, output_images, shader, inputs.bindings(shader))


def _draw_motion(
    graph: Graph, output_images: OutputImages, resources: Resources, inputs: StageInputs
) -> None:
    previous, vertices = inputs.previous, inputs.shape.vertices
    assert previous is not None
    if previous.pose_bytes is not None:
        assert resources.previous is not None
        shape.draw(graph, resources.previous, previous.pose_bytes)
        vertices = resources.previous.vertices
    shader = stage_program(graph.device, output_images)
    bindings = inputs.bindings(shader) | {
        "previous": shader.make_record("Previous", rays=ray_record(shader, previous.view)),
        "previous_table": vertices["vertex_table"],
        "previous_buffer": vertices["vertex_buffer"],
    }
    draw_output_images(graph, output_images, shader, bindings)


def _draw_alpha(graph: Graph, output_images: OutputImages, resources: Resources, inputs: StageInputs) -> None:
    draw_output_images(
        graph, output_images, stage_program(graph.device, output_images), {"exposed": inputs.picture.exposed}
    )


def _draw_label(graph: Graph, output_images: OutputImages, resources: Resources, inputs: StageInputs) -> None:
    assert resources.labels is not None
    draw_labels(graph, output_images, resources.labels, inputs)


def _light_stage(
    draw_light_outputs: Callable[[Graph, OutputImages, light.LightOutputs, StageInputs], None],
) -> DrawStage:
    return lambda graph, images, resources, inputs: draw_light_outputs(graph, images, resources.light, inputs)


DRAW_STAGES: Registry[DrawStage] = Registry(
    "stage of outputs",
    {
        "geometry": _draw_geometry,
        "surface": _draw_surface,
        "motion": _draw_motion,
        "alpha": _draw_alpha,
        "light": _light_stage(light.draw_light),
        "visibility": _light_stage(light.draw_visibility),
        "pigments": _light_stage(light.draw_pigments),
        "thickness": _light_stage(light.draw_thickness),
        "label": _draw_label,
    },
)
"""Functions that declare the passes of a stage, by the name of its shader features/outputs/STAGE.wgsl."""


def shader_lists() -> Mapping[str, Callable[[], Sequence[ShaderListMember]]]:
    """Return, for each stage, the list of outputs over which the shader preprocessor loops in STAGE.wgsl.

    It loops at `//#each` directives.
    """
    stages = {one.stage for one in OUTPUTS.values()}
    return {f"{stage}_outputs": partial(_stage_members, stage) for stage in sorted(stages)}


def _stage_members(stage_name: str) -> list[ShaderListMember]:
    return [
        ShaderListMember(one.name, one.shader, _wgsl_type_and_background(one))
        for one in OUTPUTS.values()
        if one.stage == stage_name
    ]


def _wgsl_type_and_background(output: Output) -> tuple[tuple[str, str], ...]:
    """Return the WGSL type of an output, and the literal that the shader writes where there is no surface."""
    kind = output.wgsl_type if output.channels == 1 else f"vec{output.channels}f"
    nothing = output.background if kind == "f32" else int(output.background)
    return ("type", kind), ("nothing", f"{kind}({nothing})")
