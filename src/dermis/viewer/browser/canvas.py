"""rendercanvas' HTTP canvas with encoders beside its loop, and a first frame for every page that comes."""

from __future__ import annotations

import asyncio
import io
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rendercanvas.http import HttpRenderCanvas

_QUALITY = 88
_LOSSLESS_AFTER_S = 0.3
_ENCODERS = 2  # frames that become bytes at once, while the next one is drawn


class PageCanvas(HttpRenderCanvas):  # type: ignore[misc]
    """A canvas that pages show; a page too slow for all frames gets the newest when it is ready."""

    def __init__(self, **given: Any) -> None:
        self._encoders = ThreadPoolExecutor(_ENCODERS, "encoder")
        self._encoding = 0  # frames on their way to the pages, but for lossless ones
        self._drawn = self._kept = 0  # frames by their number: the one drawn and the one kept last
        self._lossless = 0  # of the lossless frame that nothing has outdated
        super().__init__(**given)

    def _on_event(self, event: dict[str, Any], id: int) -> None:
        kind = str(event.get("type"))
        if kind == "_framefeedback":  # a frame that was not sent cannot have been shown
            event["index"] = min(event["index"], self._frame_info_per_client[id]["sent"])
        super()._on_event(event, id)
        acted = kind == "_clients_change" or (kind[:1] != "_" and id == self._active_client)
        if acted and self._frame_info_per_client:
            # At the next tick, not at the one after the tick that hears it; and a page that was loaded again
            # or resized would wait for some motion.
            self.request_draw()
        elif kind == "_framefeedback" and not self._draw_requested:
            self._send_last_frame_to_ready_clients()  # which may have come while this page was not ready

    def _maybe_draw(self) -> None:
        """Draw when the page is ready for one more frame than those on their way to it."""
        known = self._frame_info_per_client.get(self._active_client)
        if known and known["sent"] - known["confirmed"] + self._encoding >= self._max_buffered_frames:
            self._pending_maybe_draw = False  # it comes again with what is encoded or confirmed next
            self._send_last_frame_to_ready_clients()
        else:
            super()._maybe_draw()

    def _encode_frame(self, array: NDArray[np.uint8], is_lossless_redraw: bool = False) -> None:
        """Have bytes made of a frame: JPEG while things move, then PNG."""
        self._cancel_lossless_draw()
        self._drawn += 1
        if is_lossless_redraw:
            self._lossless = self._drawn
        else:
            self._encoding += 1
            self._schedule_lossless_draw(array, _LOSSLESS_AFTER_S)
        work = partial(encoded, array, lossless=is_lossless_redraw)
        made = asyncio.get_running_loop().run_in_executor(self._encoders, work)
        made.add_done_callback(partial(self._keep, self._drawn, is_lossless_redraw))

    def _cancel_lossless_draw(self) -> None:
        """Before another frame, which outdates a lossless one that is being encoded as well."""
        self._lossless = 0
        super()._cancel_lossless_draw()

    def _keep(self, number: int, lossless: bool, made: asyncio.Future[bytes]) -> None:
        """Keep a frame for the pages, unless a newer one is there already."""
        self._encoding -= not lossless
        if self._is_closed:
            return
        self._schedule_maybe_draw()
        data = made.result()
        if number < self._kept or (lossless and number != self._lossless):
            return
        self._kept = number
        message = {
            "type": "framebufferdata",
            "nbuffers": 1,
            "mimetype": "image/png" if lossless else "image/jpeg",
            "timestamp": time.time(),
            "index": 0,
        }
        self._last_frame = message, [data]
        self._ref_index += 1
        self._send_last_frame_to_ready_clients()


def encoded(array: NDArray[np.uint8], *, lossless: bool) -> bytes:
    """An (h, w, 4) image as PNG or JPEG, without its alpha."""
    from PIL import Image

    height, width = array.shape[:2]
    # Four bytes a pixel are Pillow's own, so that nothing is copied for JPEG.
    image = Image.frombuffer("RGBX", (width, height), np.ascontiguousarray(array), "raw", "RGBX", 0, 1)
    buffer = io.BytesIO()
    if lossless:
        image.convert("RGB").save(buffer, "PNG", compress_level=1)
    else:
        image.save(buffer, "JPEG", quality=_QUALITY, subsampling=0)
    return buffer.getvalue()
