"""Views of intermediate results such as irradiance, shadow and normals, on the head or as a flat atlas."""

from __future__ import annotations

import weakref
from pathlib import Path

import numpy as np

from dermis.apps.viewer.state import ATLAS_VIEW_NAME, LIGHT_COMPONENT_VIEWS, AtlasView
from dermis.base.errors import refuse
from dermis.frame.features.post.meter import read_meter
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.inputs import FrameInputs
from dermis.frame.programs import program, workgroup_grid
from dermis.frame.renderer import Renderer
from dermis.gpu import (
    Bindings,
    CommandList,
    ComputeProgram,
    Device,
    Texture,
    TextureOrView,
    download,
    make_texture,
    upload,
)
from dermis.gpu.failures import converted_gpu_failures
from dermis.gpu.textures import texture_from_array
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

BLUR_LEVELS_BY_VIEW = {"irradiance": 0} | {f"blur {k}": k for k in range(1, 7)}
"""Level of the blur pyramid that each view of irradiance shows."""

ATLAS_LAYERS = (*BLUR_LEVELS_BY_VIEW, "stretch", "thickness")
"""Names of the atlas maps that the view "atlas" can show."""

VIEW_NAMES = ("picture", *LIGHT_COMPONENT_VIEWS, *ATLAS_LAYERS, "shadow", "normals", ATLAS_VIEW_NAME)
"""Names of all views."""

_INTERMEDIATE_SHADER_PATH = Path(__file__).parent / "intermediate.wgsl"
_SHADER_QUANTITY_NUMBERS = {
    "stretch": 1,
    "thickness": 2,
    "shadow": 3,
    "normals": 4,
}  # as in the shaders; irradiance is 0
_MISSING_BLUR_ADVICE = "Choose a narrower blur, or the technique texture-space"


class IntermediateViews:
    """Renderer of intermediate results such as irradiance, shadow and normals."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer, device = renderer, renderer.device
        self._atlas_shader = ComputeProgram(device, Path(__file__).parent / "atlas_view.wgsl")
        self._empty_texture = texture_from_array(device, np.zeros((1, 1, 4), np.float32), "rgba32float")
        self._image: Texture | None = None
        self._thickness_maps: weakref.WeakKeyDictionary[PairBuffers, Texture] = weakref.WeakKeyDictionary()
        self._density: weakref.WeakKeyDictionary[Texture, float] = weakref.WeakKeyDictionary()

    def draw(self, scene: Scene, settings: Settings, view_name: str, divider_side: str = "") -> Texture:
        """Return an image of the head that displays an intermediate result of the last frame, in sRGB bytes.

        scene, settings : scene and settings of the last frame
        view_name : name of the view, one of `VIEW_NAMES`
        divider_side : "before" for the frozen state left of the divider, "" for the live state

        Raises DermisError if the technique does not compute the intermediate result.
        """
        inputs = self._renderer.prepare(scene, settings, divider_side)
        unused = ("ENVIRONMENT", "HALF_SPACE", "INTERREFLECTION", "STRANDS")  # not declared by the shader
        constants = tuple(switch for switch in inputs.light_constants if switch[0] not in unused)
        shader = program(self._renderer.device, _INTERMEDIATE_SHADER_PATH, constants)
        layer, scale = self._atlas_layer(inputs, view_name, settings)
        view_fields = ("eye", "forward", "right", "up", "shift", "samples", "jitter")
        record = shader.make_record("ViewParameters", **{name: inputs.view[name] for name in view_fields})
        record["quantity"], record["scale"] = _SHADER_QUANTITY_NUMBERS.get(view_name, 0), scale
        bindings = {
            **inputs.bindings,
            "view_parameters": record,
            "visibility_buffer": inputs.resources.visibility.texture,
            "layer": layer,
        }
        return self._run_image_shader(shader, bindings, settings.size)

    def draw_atlas(
        self, scene: Scene, settings: Settings, atlas_view: AtlasView, divider_side: str = ""
    ) -> Texture:
        """Return an image of sRGB bytes that shows a part of the atlas of the last frame.

        atlas_view : part of the atlas to show
        divider_side : "before" for the frozen state left of the divider, "" for the live state

        Raises DermisError if the technique does not compute the displayed map.
        """
        inputs = self._renderer.prepare(scene, settings, divider_side)
        layer, scale = self._atlas_layer(inputs, atlas_view.layer, settings)
        values = {"centre": atlas_view.centre, "span": atlas_view.span, "scale": scale}
        quantity = _SHADER_QUANTITY_NUMBERS.get(atlas_view.layer, 0)
        record = self._atlas_shader.make_record("AtlasView", quantity=quantity, **values)
        return self._run_image_shader(
            self._atlas_shader, {"atlas_view": record, "layer": layer}, settings.size
        )

    def _run_image_shader(
        self, shader: ComputeProgram, bindings: Bindings, image_size: tuple[int, int]
    ) -> Texture:
        """Run a shader that writes an image to its binding `bytes`, and return the image's texture."""
        device = self._renderer.device
        if self._image is None or self._image.size[:2] != image_size:
            self._image = make_texture(device, image_size, "rgba8uint")
        with converted_gpu_failures(device):
            frame = CommandList(device)
            frame.compute("view", shader, {**bindings, "bytes": self._image}, image_size)
            frame.submit()
        return self._image

    def _atlas_layer(
        self, frame_inputs: FrameInputs, layer_name: str, settings: Settings
    ) -> tuple[TextureOrView, float]:
        """Return the texture of an atlas layer, and a scale for displaying it.

        For sharp and blurred irradiance, the scale is the factor by which texels are multiplied for display.
        For the layer "stretch", it is the mean number of texels per mm; for other layers, it is 1.
        """
        if layer_name in BLUR_LEVELS_BY_VIEW:
            level, blur = BLUR_LEVELS_BY_VIEW[layer_name], next(iter(frame_inputs.blurs), None)
            count = len(blur.profile_levels) if blur else 0
            if blur is None or level >= count:
                refuse(
                    f"view {layer_name}",
                    "a pyramid level of the atlas",
                    f"there are {count}",
                    _MISSING_BLUR_ADVICE,
                )
            layer = blur.profile_levels[level]
            texture = frame_inputs.resources.diffusion.levels.layer(layer, blur.halvings[layer])
            return texture, self._exposure(frame_inputs) / blur.scale
        if layer_name == "stretch":
            stretch = frame_inputs.layouts[0].atlas.resources["stretch_map"]
            return stretch, self._mean_texel_density(stretch)
        return self._thickness_texture(
            frame_inputs
        ) if layer_name == "thickness" else self._empty_texture, 1.0

    def _exposure(self, frame_inputs: FrameInputs) -> float:
        """Return the exposure factor of the last frame, whether metered or fixed [-]."""
        meter, exposure = frame_inputs.resources.post.meter, frame_inputs.settings.exposure
        return read_meter(self._renderer.device, meter) if meter else float(exposure)

    def _thickness_texture(self, frame_inputs: FrameInputs) -> Texture:
        translucency = frame_inputs.layouts[0].translucency
        if translucency is None:
            refuse("view thickness", "a scene with translucency", "it is off", "Set transmission to thin")
        if translucency.pairs not in self._thickness_maps:
            side, radius_mm = translucency.pairs.cells.side, translucency.pairs.cells.radius_mm
            everywhere = np.full((side, side), radius_mm, np.float32)
            texture = make_texture(self._renderer.device, (side, side), "r32float")
            upload(self._renderer.device, texture, everywhere)
            self._thickness_maps[translucency.pairs] = texture
        return draw_thickness(self._renderer.device, translucency, self._thickness_maps[translucency.pairs])

    def _mean_texel_density(self, stretch_map: Texture) -> float:
        """Return the geometric mean of the texel density that a stretch map contains [texels/mm]."""
        if stretch_map not in self._density:
            metric = download(self._renderer.device, stretch_map)[..., :2].astype(np.float64)
            covered = metric[(metric > 0.0).all(axis=-1)]
            self._density[stretch_map] = float(np.exp(np.log(covered).mean())) if len(covered) else 1.0
        return self._density[stretch_map]


def draw_thickness(device: Device, translucency: Translucency, target_texture: Texture) -> Texture:
    """Write the tissue thickness [mm] at each texel of the coarse atlas to a texture; return the texture.

    Light enters the skin at the first texel of a pair, passes through the tissue, and leaves the skin at the
    second texel. The thickness at a second texel is its smallest depth below the tangent planes at the first
    texels from which light arrives. It is at most the largest permitted distance between paired texels.

    translucency : pairs of texels, and the points of the skin at these texels
    target_texture : texture with the size of the coarse atlas; texels that are not the second texel of any
        pair are left unchanged
    """
    pairs, shader = translucency.pairs, program(device, Path(__file__).parent / "thickness.wgsl")
    count = pairs.receivers[1]
    bindings: Bindings = {
        "parameters": shader.make_record("ThicknessParameters", radius_mm=pairs.cells.radius_mm, count=count),
        "receiver_ranges": pairs.receiver_ranges,
        "pairs": pairs.pairs,
        "receiver_points": translucency.receiver_points,
        "source_points": translucency.source_points,
        "thickness": target_texture,
    }
    frame = CommandList(device, timed=False)
    frame.dispatch("view", shader, bindings, workgroup_grid(count))
    frame.submit()
    return target_texture
