"""What a renderer hands out: an image on the device, and what it took."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import Device, download
from dermis.gpu.device import gpu_failures


@dataclass(frozen=True)
class Rendered:
    """An image, still on the device, until its renderer draws the next one.

    gpu_ms : device time of each stage and "total" [ms]; None when the adapter has no timestamps
    frame_ms : from recording the frame to its end [ms]
    setup_ms : what was made for this scene before: loading to the device, atlas, shaders [ms]
    gaussians : levels of the profile
    unscattered : share of the skin's triangles that the atlas cannot hold; they are lit directly
    suns : sun-like peaks of the environment that shine as lights of their own
    """

    device: Device
    picture: Any
    gpu_ms: dict[str, float] | None
    frame_ms: float
    setup_ms: float
    gaussians: int
    unscattered: float
    suns: int
    is_current: Callable[[], bool]

    def linear(self) -> NDArray[np.float32]:
        """(h, w, 3) linear Rec. 709 after bloom and exposure, float32."""
        return np.ascontiguousarray(self._read(self.picture.exposed)[..., :3])

    def srgb8(self) -> NDArray[np.uint8]:
        """(h, w, 3) sRGB bytes, with the tone curve, encoded on the device."""
        return np.ascontiguousarray(self._read(self.picture.bytes)[..., :3])

    def _read(self, texture: Any) -> NDArray[Any]:
        if not self.is_current():
            raise RuntimeError(
                "a newer frame has taken this image's place: read each before drawing the next"
            )
        with gpu_failures(self.device):
            return download(self.device, texture)
