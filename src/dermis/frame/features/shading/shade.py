"""Pass that shades every sample of the visibility buffer."""

from __future__ import annotations

from dermis.frame.features.visibility.layers import ViewLayers
from dermis.frame.programs import pixel_column_constants, program
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
    """Return the program of the shading pass, which also defines the structs of the light and skin records.

    constants : pipeline constants of the lights, the surface and the technique
    """
    return program(device, "shading/shade.wgsl", constants)


def draw(
    graph: Recorder,
    lighting_bindings: Bindings,
    shade_record: UniformRecord,
    constants: Constants,
    visibility_layers: ViewLayers,
    scattered_light: Texture,
    radiance_image: Texture,
    picture_size: tuple[int, int],
    subsurface_layers: Texture | None = None,
) -> Texture:
    """Declare the pass that shades all samples of all pixels; return the image of radiance and coverage.

    lighting_bindings : resources of the lighting
    shade_record : uniform record of the struct Shade
    constants : pipeline constants of the lights, the surface and the technique
    visibility_layers : layers with the index of the triangle that is visible at each sample
    scattered_light : texture of scattered light over the atlas, or tables of pre-integrated skin
    radiance_image : texture for the radiance and, as alpha, the coverage by the head
    picture_size : (width, height) [pixels]
    subsurface_layers : texture for the subsurface light (layer 0), and for the fraction of this light that
        leaves the skin towards the camera (layer 1); None to add the subsurface light to the image instead
    """
    device, (width, height) = graph.device, picture_size
    bindings = {
        **lighting_bindings,
        "shade": shade_record,
        "visibility_buffer": visibility_layers.texture,
        "scattered": scattered_light,
    }
    bindings |= {
        "image": radiance_image,
        "subsurface": subsurface_layers or placeholder_subsurface_layers(device),
    }
    shader = shade_program(device, (*constants, *pixel_column_constants(device, visibility_layers.count)))
    graph.compute("shade", shader, bindings, (width, -(-height // int(shader.constants.get("STRIP", 1)))))
    return radiance_image


def placeholder_subsurface_layers(device: Device) -> Texture:
    """Return a placeholder for the layers of subsurface light, which only screen-space techniques use."""
    return device.cached("nothing apart", lambda: make_texture(device, (1, 1), "rgba32float", layer_count=2))
