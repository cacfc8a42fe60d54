"""The result of a frame: an image on the device, and its timings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.summary import Summarised
from dermis.frame.features import outputs as output_features
from dermis.frame.features.outputs.planes import PlaneArray
from dermis.frame.features.outputs.readback import Readback
from dermis.frame.features.post.meter import Meter, read_meter
from dermis.frame.features.post.picture import Picture
from dermis.gpu import Device, download
from dermis.scene.outputs import OUTPUTS
from dermis.scene.settings import Settings

T = TypeVar("T")
_MOST = 255


@dataclass(eq=False)
class Shown:
    """Where a frame is; it moves when its device is lost and the frame drawn again.

    meter : what metered the exposure, None where it was given
    outputs : what was asked besides the picture, None for nothing
    """

    device: Device
    picture: Picture
    meter: Meter | None
    outputs: output_features.Resources | None = None


@dataclass(frozen=True, repr=False)
class Rendered(Summarised):
    """An image on the device, valid until its renderer draws the next one.

    gpu_ms : device time of each stage that was timed, and "total" [ms]; None without timestamps
    frame_ms : from recording the frame to its end [ms]
    setup_ms : what the scene needed before its frame: loading to the device, atlas, shaders [ms]
    gaussians : levels of the profile
    unscattered : share of the skin's triangles that the atlas cannot hold; they are lit directly
    suns : sun-like peaks of the environment that shine as lights of their own
    settings : what it was drawn with
    leave : starts reading the picture back, as `pack.draw` does
    kept : does a job for which the frame has to be on a device, and returns what that returns
    """

    shown: Shown
    gpu_ms: dict[str, float] | None
    frame_ms: float
    setup_ms: float
    gaussians: int
    unscattered: float
    suns: int
    settings: Settings
    leave: Callable[..., Readback]
    kept: Callable[[Callable[[], Any]], Any]
    is_current: Callable[[], bool]

    @property
    def picture(self) -> Picture:
        """Its textures."""
        return self.shown.picture

    @property
    def exposure(self) -> float:
        """Factor from radiance to the picture, metered or given."""
        if self.settings.exposure != "auto":
            return float(self.settings.exposure)
        return self._read(lambda at: read_meter(at.device, at.meter) if at.meter else 1.0)

    def linear(self) -> NDArray[np.float32]:
        """(h, w, 3) linear Rec. 709 after bloom and exposure, float32."""
        return np.ascontiguousarray(self._exposed()[..., :3])

    def srgb8(self) -> NDArray[np.uint8]:
        """(h, w, 3) sRGB bytes, with the tone curve, encoded on the device."""
        return self._leave()

    def rgba8(self) -> NDArray[np.uint8]:
        """(h, w, 4) sRGB bytes over the background "none": alpha is what the head covers of each pixel.

        Colours are not multiplied by it, as PNG has it.
        """
        return self._leave(alpha=self.settings)

    def linear_rgba(self) -> NDArray[np.float32]:
        """(h, w, 4) float32 over the background "none", multiplied by alpha as OpenEXR has it."""
        return self._exposed()

    def output(self, name: str) -> PlaneArray:
        """(h, w) or (h, w, channels) of an output that was asked of the frame, row 0 at the top.

        Raises DermisError for one that was not asked.
        """
        OUTPUTS[name]
        asked = self.shown.outputs.names if self.shown.outputs else ()
        if name not in asked:
            came = f"the frame was drawn with {', '.join(asked) or 'none'}"
            refuse(f"output {name}", "one that was asked", came, f'Pass outputs=("{name}",) to draw')
        return self._read(lambda at: _read_output(at, name))

    def clipped(self) -> float:
        """Share of the head's pixels with a part that is brighter than the picture's bytes can show."""
        levels = self._read(lambda at: download(at.device, at.picture.bytes))
        head = levels[levels[..., 3] == _MOST]
        return float((head[:, :3].max(axis=1) == _MOST).mean()) if len(head) else 0.0

    def _exposed(self) -> NDArray[np.float32]:
        return self._read(lambda at: download(at.device, at.picture.exposed))

    def _leave(self, **how: Any) -> NDArray[Any]:
        return self._read(lambda at: self.leave(at.picture, **how).image())

    def _read(self, read: Callable[[Shown], T]) -> T:
        if not self.is_current():
            raise RuntimeError(
                "a newer frame has taken this image's place: read each before drawing the next"
            )
        found: T = self.kept(lambda: read(self.shown))
        return found


def _read_output(at: Shown, name: str) -> PlaneArray:
    """One of the outputs of a frame; waits for it."""
    assert at.outputs is not None
    planes = at.outputs.planes_of(name)
    start, size = planes.place(name)
    raw = at.device.handle.queue.read_buffer(planes.buffer, start, size)
    return planes.array(name, np.frombuffer(raw, np.uint8).copy())
