"""Rendered frame: a picture on the device, and its timings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.renamed import renamed_attribute
from dermis.base.summary import ShortRepr
from dermis.frame.features import outputs as output_features
from dermis.frame.features.outputs.output_images import OutputArray
from dermis.frame.features.outputs.readback import Readback
from dermis.frame.features.post.meter import Meter, read_meter
from dermis.frame.features.post.picture import Picture
from dermis.gpu import Device, download
from dermis.scene.outputs import OUTPUTS
from dermis.scene.settings import Settings

T = TypeVar("T")
_MAX_BYTE_LEVEL = 255  # largest byte of a picture


@dataclass(eq=False)
class FrameTextures:
    """Device, textures and buffers of a frame; if the device is lost and opened again, all are replaced.

    meter : exposure meter, None for a fixed exposure
    outputs : resources of the outputs besides the picture, None if none are requested
    """

    device: Device
    picture: Picture
    meter: Meter | None
    outputs: output_features.Resources | None = None


@dataclass(frozen=True, repr=False)
class RenderedFrame(ShortRepr):
    """Picture on the device, valid until its renderer draws the next frame.

    textures : device, picture and outputs
    gpu_ms : device time of each timed stage, and "total" [ms]; None if stages were not timed
    frame_ms : time from recording the frame to its completion [ms]
    setup_ms : time before the frame for uploads, the atlas and shaders [ms]
    gaussians : number of Gaussians of the profile
    unscattered_fraction : number of skin triangles that lie outside the atlas, where no light scatters,
        divided by the number of all skin triangles [-]
    suns : number of lights that the environment adds
    settings : settings of the frame
    start_readback : function that starts the readback of a picture, see `features.outputs.readback`
    run_on_device : function that runs a job and returns the job's result; if the device of the frame was
        lost, it first draws the frame again
    is_current : function that tells whether the picture is still valid
    """

    textures: FrameTextures
    gpu_ms: dict[str, float] | None
    frame_ms: float
    setup_ms: float
    gaussians: int
    unscattered_fraction: float
    suns: int
    settings: Settings
    start_readback: Callable[[Picture, Settings | None], Readback]
    run_on_device: Callable[[Callable[[], Any]], Any]
    is_current: Callable[[], bool]
    clipped = renamed_attribute("clipped", "clipped_fraction")

    @property
    def picture(self) -> Picture:
        """Return the textures of the final picture: radiance, linear light after exposure, and sRGB bytes."""
        return self.textures.picture

    @property
    def exposure(self) -> float:
        """Return the factor from radiance to linear light in the picture, whether fixed or metered [-]."""
        if not isinstance(self.settings.exposure, str):
            return float(self.settings.exposure)
        return self._read(lambda frame: read_meter(frame.device, frame.meter) if frame.meter else 1.0)

    def linear(self) -> NDArray[np.float32]:
        """Return the (h, w, 3) linear Rec. 709 picture after bloom and exposure [-]."""
        return np.ascontiguousarray(self._download_exposed_picture()[..., :3])

    def srgb8(self) -> NDArray[np.uint8]:
        """Return the (h, w, 3) sRGB bytes of the picture after the tone curve."""
        return self._read_back()

    def rgba8(self) -> NDArray[np.uint8]:
        """Return (h, w, 4) sRGB bytes of a frame with background "none"; alpha is the coverage by the head.

        As in PNG files, colours are not multiplied by alpha.
        """
        return self._read_back(self.settings)

    def linear_rgba(self) -> NDArray[np.float32]:
        """Return (h, w, 4) linear floats of a frame with background "none", premultiplied by alpha."""
        return self._download_exposed_picture()

    def output(self, name: str) -> OutputArray:
        """Return an output of the frame, (h, w) or (h, w, channels) with row 0 at the top.

        Raises DermisError for an output that was not requested.
        """
        OUTPUTS[name]
        requested = self.textures.outputs.names if self.textures.outputs else ()
        if name not in requested:
            actual = f"the frame was drawn with {', '.join(requested) or 'none'}"
            refuse(f"output {name}", "a requested output", actual, f'Pass outputs=("{name}",) to draw')
        return self._read(lambda frame: _read_output(frame, name))

    def clipped_fraction(self) -> float:
        """Return the fraction of the head's pixels that are overexposed in any channel [-]."""
        levels = self._read(lambda frame: download(frame.device, frame.picture.bytes))
        head = levels[levels[..., 3] == _MAX_BYTE_LEVEL]
        return float((head[:, :3].max(axis=1) == _MAX_BYTE_LEVEL).mean()) if len(head) else 0.0

    def _download_exposed_picture(self) -> NDArray[np.float32]:
        return self._read(lambda frame: download(frame.device, frame.picture.exposed))

    def _read_back(self, alpha_settings: Settings | None = None) -> NDArray[Any]:
        return self._read(lambda frame: self.start_readback(frame.picture, alpha_settings).image())

    def _read(self, read_textures: Callable[[FrameTextures], T]) -> T:
        if not self.is_current():
            raise RuntimeError(
                "a newer frame has replaced this picture: read it before drawing the next frame"
            )
        result: T = self.run_on_device(lambda: read_textures(self.textures))
        return result


def _read_output(frame: FrameTextures, name: str) -> OutputArray:
    assert frame.outputs is not None
    images = frame.outputs.images_with_output(name)
    start, size = images.byte_range(name)
    raw = frame.device.handle.queue.read_buffer(images.buffer, start, size)
    return images.decode_output(name, np.frombuffer(raw, np.uint8).copy())
