"""Light that spreads below the skin over the picture itself, by a separable kernel [Jimenez2015]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.passes import STAGES
from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.gpu.textures import texture_from
from dermis.optics.fits.separable import SeparableKernel

_TAIL = 5e-4  # of the light that goes to one side: the kernel is followed until no channel has more beyond
_FINEST_MM, _WIDEST_MM = 0.01, 400.0  # where that distance is looked for
_ENTRIES = 256


@dataclass(frozen=True)
class Apart:
    """What shade keeps apart, and space for what comes of it.

    layers : light below the skin with its depth [mm]; the share of it that leaves towards the eye
    below, leaving : views of the two
    between : light spread along rows only
    result : the whole picture
    """

    layers: Any
    below: Any
    leaving: Any
    between: Any
    result: Any


@dataclass(frozen=True)
class Kernel:
    """Share of the light that goes up to a distance to one side, as a texture over its root.

    reach_mm : distance of the last entry
    """

    texture: Any
    reach_mm: float


@dataclass(frozen=True)
class ScreenSpread:
    """How the light of one picture spreads.

    half : tangents of the half angles of view
    """

    apart: Apart
    kernel: Kernel
    half: tuple[float, float]


class ScreenSpace:
    """Spreads the light of all skin in sight and joins it with what lies over it."""

    def __init__(self, device: Device) -> None:
        self._device = device
        path = STAGES / "screen_space.wgsl"
        self._along = [ComputeProgram(device, path, constants={"AXIS": axis}) for axis in (0, 1)]
        self._join = ComputeProgram(device, STAGES / "resurface.wgsl")

    def make_apart(self, size: tuple[int, int]) -> Apart:
        """Space for a picture of size (width, height)."""
        layers = make_texture(self._device, size, "rgba32float", layers=2)
        below, leaving = (
            layers.create_view(dimension="2d", base_array_layer=k, array_layer_count=1) for k in range(2)
        )
        between, result = (make_texture(self._device, size, "rgba32float") for _ in range(2))
        return Apart(layers, below, leaving, between, result)

    def make_kernel(self, kernel: SeparableKernel) -> Kernel:
        """The kernel as the shader reads it."""
        shares, reach_mm = kernel_table(kernel)
        return Kernel(texture_from(self._device, shares, "rgba32float"), reach_mm)

    def draw(self, frame: Frame, spread: ScreenSpread, over: Any) -> Any:
        """The picture, a texture of `spread.apart`.

        over : what shade has seen apart from the light below the skin
        """
        apart, kernel = spread.apart, spread.kernel
        size = over.size[:2]
        record = self._along[0].record("Spread", half=spread.half, reach=kernel.reach_mm)
        passes = ((apart.below, apart.between), (apart.between, apart.below))
        for program, (source, blurred) in zip(self._along, passes, strict=True):
            bound = {"spread": record, "source": source, "kernel": kernel.texture, "blurred": blurred}
            frame.compute("screen space", program, bound, size)
        bound = {"over": over, "below": apart.below, "leaving": apart.leaving, "image": apart.result}
        frame.compute("screen space", self._join, bound, size)
        return apart.result


def kernel_table(kernel: SeparableKernel) -> tuple[NDArray[np.float64], float]:
    """(1, n, 4) shares by the root of the distance over the reach, and the reach [mm]."""
    reach = _reach(kernel)
    shares = kernel.one_side(reach * np.linspace(0.0, 1.0, _ENTRIES) ** 2)
    shares *= 0.5 / shares[-1]  # what would go farther stays within reach
    return np.concatenate([shares, np.zeros((_ENTRIES, 1))], axis=1)[None], reach


def _reach(kernel: SeparableKernel) -> float:
    """Distance beyond which no channel has more than `_TAIL` of the light [mm]."""
    distance = np.geomspace(_FINEST_MM, _WIDEST_MM, 4096)
    beyond = (0.5 - kernel.one_side(distance)).max(axis=1) > _TAIL
    return float(distance[min(int(beyond.sum()), len(distance) - 1)])
