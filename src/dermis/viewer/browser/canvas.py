"""rendercanvas' HTTP canvas with quick encoders, and a first frame for every page that comes."""

from __future__ import annotations

import io
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rendercanvas.http import HttpRenderCanvas

_QUALITY = 88
_LOSSLESS_AFTER_S = 0.3
_NEEDS_FRAME = "_clients_change", "resize"


class PageCanvas(HttpRenderCanvas):  # type: ignore[misc]
    """A canvas that pages show; a page too slow for all frames gets the newest when it is ready."""

    def _on_event(self, event: dict[str, Any], id: int) -> None:
        if event.get("type") == "_framefeedback":  # a frame that was not sent cannot have been shown
            event["index"] = min(event["index"], self._frame_info_per_client[id]["sent"])
        super()._on_event(event, id)
        if event.get("type") in _NEEDS_FRAME and self._frame_info_per_client:
            self.request_draw()  # else a page that was loaded again or resized would wait for some motion

    def _encode_frame(self, array: NDArray[np.uint8], is_lossless_redraw: bool = False) -> None:
        """Keep a frame in bytes for the pages: JPEG while things move, then PNG."""
        self._cancel_lossless_draw()
        started = time.perf_counter()
        data = encoded(array, lossless=is_lossless_redraw)
        if not is_lossless_redraw:
            self._schedule_lossless_draw(array, _LOSSLESS_AFTER_S)
            self._stats["encoding_sum"] += time.perf_counter() - started
            self._stats["encoded_frames"] += 1
            self._stats["start_time"] = self._stats["start_time"] or time.time()
        message = {
            "type": "framebufferdata",
            "nbuffers": 1,
            "mimetype": "image/png" if is_lossless_redraw else "image/jpeg",
            "timestamp": time.time(),
            "index": 0,
        }
        self._last_frame = message, [data]
        self._ref_index += 1
        self._send_last_frame_to_ready_clients()


def encoded(array: NDArray[np.uint8], *, lossless: bool) -> bytes:
    """An (h, w, 4) image as PNG or JPEG."""
    from PIL import Image

    image, buffer = Image.fromarray(np.ascontiguousarray(array[..., :3])), io.BytesIO()
    if lossless:
        image.save(buffer, "PNG", compress_level=1)
    else:
        image.save(buffer, "JPEG", quality=_QUALITY, subsampling=0)
    return buffer.getvalue()
