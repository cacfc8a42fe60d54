"""The renderer: a device with all that it keeps from frame to frame."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import Frame, open_device
from dermis.gpu.device import gpu_failures
from dermis.rendering.frame import Stages, draw_frame
from dermis.rendering.inputs import Inputs
from dermis.rendering.preparation import Preparation
from dermis.rendering.rendered import Rendered
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

_WARMING_FRAMES = 100


class Renderer:
    """Renders scenes on one device; what does not change between two frames is not made again.

    adapter : "auto", "cpu" or part of an adapter's name
    """

    def __init__(self, adapter: str = "auto") -> None:
        started = time.perf_counter()
        self.device = open_device(adapter)
        with gpu_failures(self.device):
            self.stages = Stages(self.device)
        self._preparation = Preparation(self.device, self.stages)
        self.prepare, self.forget = self._preparation.inputs, self._preparation.forget_all
        self._frames = 0
        self._opening_ms = 1e3 * (time.perf_counter() - started)

    def draw(
        self,
        scene: Scene,
        settings: Settings | None = None,
        *,
        keep_shadows: bool = True,
        timed: bool = True,
    ) -> Rendered:
        """Render one frame and leave the image on the device.

        keep_shadows : False draws the shadow maps again even when no light moved
        timed : False returns as soon as the frame is submitted, so that the device never waits for Python

        Raises DermisError for sizes over the device's limits and when the device fails.
        """
        settings = settings or Settings()
        with gpu_failures(self.device):
            started = time.perf_counter()
            inputs = self.prepare(scene, settings)
            ready = time.perf_counter()
            frame = Frame(self.device)
            self._submit(frame, inputs, keep_shadows)
            if timed:
                frame.wait()
            done = time.perf_counter()
            times = frame.stage_ms() if timed else None
        setup_ms = 1e3 * (ready - started) + self._opening_ms
        self._opening_ms = 0.0
        self._frames += 1
        number, frame_ms = self._frames, 1e3 * (done - ready)
        return Rendered(
            self.device,
            inputs.picture,
            times,
            frame_ms,
            setup_ms,
            inputs.gaussians,
            inputs.head.unscattered,
            inputs.suns,
            is_current=lambda: number == self._frames,
        )

    def draw_warm(
        self, scene: Scene, settings: Settings | None = None, *, keep_shadows: bool = False
    ) -> Rendered:
        """A frame timed on a device at work: a GPU that was idle runs at a fraction of its clock rate."""
        rendered = self.draw(scene, settings, keep_shadows=keep_shadows)
        if self.device.adapter.kind == "CPU":
            return rendered
        for _ in range(_WARMING_FRAMES):
            self.draw(scene, settings, keep_shadows=keep_shadows, timed=False)
        self.device.wait()
        return self.draw(scene, settings, keep_shadows=keep_shadows)

    def _submit(self, frame: Frame, inputs: Inputs, keep_shadows: bool) -> None:
        """Record and submit; after a failure nobody knows what the shadow maps hold."""
        if not keep_shadows:
            inputs.shadow_maps.drawn = b""
        try:
            draw_frame(frame, self.stages, inputs)
            frame.submit()
        except Exception:
            inputs.shadow_maps.drawn = b""
            raise

    def render(self, scene: Scene, **settings: Any) -> NDArray[np.float32]:
        """(h, w, 3) float32 linear Rec. 709 image; `settings` are those of `Settings`."""
        return self.draw(scene, Settings(**settings)).linear()


def render(scene: Scene, adapter: str = "auto", **settings: Any) -> NDArray[np.float32]:
    """(h, w, 3) float32 linear Rec. 709 image of a scene; for many images keep a `Renderer`.

    settings : those of `Settings`: size, atlas, samples, technique, exposure, ...
    """
    return Renderer(adapter).render(scene, **settings)
