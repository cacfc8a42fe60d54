"""The image: shades every sample of the visibility buffer."""

from __future__ import annotations

from dermis.frame.features.visibility.layers import Layers
from dermis.frame.programs import program, strip_for
from dermis.gpu import Bindings, ComputeProgram, Constants, Device, Record, Recorder, Texture, make_texture


def shade_program(device: Device, constants: Constants = ()) -> ComputeProgram:
    """The pass' shader, which also has the structs of the lights', skin's and camera's records.

    constants : of the lights, the surface and the technique
    """
    return program(device, "shading/shade.wgsl", constants)


def draw(
    graph: Recorder,
    lit: Bindings,
    view: Record,
    constants: Constants,
    visibility: Layers,
    scattered: Texture,
    image: Texture,
    size: tuple[int, int],
    apart: Texture | None = None,
) -> Texture:
    """Shade every sample of every pixel into the image, radiance and coverage; return the image.

    view : record of the shader's struct Shade
    constants : of the lights, the surface and the technique
    scattered : light below the skin by place on the atlas, or the tables of pre-integrated skin
    apart : layers for the light below the skin and how it leaves, which the radiance then lacks
    """
    device, (width, height) = graph.device, size
    bound = {**lit, "shade": view, "visibility_buffer": visibility.texture, "scattered": scattered}
    bound |= {"image": image, "apart": apart or nothing_apart(device)}
    shader = shade_program(device, (*constants, *strip_for(device, visibility.count)))
    graph.compute("shade", shader, bound, (width, -(-height // int(shader.constants.get("STRIP", 1)))))
    return image


def nothing_apart(device: Device) -> Texture:
    """Placeholder for the layers where no light is kept apart."""
    return device.shared("nothing apart", lambda: make_texture(device, (1, 1), "rgba32float", layers=2))
