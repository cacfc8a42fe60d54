"""Light that spreads below the skin over the picture itself, by a separable kernel [Jimenez2015]."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.frame.inputs import Inputs
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
from dermis.gpu.textures import texture_from, view_of
from dermis.optics.fits.separable import SeparableKernel, preintegrate
from dermis.optics.gaussians import GaussianSum
from dermis.scene.camera import Window
from dermis.scene.settings import Settings

FOLDER = Path(__file__).parent
_TAIL = 5e-4  # of the light that goes to one side: no channel has more beyond the kernel's reach
_FINEST_MM, _WIDEST_MM = 0.01, 400.0  # between which the reach is searched
_ENTRIES = 256


@dataclass(frozen=True, eq=False)
class Apart(TechniqueResources):
    """Textures of the light that the shading keeps apart, and for spreading it.

    layers : light below the skin with its depth [mm]; the share of it that leaves towards the eye
    below, leaving : views of the two
    between : light spread along rows only
    result : the whole picture, None for outputs, which need only the light below the skin
    kernel : the profile's, None for outputs, which take that of the picture
    """

    layers: Texture
    below: TextureView
    leaving: TextureView
    between: Texture
    result: Texture | None
    kernel: Kernel | None


@dataclass(frozen=True, eq=False)
class Kernel:
    """Share of the light that goes to one side up to a distance, as a texture over the distance's root.

    reach_mm : distance of the last entry
    """

    texture: Texture
    reach_mm: float


class ScreenSpace(Technique):
    """Spreads the light of all visible skin in the image, and adds the light that does not [Jimenez2015]."""

    sources = ("Jimenez2015",)
    shade_constants = (("SPLIT", 1),)
    pixel_bytes = 64
    apart_bytes = 48

    def make(self, memo: Memo, device: Device, settings: Settings, profile: GaussianSum) -> Apart:
        """Return space for a picture, and the profile's kernel."""
        apart = memo.keep(make_apart, device, settings.size)
        return replace(apart, kernel=memo.keep(make_kernel, device, profile))

    def make_apart(self, memo: Memo, device: Device, settings: Settings) -> Apart:
        """Return the same space again, without one for the whole picture."""
        return memo.keep(make_apart, device, settings.size, False, of="outputs")

    def apart(self, own: TechniqueResources | None) -> Texture | None:
        """Return layers for the light below the skin and how it leaves."""
        return own.layers if isinstance(own, Apart) else None

    def finish(self, graph: Graph, inputs: Inputs, radiance: Texture) -> Texture:
        """Return the picture with the light below the skin spread over it."""
        own = inputs.resources.technique
        assert isinstance(own, Apart) and own.kernel is not None
        return draw(graph, own, own.kernel, inputs.window, radiance)

    def spread(self, graph: Graph, inputs: Inputs) -> tuple[TextureOrView, TextureOrView]:
        """Spread what the shading kept apart along rows and columns."""
        apart, own = inputs.resources.spread, inputs.resources.technique
        assert isinstance(apart, Apart) and isinstance(own, Apart) and own.kernel is not None
        spread(graph, apart, own.kernel, inputs.window)
        return apart.below, apart.leaving


TECHNIQUE = ScreenSpace()


def make_apart(device: Device, size: tuple[int, int], whole: bool = True) -> Apart:
    """Return space for a picture of size (width, height), without a kernel.

    whole : whether the whole picture is needed
    """
    layers = make_texture(device, size, "rgba32float", layers=2)
    below, leaving = (view_of(layers, layer=k) for k in range(2))
    between = make_texture(device, size, "rgba32float")
    result = make_texture(device, size, "rgba32float") if whole else None
    return Apart(layers, below, leaving, between, result, None)


def make_kernel(device: Device, profile: GaussianSum) -> Kernel:
    """Return the profile's kernel as the shader reads it."""
    shares, reach_mm = kernel_table(preintegrate(profile))
    return Kernel(texture_from(device, shares, "rgba32float"), reach_mm)


def draw(graph: Recorder, apart: Apart, kernel: Kernel, window: Window, over: Texture) -> Texture:
    """Declare the passes that spread light over a picture; return the picture, a texture of `apart`.

    window : what the picture shows of a plane before the eye
    over : the shaded picture without the light below the skin
    """
    assert apart.result is not None
    spread(graph, apart, kernel, window)
    bound: MutableBindings = {
        "over": over,
        "below": apart.below,
        "leaving": apart.leaving,
        "image": apart.result,
    }
    shader = program(graph.device, FOLDER / "resurface.wgsl")
    graph.compute("screen space", shader, bound, over.size[:2])
    return apart.result


def spread(graph: Recorder, apart: Apart, kernel: Kernel, window: Window) -> None:
    """Declare the passes that spread the light of `apart` over the picture.

    window : what the picture shows of a plane before the eye
    """
    device, size = graph.device, apart.between.size[:2]
    along = [program(device, FOLDER / "screen_space.wgsl", (("AXIS", axis),)) for axis in (0, 1)]
    record = along[0].record("Spread", half=window.half, shift=window.shift, reach=kernel.reach_mm)
    passes: tuple[tuple[TextureOrView, TextureOrView], ...] = (
        (apart.below, apart.between),
        (apart.between, apart.below),
    )
    for shader, (source, blurred) in zip(along, passes, strict=True):
        bound: MutableBindings = {
            "spread": record,
            "source": source,
            "kernel": kernel.texture,
            "blurred": blurred,
        }
        graph.compute("screen space", shader, bound, size)


def kernel_table(kernel: SeparableKernel) -> tuple[NDArray[np.float64], float]:
    """(1, n, 4) shares by the root of the distance over the reach, and the reach [mm]."""
    reach = _reach(kernel)
    shares = kernel.one_side(reach * np.linspace(0.0, 1.0, _ENTRIES) ** 2)
    shares *= 0.5 / shares[-1]  # light that would go farther stays within reach
    return np.concatenate([shares, np.zeros((_ENTRIES, 1))], axis=1)[None], reach


def _reach(kernel: SeparableKernel) -> float:
    """Distance beyond which no channel has more than `_TAIL` of the light [mm]."""
    distance = np.geomspace(_FINEST_MM, _WIDEST_MM, 4096)
    beyond = (0.5 - kernel.one_side(distance)).max(axis=1) > _TAIL
    return float(distance[min(int(beyond.sum()), len(distance) - 1)])
