"""Outputs of light: albedo, irradiance, what leaves below the surface and off it, shares of lights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from dermis.frame.passes import program
from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.geometry import look_of
from dermis.frame.passes.outputs.pigments import Pigmented
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.projection import Triple
from dermis.gpu import Bindings, Constants, Device, Recorder, make_texture

_MOST_LIGHTS = 64  # as in visibility.wgsl


@dataclass(frozen=True, eq=False)
class LightSpace:
    """What outputs of light and of the skin take besides their planes; nothing that is not asked.

    parts : how many lights each light is shaded as
    apart : what the technique keeps apart to spread it over the picture
    through : textures of the light through thin parts, of each layout and, of several, all together
    thickness : texture for the thickness of the flesh
    pigmented : where the skin's pigments are known from
    """

    parts: tuple[int, ...]
    apart: Any
    through: tuple[Any, ...]
    thickness: Any
    pigmented: Pigmented | None


class Shading(NamedTuple):
    """What the picture is shaded by.

    lit : its resources
    view : record of the struct Shade
    centre_mm : the head's, from which places of a scene are counted
    constants : of the lights, the surface and the technique
    scattered : light below the skin by place on the atlas, or the tables of pre-integrated skin
    """

    lit: Bindings
    view: Any
    centre_mm: Triple
    constants: Constants
    scattered: Any


def draw(graph: Recorder, planes: Planes, shading: Shading, centres: Any, apart: Any = None) -> None:
    """Fill the planes, but for what spreads over the picture and what comes through thin parts.

    centres : texture of the triangles at the pixels' centres
    apart : layers for the light below the skin and how it leaves, where that spreads over the picture
    """
    shader = outputs.stage_program(graph.device, planes, shading.constants)
    bound = _bound(shader, shading, centres) | {"apart": apart or nothing_apart(graph.device)}
    outputs.draw(graph, planes, shader, bound)


def add_spread(graph: Recorder, planes: Planes, below: Any, leaving: Any) -> None:
    """Add what spread over the picture to the diffuse light.

    below, leaving : textures of the light and of the share of it that leaves towards the eye
    """
    shader = program(graph.device, "outputs/spread.wgsl", _first(planes, "diffuse"))
    outputs.draw(graph, planes, shader, {"below": below, "leaving": leaving})


def take_through(graph: Recorder, planes: Planes, shading: Shading, centres: Any, through: Any) -> None:
    """Multiply the share that leaves by the light through thin parts, a texture of the atlas."""
    shader = program(graph.device, "outputs/through.wgsl", _first(planes, "translucent"))
    look = look_of(shader, shading.view, shading.centre_mm)
    bound = {**shading.lit, "look": look, "centres": centres, "through": through}
    outputs.draw(graph, planes, shader, bound)


def draw_visibility(
    graph: Recorder, planes: Planes, shading: Shading, centres: Any, parts: tuple[int, ...]
) -> None:
    """Fill the planes of the visibility of lights.

    parts : how many each light is shaded as
    """
    shader = outputs.stage_program(graph.device, planes, shading.constants)
    ends = np.zeros(_MOST_LIGHTS, np.uint32)
    ends[: len(parts)] = np.cumsum(parts)
    given = shader.record("Given", count=len(parts), end=ends.reshape(-1, 4))
    outputs.draw(graph, planes, shader, _bound(shader, shading, centres) | {"given": given})


def nothing_apart(device: Device) -> Any:
    """Placeholder for the layers where no light is kept apart."""
    return device.shared("nothing apart", lambda: make_texture(device, (1, 1), "rgba32float", layers=2))


def _bound(shader: Any, shading: Shading, centres: Any) -> dict[str, Any]:
    look = look_of(shader, shading.view, shading.centre_mm)
    shown = {"shade": _all_shown(shading.view), "scattered": shading.scattered}
    return {**shading.lit, **shown, "look": look, "centres": centres}


def _all_shown(view: Any) -> Any:
    """The record with all light, whichever the picture shows."""
    record: Any = np.ndarray((), view.dtype, bytearray(view.tobytes()))
    record["shown"] = 1.0
    return record


def _first(planes: Planes, name: str) -> Constants:
    return tuple(one for one in planes.constants if one[0] == f"{name.upper()}_FIRST")
