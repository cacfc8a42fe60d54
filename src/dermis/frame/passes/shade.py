"""The image: shades every sample of the visibility buffer."""

from __future__ import annotations

from typing import Any

from dermis.frame.passes import program, strip_for
from dermis.frame.passes.post import Picture
from dermis.frame.passes.visibility_buffer import Layers
from dermis.gpu import Bindings, ComputeProgram, Constants, Device, Recorder, make_texture


def shade_program(device: Device, constants: Constants = ()) -> ComputeProgram:
    """The pass' shader, which also has the structs of the lights', skin's and camera's records.

    constants : of the lights, the surface and the technique
    """
    return program(device, "shade.wgsl", constants)


def draw(
    graph: Recorder,
    lit: Bindings,
    view: Any,
    constants: Constants,
    visibility: Layers,
    scattered: Any,
    picture: Picture,
    apart: Any = None,
) -> Any:
    """Shade every sample of every pixel; returns the texture of radiance and coverage.

    view : record of the shader's struct Shade
    constants : of the lights, the surface and the technique
    scattered : light below the skin by place on the atlas, or the tables of pre-integrated skin
    apart : layers for the light below the skin and how it leaves, which the radiance then lacks
    """
    device, (width, height) = graph.device, picture.size
    bound = {**lit, "shade": view, "visibility_buffer": visibility.texture, "scattered": scattered}
    bound |= {"image": picture.radiance, "apart": apart or nothing_apart(device)}
    shader = shade_program(device, (*constants, *strip_for(device, visibility.count)))
    graph.compute("shade", shader, bound, (width, -(-height // int(shader.constants.get("STRIP", 1)))))
    return picture.radiance


def nothing_apart(device: Device) -> Any:
    """Placeholder for the layers where no light is kept apart."""
    return device.shared("nothing apart", lambda: make_texture(device, (1, 1), "rgba32float", layers=2))
