"""Outputs of light and skin: albedo, radiance, visibility of lights, pigments and thickness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dermis.base.errors import DermisError, refuse
from dermis.frame.features.diffusion.combine import make_blur_sum
from dermis.frame.features.outputs.output_images import OutputImages, draw_output_images, stage_program
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.features.shading.shade import placeholder_subsurface_layers
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.programs import program, workgroup_grid
from dermis.frame.request import FrameRequest
from dermis.gpu import (
    Bindings,
    ComputeProgram,
    Device,
    Memo,
    MutableBindings,
    Recorder,
    Texture,
    UniformRecord,
    make_texture,
    upload,
)
from dermis.optics.pigments.parameters import SKINS, SkinParameters
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES
from dermis.scene.tissue import skin_tissue

_TRANSLUCENCY_OUTPUTS = ("translucent", "thickness")
_PIGMENT_OUTPUTS = ("melanin", "blood")
_MAX_VISIBILITY_LIGHTS = 64  # as in visibility.wgsl


@dataclass(frozen=True, eq=False)
class LightOutputs:
    """Resources for outputs of light and skin, apart from the buffers into which the outputs are written.

    light_part_counts : number of parts into which each light is divided for shading
    transmitted : textures of the light transmitted through thin parts of the head, such as ears. There is one
        for each atlas layout and, if there are several layouts, one for their blend
    thickness : texture of the tissue thickness, None if the thickness is not requested
    pigments : melanin and blood fractions of uniform skin [-], None for painted maps or if pigments are not
        requested
    """

    light_part_counts: tuple[int, ...]
    transmitted: tuple[Texture, ...]
    thickness: Texture | None
    pigments: tuple[float, float] | None


def make_light_outputs(
    memo: Memo, device: Device, request: FrameRequest, translucency: Sequence[Translucency | None]
) -> LightOutputs:
    """Return the resources of the requested outputs of light and skin.

    translucency : for each atlas layout, the resources of light through thin parts of the head; None if the
        scene has no such light

    Raises DermisError for outputs that the technique, the lights or the skin cannot provide.
    """
    requested, cached, pairs = set(request.outputs), memo.get, _translucent_pairs(request, translucency)
    if "visibility" in requested and not request.light_part_counts:
        refuse("output visibility", "a scene with lights", "it has none", "Add one, or leave the output out")
    transmitted: tuple[Texture, ...] = ()
    if "translucent" in requested:
        roles = [*map(str, range(len(translucency))), *(["both"] if translucency[1:] else [])]
        side = request.settings.atlas
        transmitted = tuple(
            cached(make_blur_sum, device, side, caller_name=f"through {role}") for role in roles
        )
    return LightOutputs(
        light_part_counts=request.light_part_counts,
        transmitted=transmitted,
        thickness=cached(make_thickness_map, device, pairs) if pairs and "thickness" in requested else None,
        pigments=_uniform_pigments(request) if requested & set(_PIGMENT_OUTPUTS) else None,
    )


def draw_light(
    graph: Recorder, output_images: OutputImages, resources: LightOutputs, inputs: StageInputs
) -> None:
    """Declare the passes that shade the surface at pixel centres, for outputs such as albedo.

    Screen-space techniques also diffuse the subsurface light over the picture.
    """
    device, diffusion = graph.device, inputs.picture_diffusion
    shader = stage_program(device, output_images, inputs.constants)
    layers = diffusion.layers if diffusion else placeholder_subsurface_layers(device)
    draw_output_images(
        graph, output_images, shader, _shading_bindings(shader, inputs) | {"subsurface": layers}
    )
    if diffusion is not None and "diffuse" in output_images.channels:
        below, leaving = diffusion.diffuse()
        add = program(device, "outputs/spread.wgsl", output_images.first_channel_constant("diffuse"))
        draw_output_images(graph, output_images, add, {"below": below, "leaving": leaving})
    if "translucent" in output_images.channels:
        transmitted = inputs.sum_transmitted(resources.transmitted)
        multiply = program(
            device, "outputs/transmitted.wgsl", output_images.first_channel_constant("translucent")
        )
        bindings = inputs.bindings(multiply) | {"transmitted": transmitted}
        draw_output_images(graph, output_images, multiply, bindings)


def draw_visibility(
    graph: Recorder, output_images: OutputImages, resources: LightOutputs, inputs: StageInputs
) -> None:
    """Declare the pass that computes how much of each light is visible from the surface at each pixel."""
    shader, counts = stage_program(graph.device, output_images, inputs.constants), resources.light_part_counts
    ends = np.zeros(_MAX_VISIBILITY_LIGHTS, np.uint32)
    ends[: len(counts)] = np.cumsum(counts)
    parts = shader.make_record("LightParts", count=len(counts), end=ends.reshape(-1, 4))
    draw_output_images(
        graph, output_images, shader, _shading_bindings(shader, inputs) | {"light_parts": parts}
    )


def draw_pigments(
    graph: Recorder, output_images: OutputImages, resources: LightOutputs, inputs: StageInputs
) -> None:
    """Declare the pass that writes the melanin and blood fractions of the skin at each pixel."""
    shader, uniform = stage_program(graph.device, output_images), resources.pigments
    record = shader.make_record("Pigments", uniform_pigments=uniform or (0.0, 0.0), painted=uniform is None)
    draw_output_images(graph, output_images, shader, inputs.bindings(shader) | {"pigments": record})


def draw_thickness(
    graph: Recorder, output_images: OutputImages, resources: LightOutputs, inputs: StageInputs
) -> None:
    """Declare the passes that measure the tissue thickness of thin parts, and write it for each pixel."""
    assert inputs.translucency is not None and resources.thickness is not None
    measure_thickness(graph, inputs.translucency, resources.thickness)
    shader = stage_program(graph.device, output_images)
    bindings = inputs.bindings(shader) | {"thickness_map": resources.thickness}
    draw_output_images(graph, output_images, shader, bindings)


def make_thickness_map(device: Device, pair_buffers: PairBuffers) -> Texture:
    """Return a texture for tissue thickness [mm], filled with the upper limit of measured thicknesses.

    The texture has one texel for each cell of the atlas. The limit is the largest distance between the cells
    of a pair, because thickness is measured between these cells.

    pair_buffers : pairs of cells on opposite sides of thin parts of the head
    """
    surface = pair_buffers.cells.receiver_mask
    texels = np.zeros((*surface.shape, 4), np.float32)
    texels[..., 0], texels[..., 3] = pair_buffers.cells.radius_mm * surface, surface
    texture = make_texture(device, surface.shape, "rgba32float", texture_name="thickness")
    upload(device, texture, texels)
    return texture


def measure_thickness(graph: Recorder, translucency: Translucency, thickness_map: Texture) -> None:
    """Declare the pass that writes the tissue thickness of the posed head to a texture.

    thickness_map : result of `make_thickness_map`
    """
    pairs, shader = translucency.pairs, program(graph.device, "outputs/thickness_map.wgsl")
    count, cells = pairs.receivers[1], pairs.cells
    reach = {"count": count, "radius_mm": cells.radius_mm, "cell_mm2": cells.cell_mm**2}
    bindings: Bindings = {
        "reach": shader.make_record("Reach", **reach),
        "receiver_ranges": pairs.receiver_ranges,
        "pairs": pairs.pairs,
        "receiver_points": translucency.receiver_points,
        "source_points": translucency.source_points,
        "thickness_map": thickness_map,
    }
    graph.dispatch("outputs", shader, bindings, workgroup_grid(count))


def _shading_bindings(shader: ComputeProgram, inputs: StageInputs) -> MutableBindings:
    """Return the resources of a shader that shades, with subsurface and reflected light both switched on."""
    shade: UniformRecord = np.ndarray((), inputs.view.dtype, bytearray(inputs.view.tobytes()))
    shade["light_factors"] = 1.0
    return inputs.bindings(shader) | {"shade": shade, "scattered": inputs.scattered}


def _translucent_pairs(
    request: FrameRequest, translucency: Sequence[Translucency | None]
) -> PairBuffers | None:
    """Return the pairs of cells on opposite sides of thin parts; None if no output needs them.

    Raises DermisError if an output needs them, but the frame is rendered without light through thin parts.
    """
    output_name = next((name for name in request.outputs if name in _TRANSLUCENCY_OUTPUTS), None)
    if output_name is None:
        return None
    if translucency[0] is None:
        settings = request.settings
        able = ", ".join(name for name in TECHNIQUES.names if TECHNIQUES[name].supports_translucency)
        actual = f"got technique {settings.technique} with transmission {settings.transmission}"
        expected = f"light that passes thin parts: transmission thin with technique {able}"
        refuse(f"output {output_name}", expected, actual, "Choose these, or leave the output out")
    return translucency[0].pairs


def _uniform_pigments(request: FrameRequest) -> tuple[float, float] | None:
    """Return the melanin and blood fractions of uniform skin [-], None for painted skin.

    Raises DermisError for skin that is not made of pigments.
    """
    maps = request.head.maps
    if (
        request.painted_map_side
        and request.takes_albedo_from_map
        and maps.colour is None
        and maps.roughness is None
    ):
        return None
    parameters = _pigment_parameters(request.skin)
    if parameters is None:
        output_name = next(name for name in request.outputs if name in _PIGMENT_OUTPUTS)
        skins = ", ".join(SKINS)
        expected = f"a person's painted skin, or a profile made of pigments ({skins} or a file's)"
        actual = f"profile {request.skin.profile} on {request.head.name}"
        refuse(f"output {output_name}", expected, actual, "Choose one of them, or leave the output out")
    return parameters.melanin, parameters.blood


def _pigment_parameters(skin: Skin) -> SkinParameters | None:
    """Return the pigments from which the profile of a skin is computed, None if there are none."""
    try:
        return skin_tissue(skin).parameters
    except DermisError:  # profiles that are no tissue, such as the default
        return None
