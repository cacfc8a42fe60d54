"""From radiance to what a file or a display takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.passes import SHARED_SHADERS, STAGES
from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.scene.settings import Settings

_TONES = ("none", "filmic", "neutral")  # numbered as in tone.wgsl


@dataclass(frozen=True)
class Picture:
    """Radiance as shaded; exposed and linear; exposed, sRGB, in bytes."""

    radiance: Any
    exposed: Any
    bytes: Any
    size: tuple[int, int]


class Post:
    """Exposes, applies the tone curve and encodes."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._program = ComputeProgram(device, STAGES / "post.wgsl", (SHARED_SHADERS,))

    def make_picture(self, size: tuple[int, int]) -> Picture:
        """Space for an image of size (width, height)."""
        radiance, exposed = (make_texture(self._device, size, "rgba32float") for _ in range(2))
        return Picture(radiance, exposed, make_texture(self._device, size, "rgba8uint"), size)

    def draw(self, frame: Frame, radiance: Any, picture: Picture, settings: Settings) -> None:
        """Fill the picture's linear and byte images."""
        record = self._program.record(
            "Post",
            exposure=settings.exposure,
            tone=_TONES.index(settings.tone),
            encoded=int(settings.gamma == "right"),
        )
        bound = {
            "settings": record,
            "image": radiance,
            "exposed": picture.exposed,
            "bytes": picture.bytes,
        }
        frame.compute("post", self._program, bound, picture.size)
