"""Pass that shades every sample of the visibility buffer."""

from __future__ import annotations

from dermis.frame.features.visibility.layers import ViewLayers
from dermis.frame.programs import program, strip_constants
from dermis.gpu import (
    Bindings,
    ComputeProgram,
    Constants,
    Device,
    Recorder,
    Texture,
    UniformRecord,
    make_texture,
)


def shade_program(device: Device, constants: Constants = ()) -> ComputeProgram:
    """Return the program of the shading pass; its structs also define the records of lights and skin.

    constants : pipeline constants of the lights, the surface and the technique
    """
    return program(device, "shading/shade.wgsl", constants)


def draw(
    graph: Recorder,
    lighting: Bindings,
    view: UniformRecord,
    constants: Constants,
    visibility: ViewLayers,
    scattered: Texture,
    image: Texture,
    picture_size: tuple[int, int],
    subsurface: Texture | None = None,
) -> Texture:
    """Declare the pass that shades all samples of all pixels; return the image of radiance and coverage.

    lighting : resources of the lighting
    view : uniform record of the struct Shade
    constants : pipeline constants of the lights, the surface and the technique
    scattered : texture of the light below the skin over the atlas, or tables of pre-integrated skin
    subsurface : texture layers that receive the subsurface light and the fraction of that light that leaves
        towards the camera; the image is then without this light. None to add the light to the image
    """
    device, (width, height) = graph.device, picture_size
    bindings = {**lighting, "shade": view, "visibility_buffer": visibility.texture, "scattered": scattered}
    bindings |= {"image": image, "subsurface": subsurface or placeholder_subsurface_layers(device)}
    shader = shade_program(device, (*constants, *strip_constants(device, visibility.count)))
    graph.compute("shade", shader, bindings, (width, -(-height // int(shader.constants.get("STRIP", 1)))))
    return image


def placeholder_subsurface_layers(device: Device) -> Texture:
    """Return a placeholder for the layers of light below the skin, for techniques outside screen space."""
    return device.cached("nothing apart", lambda: make_texture(device, (1, 1), "rgba32float", layer_count=2))
