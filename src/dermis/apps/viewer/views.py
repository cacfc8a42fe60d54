"""Views of intermediate results, drawn over the pixels that see them or as the flat atlas."""

from __future__ import annotations

import weakref
from pathlib import Path

import numpy as np

from dermis.apps.viewer.state import ATLAS, PARTS, Chart
from dermis.base.errors import refuse
from dermis.frame.features.post.meter import read_meter
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.inputs import Inputs
from dermis.frame.programs import each, program
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
from dermis.gpu.failures import gpu_failures
from dermis.gpu.textures import texture_from
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

LEVELS = {"irradiance": 0} | {f"blur {k}": k for k in range(1, 7)}
"""Views of the light on the atlas by its layer."""

LAYERS = (*LEVELS, "stretch", "thickness")
"""Layers of the atlas."""

VIEWS = ("picture", *PARTS, *LAYERS, "shadow", "normals", ATLAS)
"""All views."""

_INTERMEDIATE = Path(__file__).parent / "intermediate.wgsl"
_NUMBERS = {"stretch": 1, "thickness": 2, "shadow": 3, "normals": 4}  # as in intermediate.wgsl; levels are 0
_ATLAS_NEEDED = "Choose a narrower blur, or the technique texture-space"


class Views:
    """Draws intermediates over the pixels that see them."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer, device = renderer, renderer.device
        self._flat = ComputeProgram(device, Path(__file__).parent / "chart.wgsl")
        self._nothing = texture_from(device, np.zeros((1, 1, 4), np.float32), "rgba32float")
        self._image: Texture | None = None
        self._thick: weakref.WeakKeyDictionary[PairBuffers, Texture] = weakref.WeakKeyDictionary()
        self._density: weakref.WeakKeyDictionary[Texture, float] = weakref.WeakKeyDictionary()

    def draw(self, scene: Scene, settings: Settings, view: str, side: str = "") -> Texture:
        """Return bytes that show an intermediate of the frame drawn last on a side of the divider.

        Raises DermisError for what the technique does not make.
        """
        inputs = self._renderer.prepare(scene, settings, side)
        around = ("ENVIRONMENT", "HALF_SPACE", "INTERREFLECTION", "STRANDS")  # which the shader has not
        constants = tuple(switch for switch in inputs.light_constants if switch[0] not in around)
        shader = program(self._renderer.device, _INTERMEDIATE, constants)
        layer, scale = self._layer(inputs, view, settings)
        looked = ("eye", "forward", "right", "up", "shift", "samples", "jitter")
        record = shader.record("Look", **{name: inputs.view[name] for name in looked})
        record["what"], record["scale"] = _NUMBERS.get(view, 0), scale
        bound = {
            **inputs.lit,
            "look": record,
            "visibility_buffer": inputs.resources.visibility.texture,
            "layer": layer,
        }
        return self._computed(shader, bound, settings.size)

    def draw_chart(self, scene: Scene, settings: Settings, chart: Chart, side: str = "") -> Texture:
        """Return bytes that show a part of the atlas of the frame drawn last on a side of the divider.

        Raises DermisError for what the technique does not make.
        """
        inputs = self._renderer.prepare(scene, settings, side)
        layer, scale = self._layer(inputs, chart.layer, settings)
        shown = {"centre": chart.centre, "span": chart.span, "scale": scale}
        sheet = self._flat.record("Sheet", what=_NUMBERS.get(chart.layer, 0), **shown)
        return self._computed(self._flat, {"sheet": sheet, "layer": layer}, settings.size)

    def _computed(self, shader: ComputeProgram, bound: Bindings, size: tuple[int, int]) -> Texture:
        """Return the image that a shader stores to `bytes`."""
        device = self._renderer.device
        if self._image is None or self._image.size[:2] != size:
            self._image = make_texture(device, size, "rgba8uint")
        with gpu_failures(device):
            frame = CommandList(device)
            frame.compute("view", shader, {**bound, "bytes": self._image}, size)
            frame.submit()
        return self._image

    def _layer(self, inputs: Inputs, view: str, settings: Settings) -> tuple[TextureOrView, float]:
        """Return the map of the atlas that a view reads, and the factor of its numbers."""
        if view in LEVELS:
            level, blur = LEVELS[view], next(iter(inputs.blurs), None)
            count = len(blur.own) if blur else 0
            if blur is None or level >= count:
                refuse(f"view {view}", "a level of light on the atlas", f"there are {count}", _ATLAS_NEEDED)
            layer = blur.own[level]
            texture = inputs.resources.diffusion.levels.layer(layer, blur.halvings[layer])
            return texture, self._exposure(inputs) / blur.scale
        if view == "stretch":
            stretch = inputs.layouts[0].atlas.resources["stretch_map"]
            return stretch, self._mean_density(stretch)
        return self._thickness(inputs) if view == "thickness" else self._nothing, 1.0

    def _exposure(self, inputs: Inputs) -> float:
        """Return the exposure of the frame drawn last."""
        meter, given = inputs.resources.post.meter, inputs.settings.exposure
        return read_meter(self._renderer.device, meter) if meter else float(given)

    def _thickness(self, inputs: Inputs) -> Texture:
        thin = inputs.layouts[0].translucency
        if thin is None:
            refuse("view thickness", "light through thin parts", "there is none", "Set transmission to thin")
        if thin.pairs not in self._thick:
            side, radius_mm = thin.pairs.cells.side, thin.pairs.cells.radius_mm
            everywhere = np.full((side, side), radius_mm, np.float32)
            texture = make_texture(self._renderer.device, (side, side), "r32float")
            upload(self._renderer.device, texture, everywhere)
            self._thick[thin.pairs] = texture
        return draw_thickness(self._renderer.device, thin, self._thick[thin.pairs])

    def _mean_density(self, stretch: Texture) -> float:
        """Return the geometric mean of the texels per mm."""
        if stretch not in self._density:
            metric = download(self._renderer.device, stretch)[..., :2].astype(np.float64)
            covered = metric[(metric > 0.0).all(axis=-1)]
            self._density[stretch] = float(np.exp(np.log(covered).mean())) if len(covered) else 1.0
        return self._density[stretch]


def draw_thickness(device: Device, thin: Translucency, into: Texture) -> Texture:
    """Compute the least depth of flesh behind each cell of the atlas with pairs, at most their radius [mm].

    into : texture of the cells; those without pairs stay as they are
    """
    pairs, shader = thin.pairs, program(device, Path(__file__).parent / "thickness.wgsl")
    count = pairs.receivers[1]
    bound: Bindings = {
        "reach": shader.record("Reach", radius_mm=pairs.cells.radius_mm, count=count),
        "sums": pairs.sums,
        "pairs": pairs.pairs,
        "receiver_points": thin.receiver_points,
        "source_points": thin.source_points,
        "thickness": into,
    }
    frame = CommandList(device, timed=False)
    frame.dispatch("view", shader, bound, each(count))
    frame.submit()
    return into
