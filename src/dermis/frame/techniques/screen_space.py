"""Screen-space subsurface scattering by a separable kernel [Jimenez2015]."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.frame.inputs import FrameInputs
from dermis.frame.programs import program
from dermis.frame.technique import TechniqueResources
from dermis.frame.techniques.technique import Technique
from dermis.gpu import (
    Device,
    Graph,
    Memo,
    MutableBindings,
    Recorder,
    Texture,
    TextureOrView,
    TextureView,
    make_texture,
)
from dermis.gpu.textures import make_view, texture_from_array
from dermis.optics.fits.separable import SeparableKernel, preintegrated_kernel
from dermis.optics.gaussians import GaussianSum
from dermis.scene.camera import ImageRectangle
from dermis.scene.settings import Settings

TECHNIQUES_FOLDER = Path(__file__).parent
# Largest fraction of the light of a channel that may lie beyond the kernel's reach on one side.
_MAX_TAIL_FRACTION = 5e-4
_MIN_KERNEL_REACH_MM, _MAX_KERNEL_REACH_MM = 0.01, 400.0
_KERNEL_ENTRY_COUNT = 256


@dataclass(frozen=True, eq=False)
class SubsurfaceLayers(TechniqueResources):
    """Textures of the subsurface light in the picture, and textures for the results of its diffusion.

    layers : texture of two layers. The first holds subsurface light, with the depth of the surface [mm] as
        alpha; the second holds the fraction of this light that leaves the skin towards the camera
    subsurface : view of the first layer
    transmittance : view of the second layer
    scratch : texture for light that is diffused along rows, but not yet along columns; light that is diffused
        along both replaces the first layer of `layers`
    result : texture for the picture with diffused light, None if only the subsurface light is needed
    kernel : diffusion kernel of the profile, None if the caller provides the kernel
    """

    layers: Texture
    subsurface: TextureView
    transmittance: TextureView
    scratch: Texture
    result: Texture | None
    kernel: KernelTexture | None


@dataclass(frozen=True, eq=False)
class KernelTexture:
    """Texture of a diffusion kernel, stored as integrals from 0 to increasing distances.

    reach_mm : distance of the last entry [mm]
    """

    texture: Texture
    reach_mm: float


class ScreenSpace(Technique):
    """Technique that diffuses subsurface light over the pixels of the picture [Jimenez2015]."""

    sources = ("Jimenez2015",)
    shade_constants = (("SPLIT", 1),)
    pixel_bytes = 64
    subsurface_layer_bytes = 48

    def make_resources(
        self, memo: Memo, device: Device, settings: Settings, profile: GaussianSum
    ) -> SubsurfaceLayers:
        """Return the textures in which the picture's light is diffused, and the kernel of the profile."""
        layers = memo.get(make_subsurface_layers, device, settings.size)
        return replace(layers, kernel=memo.get(make_kernel, device, profile))

    def make_subsurface_layers(self, memo: Memo, device: Device, settings: Settings) -> SubsurfaceLayers:
        """Return textures for subsurface light that is diffused separately from the light of the picture.

        The output "diffuse" needs them. They have neither a texture for a finished picture nor a kernel.
        """
        return memo.get(make_subsurface_layers, device, settings.size, False, caller_name="outputs")

    def subsurface_layers(self, resources: TechniqueResources | None) -> Texture | None:
        """Return the texture of subsurface light, which is `SubsurfaceLayers.layers`."""
        return resources.layers if isinstance(resources, SubsurfaceLayers) else None

    def add_subsurface_light(self, graph: Graph, inputs: FrameInputs, radiance: Texture) -> Texture:
        """Declare the passes that diffuse the subsurface light, and return the picture with this light."""
        layers = inputs.resources.technique
        assert isinstance(layers, SubsurfaceLayers) and layers.kernel is not None
        return draw(graph, layers, layers.kernel, inputs.image_rectangle, radiance)

    def blur_subsurface_layers(
        self, graph: Graph, inputs: FrameInputs
    ) -> tuple[TextureOrView, TextureOrView]:
        """Declare the passes that diffuse the subsurface light of the output "diffuse".

        Return texture views of the diffused light, and of the fraction of this light that leaves the skin
        towards the camera.
        """
        layers, picture_layers = inputs.resources.output_layers, inputs.resources.technique
        assert isinstance(layers, SubsurfaceLayers) and isinstance(picture_layers, SubsurfaceLayers)
        assert picture_layers.kernel is not None
        draw_blur(graph, layers, picture_layers.kernel, inputs.image_rectangle)
        return layers.subsurface, layers.transmittance


TECHNIQUE = ScreenSpace()


def make_subsurface_layers(
    device: Device, picture_size: tuple[int, int], with_result: bool = True
) -> SubsurfaceLayers:
    """Create the textures of `SubsurfaceLayers` for a picture of size (width, height).

    The field `kernel` of the result is None; the caller provides the diffusion kernel of the skin.

    with_result : whether to create the texture for the picture with diffused light
    """
    layers = make_texture(device, picture_size, "rgba32float", layer_count=2)
    subsurface, transmittance = (make_view(layers, layer=k) for k in range(2))
    scratch = make_texture(device, picture_size, "rgba32float")
    result = make_texture(device, picture_size, "rgba32float") if with_result else None
    return SubsurfaceLayers(layers, subsurface, transmittance, scratch, result, None)


def make_kernel(device: Device, profile: GaussianSum) -> KernelTexture:
    """Compute the diffusion kernel of a profile, and upload it."""
    table, reach_mm = kernel_integral_table(preintegrated_kernel(profile))
    return KernelTexture(texture_from_array(device, table, "rgba32float"), reach_mm)


def draw(
    graph: Recorder,
    subsurface_layers: SubsurfaceLayers,
    kernel: KernelTexture,
    image_rectangle: ImageRectangle,
    surface_light: Texture,
) -> Texture:
    """Declare the passes that diffuse the subsurface light, and return the picture with this light.

    subsurface_layers : textures that hold the subsurface light, and textures for the results of the passes
    kernel : diffusion kernel of the profile
    image_rectangle : rectangle of the image plane that the picture shows
    surface_light : shaded picture without the subsurface light
    """
    assert subsurface_layers.result is not None
    draw_blur(graph, subsurface_layers, kernel, image_rectangle)
    bound: MutableBindings = {
        "surface": surface_light,
        "subsurface": subsurface_layers.subsurface,
        "transmittance": subsurface_layers.transmittance,
        "picture": subsurface_layers.result,
    }
    shader = program(graph.device, TECHNIQUES_FOLDER / "resurface.wgsl")
    graph.compute("screen space", shader, bound, surface_light.size[:2])
    return subsurface_layers.result


def draw_blur(
    graph: Recorder,
    subsurface_layers: SubsurfaceLayers,
    kernel: KernelTexture,
    image_rectangle: ImageRectangle,
) -> None:
    """Declare the passes that diffuse the subsurface light along rows, then along columns.

    subsurface_layers : textures of the subsurface light, and a scratch texture. The first pass writes to the
        scratch texture; the second pass overwrites the subsurface light with the diffused light
    kernel : diffusion kernel of the profile
    image_rectangle : rectangle of the image plane that the picture shows
    """
    device, size = graph.device, subsurface_layers.scratch.size[:2]
    programs = [
        program(device, TECHNIQUES_FOLDER / "screen_space.wgsl", (("AXIS", axis),)) for axis in (0, 1)
    ]
    record = programs[0].make_record(
        "Blur", half=image_rectangle.half, shift=image_rectangle.shift, reach=kernel.reach_mm
    )
    passes: tuple[tuple[TextureOrView, TextureOrView], ...] = (
        (subsurface_layers.subsurface, subsurface_layers.scratch),
        (subsurface_layers.scratch, subsurface_layers.subsurface),
    )
    for shader, (source, blurred) in zip(programs, passes, strict=True):
        bound: MutableBindings = {
            "blur": record,
            "source": source,
            "kernel": kernel.texture,
            "blurred": blurred,
        }
        graph.compute("screen space", shader, bound, size)


def kernel_integral_table(kernel: SeparableKernel) -> tuple[NDArray[np.float64], float]:
    """Return integrals of a kernel from 0 to each of n distances, and the largest distance [mm].

    The integrals are one row (1, n, 4) of texels: red, green and blue, and a fourth channel of 0. The square
    roots of the distances are evenly spaced.
    """
    reach = _kernel_reach_mm(kernel)
    fractions = kernel.half_line_integral(reach * np.linspace(0.0, 1.0, _KERNEL_ENTRY_COUNT) ** 2)
    fractions *= 0.5 / fractions[-1]  # the light beyond the reach is added to the light within it
    return np.concatenate([fractions, np.zeros((_KERNEL_ENTRY_COUNT, 1))], axis=1)[None], reach


def _kernel_reach_mm(kernel: SeparableKernel) -> float:
    """Return the distance from the centre of the kernel beyond which at most 0.05 % of the light lies [mm].

    The limit holds for each colour channel and for each side of the centre.
    """
    distance = np.geomspace(_MIN_KERNEL_REACH_MM, _MAX_KERNEL_REACH_MM, 4096)
    beyond = (0.5 - kernel.half_line_integral(distance)).max(axis=1) > _MAX_TAIL_FRACTION
    return float(distance[min(int(beyond.sum()), len(distance) - 1)])
