"""The stages that make outputs, by the names of their shaders, and the passes that they declare."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from dermis.base.registry import Registry
from dermis.frame.features.outputs import light
from dermis.frame.features.outputs.labels import draw_labels
from dermis.frame.features.outputs.landmarks import draw_landmarks
from dermis.frame.features.outputs.planes import Planes, fill, stage_program
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
_OF_THE_SURFACE = ("DETAIL",)  # pipeline constants of surface.wgsl


def hair_labels(graph: Graph, made: Resources | None, seen: StageInputs) -> Bindings | None:
    """Return what the pass that draws hairs binds to label them too; None where no labels are requested."""
    if not _labels_hairs(made, seen):
        return None
    assert made is not None and made.labels is not None
    return made.labels.hair_bindings(_draw_centres(graph, made, seen))


def draw(graph: Graph, made: Resources | None, seen: StageInputs) -> None:
    """Declare the passes that fill the planes of all requested outputs."""
    if made is None:
        return
    drawn = _labels_hairs(made, seen)
    centres = (made.centres or seen.visibility).texture if drawn else _draw_centres(graph, made, seen)
    for planes in made.planes:
        STAGES[planes.stage](graph, planes, made, seen, centres)
    if made.landmarks:
        draw_landmarks(graph, made.landmarks, seen, centres)


def _labels_hairs(made: Resources | None, seen: StageInputs) -> bool:
    return seen.hair and made is not None and made.labels is not None and made.labels.hair_classes is not None


def _draw_centres(graph: Graph, made: Resources, seen: StageInputs) -> Texture:
    """Find the triangles at the pixels' centres, unless the picture's only sample lies there."""
    if made.centres is None:
        return seen.visibility.texture
    draw_layers(graph, "outputs", made.centres, Views(seen.camera.clips, PIXEL_CENTRE), seen.head)
    return made.centres.texture


def _geometry(graph: Graph, planes: Planes, made: Resources, seen: StageInputs, centres: Texture) -> None:
    shader = stage_program(graph.device, planes)
    fill(graph, planes, shader, seen.bound(shader, centres))


def _surface(graph: Graph, planes: Planes, made: Resources, seen: StageInputs, centres: Texture) -> None:
    constants = tuple(one for one in seen.constants if one[0] in _OF_THE_SURFACE)
    shader = stage_program(graph.device, planes, constants)
    fill(graph, planes, shader, seen.bound(shader, centres))


def _motion(graph: Graph, planes: Planes, made: Resources, seen: StageInputs, centres: Texture) -> None:
    previous, vertices = seen.previous, seen.shape.vertices
    assert previous is not None
    if previous.motion is not None:
        assert made.previous is not None
        shape.draw(graph, made.previous, previous.motion)
        vertices = made.previous.vertices
    shader = stage_program(graph.device, planes)
    bound = seen.bound(shader, centres) | {
        "before": shader.record("Before", rays=ray_record(shader, previous.view)),
        "before_table": vertices["vertex_table"],
        "before_buffer": vertices["vertex_buffer"],
    }
    fill(graph, planes, shader, bound)


def _alpha(graph: Graph, planes: Planes, made: Resources, seen: StageInputs, centres: Texture) -> None:
    fill(graph, planes, stage_program(graph.device, planes), {"exposed": seen.picture.exposed})


def _label(graph: Graph, planes: Planes, made: Resources, seen: StageInputs, centres: Texture) -> None:
    assert made.labels is not None
    draw_labels(graph, planes, made.labels, seen, centres)


def _of_light(draw: Callable[[Graph, Planes, light.LightOutputs, StageInputs, Texture], None]) -> Stage:
    def stage(graph: Graph, planes: Planes, made: Resources, seen: StageInputs, centres: Texture) -> None:
        draw(graph, planes, made.light, seen, centres)

    return stage


STAGES: Registry[Stage] = Registry(
    "stage of outputs",
    {
        "geometry": _geometry,
        "surface": _surface,
        "motion": _motion,
        "alpha": _alpha,
        "light": _of_light(light.draw_light),
        "visibility": _of_light(light.draw_visibility),
        "pigments": _of_light(light.draw_pigments),
        "thickness": _of_light(light.draw_thickness),
        "label": _label,
    },
)
"""By the names of their shaders, features/outputs/STAGE.wgsl."""


def output_lists() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """A list for each stage, features/outputs/STAGE.wgsl: STAGE_outputs, the outputs that it can make."""
    stages = {one.stage for one in OUTPUTS.values()}
    return {f"{stage}_outputs": partial(_made_by, stage) for stage in sorted(stages)}


def _made_by(stage: str) -> list[Member]:
    return [Member(one.name, one.shader, _words(one)) for one in OUTPUTS.values() if one.stage == stage]


def _words(output: Output) -> tuple[tuple[str, str], ...]:
    """Type of its values in the shader, and the one where nothing is seen."""
    kind = output.wgsl_type if output.channels == 1 else f"vec{output.channels}f"
    nothing = output.background if kind == "f32" else int(output.background)
    return ("type", kind), ("nothing", f"{kind}({nothing})")
