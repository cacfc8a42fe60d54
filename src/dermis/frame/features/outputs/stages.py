"""Stages that compute outputs, by the names of their shaders, and the passes that they declare."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from dermis.base.registry import Registry
from dermis.frame.features.outputs import light
from dermis.frame.features.outputs.labels import draw_labels
from dermis.frame.features.outputs.landmarks import draw_landmarks
from dermis.frame.features.outputs.planes import Planes, draw_planes, stage_program
from dermis.frame.features.outputs.resources import Resources
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.features.shading.view import ray_record
from dermis.frame.features.shape import shape
from dermis.frame.features.visibility.layers import draw_layers
from dermis.frame.projection import PIXEL_CENTRE, Views
from dermis.gpu import Bindings, Graph, Texture
from dermis.gpu.wgsl_source import Member
from dermis.scene.outputs import OUTPUTS, Output

Stage = Callable[[Graph, Planes, Resources, StageInputs, Texture], None]
_SURFACE_CONSTANTS = ("DETAIL",)  # pipeline constants of surface.wgsl


def hair_labels(graph: Graph, resources: Resources | None, inputs: StageInputs) -> Bindings | None:
    """Return the resources for labels in the pass that draws hair, None if no labels are requested."""
    if not _labels_hair(resources, inputs):
        return None
    assert resources is not None and resources.labels is not None
    return resources.labels.hair_bindings(_draw_centres(graph, resources, inputs))


def draw(graph: Graph, resources: Resources | None, inputs: StageInputs) -> None:
    """Declare the passes of all requested outputs."""
    if resources is None:
        return
    if _labels_hair(resources, inputs):  # the centres were drawn for the labels of hair
        centres = (resources.centres or inputs.visibility).texture
    else:
        centres = _draw_centres(graph, resources, inputs)
    for planes in resources.planes:
        STAGES[planes.stage](graph, planes, resources, inputs, centres)
    if resources.landmarks:
        draw_landmarks(graph, resources.landmarks, inputs, centres)


def _labels_hair(resources: Resources | None, inputs: StageInputs) -> bool:
    labels = resources.labels if resources else None
    return inputs.has_hair and labels is not None and labels.hair_classes is not None


def _draw_centres(graph: Graph, resources: Resources, inputs: StageInputs) -> Texture:
    """Find the triangles at the centres of the pixels, unless the only sample of the picture is there."""
    if resources.centres is None:
        return inputs.visibility.texture
    draw_layers(graph, "outputs", resources.centres, Views(inputs.camera.clips, PIXEL_CENTRE), inputs.head)
    return resources.centres.texture


def _geometry(
    graph: Graph, planes: Planes, resources: Resources, inputs: StageInputs, centres: Texture
) -> None:
    shader = stage_program(graph.device, planes)
    draw_planes(graph, planes, shader, inputs.bindings(shader, centres))


def _surface(
    graph: Graph, planes: Planes, resources: Resources, inputs: StageInputs, centres: Texture
) -> None:
    constants = tuple(one for one in inputs.constants if one[0] in _SURFACE_CONSTANTS)
    shader = stage_program(graph.device, planes, constants)
    draw_planes(graph, planes, shader, inputs.bindings(shader, centres))


def _motion(
    graph: Graph, planes: Planes, resources: Resources, inputs: StageInputs, centres: Texture
) -> None:
    previous, vertices = inputs.previous, inputs.shape.vertices
    assert previous is not None
    if previous.motion is not None:
        assert resources.previous is not None
        shape.draw(graph, resources.previous, previous.motion)
        vertices = resources.previous.vertices
    shader = stage_program(graph.device, planes)
    bindings = inputs.bindings(shader, centres) | {
        "previous": shader.record("Previous", rays=ray_record(shader, previous.view)),
        "previous_table": vertices["vertex_table"],
        "previous_buffer": vertices["vertex_buffer"],
    }
    draw_planes(graph, planes, shader, bindings)


def _alpha(graph: Graph, planes: Planes, resources: Resources, inputs: StageInputs, centres: Texture) -> None:
    draw_planes(graph, planes, stage_program(graph.device, planes), {"exposed": inputs.picture.exposed})


def _label(graph: Graph, planes: Planes, resources: Resources, inputs: StageInputs, centres: Texture) -> None:
    assert resources.labels is not None
    draw_labels(graph, planes, resources.labels, inputs, centres)


def _light_stage(draw: Callable[[Graph, Planes, light.LightOutputs, StageInputs, Texture], None]) -> Stage:
    def stage(
        graph: Graph, planes: Planes, resources: Resources, inputs: StageInputs, centres: Texture
    ) -> None:
        draw(graph, planes, resources.light, inputs, centres)

    return stage


STAGES: Registry[Stage] = Registry(
    "stage of outputs",
    {
        "geometry": _geometry,
        "surface": _surface,
        "motion": _motion,
        "alpha": _alpha,
        "light": _light_stage(light.draw_light),
        "visibility": _light_stage(light.draw_visibility),
        "pigments": _light_stage(light.draw_pigments),
        "thickness": _light_stage(light.draw_thickness),
        "label": _label,
    },
)
"""Stages by the names of their shaders, features/outputs/STAGE.wgsl."""


def shader_lists() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """Return the list STAGE_outputs of each stage, from which features/outputs/STAGE.wgsl is generated."""
    stages = {one.stage for one in OUTPUTS.values()}
    return {f"{stage}_outputs": partial(_members, stage) for stage in sorted(stages)}


def _members(stage: str) -> list[Member]:
    return [Member(one.name, one.shader, _words(one)) for one in OUTPUTS.values() if one.stage == stage]


def _words(output: Output) -> tuple[tuple[str, str], ...]:
    """Return the WGSL type of an output, and its value where nothing is seen."""
    kind = output.wgsl_type if output.channels == 1 else f"vec{output.channels}f"
    nothing = output.background if kind == "f32" else int(output.background)
    return ("type", kind), ("nothing", f"{kind}({nothing})")
