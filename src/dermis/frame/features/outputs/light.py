"""Outputs of light and of what is below the skin: albedo, radiance, visibility, pigments, thickness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dermis.base.errors import DermisError, refuse
from dermis.frame.features.diffusion.combine import make_sum
from dermis.frame.features.outputs.planes import Planes, fill, stage_program
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.features.shading.shade import no_separate_light
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.programs import workgroup_grid, program
from dermis.frame.request import FrameRequest
from dermis.gpu import (
    Bindings,
    ComputeProgram,
    Device,
    Memo,
    MutableBindings,
    UniformRecord,
    Recorder,
    Texture,
    make_texture,
    upload,
)
from dermis.optics.pigments.parameters import SKINS, SkinParameters
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES
from dermis.scene.tissue import skin_tissue

_THROUGH = ("translucent", "thickness")
_PIGMENTS = ("melanin", "blood")
_MOST_LIGHTS = 64  # as in visibility.wgsl


@dataclass(frozen=True, eq=False)
class LightOutputs:
    """What outputs of light and of the skin take besides their planes; nothing that is not requested.

    parts : number of lights that each light is shaded as
    through : textures of the light through thin parts, of each layout and, of several, all together
    thickness : texture for the thickness of the flesh
    pigments : (2,) melanin and blood of skin that is alike everywhere, None for painted maps
    """

    parts: tuple[int, ...]
    through: tuple[Texture, ...]
    thickness: Texture | None
    pigments: tuple[float, float] | None


def make_light_outputs(
    memo: Memo, device: Device, request: FrameRequest, thin: Sequence[Translucency | None]
) -> LightOutputs:
    """Return what the requested outputs of light take.

    thin : thin parts of each layout

    Raises DermisError for outputs that the technique, the lights or the skin do not have.
    """
    wanted, cached, pairs = set(request.outputs), memo.get, _pairs(request, thin)
    if "visibility" in wanted and not request.light_part_counts:
        refuse("output visibility", "a scene with lights", "it has none", "Add one, or leave the output out")
    through: tuple[Texture, ...] = ()
    if "translucent" in wanted:
        roles = [*map(str, range(len(thin))), *(["both"] if thin[1:] else [])]
        side = request.settings.atlas
        through = tuple(cached(make_sum, device, side, owner=f"through {role}") for role in roles)
    return LightOutputs(
        parts=request.light_part_counts,
        through=through,
        thickness=cached(make_thickness_map, device, pairs) if pairs and "thickness" in wanted else None,
        pigments=_pigments(request) if wanted & set(_PIGMENTS) else None,
    )


def draw_light(graph: Recorder, planes: Planes, space: LightOutputs, seen: StageInputs, centres: Texture) -> None:
    """Declare the passes that shade the pixels' centres, and spread what spreads over the picture."""
    shader, apart = stage_program(graph.device, planes, seen.constants), seen.spread
    bound = _bound(shader, seen, centres)
    fill(graph, planes, shader, bound | {"apart": apart.layers if apart else no_separate_light(graph.device)})
    if apart is not None and "diffuse" in planes.channels:
        below, leaving = apart.spread()
        add = program(graph.device, "outputs/spread.wgsl", planes.first("diffuse"))
        fill(graph, planes, add, {"below": below, "leaving": leaving})
    if "translucent" in planes.channels:
        through = seen.through(space.through)
        take = program(graph.device, "outputs/transmitted.wgsl", planes.first("translucent"))
        fill(graph, planes, take, seen.bound(take, centres) | {"through": through})


def draw_visibility(
    graph: Recorder, planes: Planes, space: LightOutputs, seen: StageInputs, centres: Texture
) -> None:
    """Declare the pass that finds the share of each light that arrives."""
    shader, parts = stage_program(graph.device, planes, seen.constants), space.parts
    ends = np.zeros(_MOST_LIGHTS, np.uint32)
    ends[: len(parts)] = np.cumsum(parts)
    given = shader.record("Given", count=len(parts), end=ends.reshape(-1, 4))
    fill(graph, planes, shader, _bound(shader, seen, centres) | {"given": given})


def draw_pigments(
    graph: Recorder, planes: Planes, space: LightOutputs, seen: StageInputs, centres: Texture
) -> None:
    """Declare the pass that reads the shares of melanin and blood."""
    shader, everywhere = stage_program(graph.device, planes), space.pigments
    record = shader.record("Pigments", everywhere=everywhere or (0.0, 0.0), painted=everywhere is None)
    fill(graph, planes, shader, seen.bound(shader, centres) | {"pigments": record})


def draw_thickness(
    graph: Recorder, planes: Planes, space: LightOutputs, seen: StageInputs, centres: Texture
) -> None:
    """Declare the passes that measure the flesh below the skin."""
    assert seen.thin is not None and space.thickness is not None
    measure_thickness(graph, seen.thin, space.thickness)
    shader = stage_program(graph.device, planes)
    fill(graph, planes, shader, seen.bound(shader, centres) | {"thickness_map": space.thickness})


def make_thickness_map(device: Device, pairs: PairBuffers) -> Texture:
    """Return a texture of the coarse atlas: the pairs' reach [mm], and 1 where there is surface."""
    surface = pairs.cells.receiver_mask
    texels = np.zeros((*surface.shape, 4), np.float32)
    texels[..., 0], texels[..., 3] = pairs.cells.radius_mm * surface, surface
    texture = make_texture(device, surface.shape, "rgba32float", name="thickness")
    upload(device, texture, texels)
    return texture


def measure_thickness(graph: Recorder, thin: Translucency, into: Texture) -> None:
    """Declare the pass that fills the texture of `make_thickness_map` for the current surface [mm]."""
    pairs, shader = thin.pairs, program(graph.device, "outputs/thickness_map.wgsl")
    count, cells = pairs.receivers[1], pairs.cells
    reach = {"count": count, "radius_mm": cells.radius_mm, "spacing2_mm2": cells.cell_mm**2}
    bound: Bindings = {
        "reach": shader.record("Reach", **reach),
        "listed": pairs.receiver_ranges,
        "pairs": pairs.pairs,
        "receiver_points": thin.receiver_points,
        "source_points": thin.source_points,
        "thickness_map": into,
    }
    graph.dispatch("outputs", shader, bound, workgroup_grid(count))


def _bound(shader: ComputeProgram, seen: StageInputs, centres: Texture) -> MutableBindings:
    """Return what shaders read that shade with all light, whichever part the picture shows."""
    shade: UniformRecord = np.ndarray((), seen.view.dtype, bytearray(seen.view.tobytes()))
    shade["shown"] = 1.0
    return seen.bound(shader, centres) | {"shade": shade, "scattered": seen.scattered}


def _pairs(request: FrameRequest, thin: Sequence[Translucency | None]) -> PairBuffers | None:
    """Return the translucent pairs, None where no requested output follows from them."""
    culprit = next((name for name in request.outputs if name in _THROUGH), None)
    if culprit is None:
        return None
    if thin[0] is None:
        settings = request.settings
        able = ", ".join(name for name in TECHNIQUES.names if TECHNIQUES[name].supports_translucency)
        actual = f"got technique {settings.technique} with transmission {settings.transmission}"
        expected = f"light that passes thin parts: transmission thin with technique {able}"
        refuse(f"output {culprit}", expected, actual, "Choose these, or leave the output out")
    return thin[0].pairs


def _pigments(request: FrameRequest) -> tuple[float, float] | None:
    """Return the skin's melanin and blood, None for painted skin.

    Raises DermisError for skin that is not made of pigments.
    """
    maps = request.head.maps
    if request.painted_side and request.albedo_from_map and maps.colour is None and maps.roughness is None:
        return None
    found = _parameters(request.skin)
    if found is None:
        culprit = next(name for name in request.outputs if name in _PIGMENTS)
        skins = ", ".join(SKINS)
        expected = f"a person's painted skin, or a profile made of pigments ({skins} or a file's)"
        actual = f"profile {request.skin.profile} on {request.head.name}"
        refuse(f"output {culprit}", expected, actual, "Choose one of them, or leave the output out")
    return found.melanin, found.blood


def _parameters(skin: Skin) -> SkinParameters | None:
    """Return those of a profile that is made of pigments."""
    try:
        return skin_tissue(skin).parameters
    except DermisError:  # profiles that are no tissue, as the default
        return None
