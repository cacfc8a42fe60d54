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
    scattered : texture of scattered light over the atlas, or tables of pre-integrated skin
    subsurface : texture for the subsurface light (layer 0) and the fraction of that light that leaves towards
        the camera (layer 1), which is then left out of the image; None to add this light to the image
    """
    device, (width, height) = graph.device, picture_size
    bindings = {**lighting, "shade": view, "visibility_buffer": visibility.texture, "scattered": scattered}
    bindings |= {"image": image, "subsurface": subsurface or placeholder_subsurface_layers(device)}
    shader = shade_program(device, (*constants, *strip_constants(device, visibility.count)))
    graph.compute("shade", shader, bindings, (width, -(-height // int(shader.constants.get("STRIP", 1)))))
    return image


def placeholder_subsurface_layers(device: Device) -> Texture:
    """Return a placeholder for the layers of subsurface light, which only screen-space techniques use."""
    return device.cached("nothing apart", lambda: make_texture(device, (1, 1), "rgba32float", layer_count=2))
