"""rendercanvas' HTTP canvas, with image encoding in threads and a first frame for every new page."""

from __future__ import annotations

import asyncio
import io
import secrets
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rendercanvas.http import HttpRenderCanvas, asgi

from dermis.apps.viewer.session import HEAD_FILES

_QUALITY = 88
_LOSSLESS_AFTER_S = 0.3
_TICKET_BYTES = 18
_ENCODERS = 2  # frames encoded at the same time, while the next one is drawn


class PageCanvas(HttpRenderCanvas):  # type: ignore[misc]
    """A canvas shown in web pages; a slow page skips frames and gets the newest when it is ready."""

    def __init__(self, **given: object) -> None:
        self._encoders = ThreadPoolExecutor(_ENCODERS, "encoder")
        self._encoding = 0  # lossy frames being encoded
        self._drawn = self._sent = 0  # numbers of the last frame drawn and of the last one sent
        self._lossless = 0  # number of the current lossless frame, 0 when a newer frame has replaced it
        self._ticket_holder = 0
        self.ticket = ""  # of the page that has control, for files that it sends
        self.on_file: Callable[[Path, str], None] | None = None  # takes them when there is a viewer
        self._said: dict[str, object] | None = None  # to pages that have nothing to show yet
        super().__init__(**given)

    def tell_stage(self, text: str, number: int, of: int) -> None:
        """Tell the pages what is prepared, and the stage's number, before there is a picture."""
        self._say({"type": "stage", "text": text, "number": number, "of": of})

    def tell_failure(self, text: str) -> None:
        """Tell the pages why there will be no picture."""
        self._say({"type": "failure", "text": text})

    def _say(self, message: dict[str, object]) -> None:
        self._said = message
        asgi.send_all(message)

    def ask_for_file(self) -> None:
        """Let the page that has control choose a file to send."""
        asgi.send_to({"type": "choose", "kinds": ",".join(HEAD_FILES)}, [], self._active_client)

    def _rc_close(self) -> None:
        if not self._is_closed:  # collected later, it would close the pages of a newer canvas
            super()._rc_close()

    def _update_active_states(self) -> None:
        super()._update_active_states()
        if self._active_client != self._ticket_holder:
            self.ticket, self._ticket_holder = secrets.token_urlsafe(_TICKET_BYTES), self._active_client
            asgi.send_to({"type": "ticket", "value": self.ticket}, [], self._active_client)
        if self._said and not self._sent:
            asgi.send_all(self._said)

    def offer(self, name: str, data: bytes) -> None:
        """Send a file to the page that has control, which offers it as a download."""
        asgi.send_to({"type": "download", "name": name, "nbuffers": 1}, [data], self._active_client)

    def _on_event(self, event: dict[str, Any], id: int) -> None:
        kind = str(event.get("type"))
        if kind == "_framefeedback":  # a frame that was not sent cannot have been shown
            event["index"] = min(event["index"], self._frame_info_per_client[id]["sent"])
        super()._on_event(event, id)
        acted = kind == "_clients_change" or (kind[:1] != "_" and id == self._active_client)
        if acted and self._frame_info_per_client:
            # rendercanvas would draw one tick later, and for a reloaded or resized page only on motion.
            self.request_draw()
        elif kind == "_framefeedback" and not self._draw_requested:
            self._send_last_frame_to_ready_clients()  # encoded while this page was not ready

    def _maybe_draw(self) -> None:
        """Draw unless too many frames are on their way to the page."""
        known = self._frame_info_per_client.get(self._active_client)
        if known and known["sent"] - known["confirmed"] + self._encoding >= self._max_buffered_frames:
            self._pending_maybe_draw = False  # tried again after the next frame is encoded or confirmed
            self._send_last_frame_to_ready_clients()
        else:
            super()._maybe_draw()

    def _encode_frame(self, array: NDArray[np.uint8], is_lossless_redraw: bool = False) -> None:
        """Encode a frame in a thread: JPEG while things move, then PNG."""
        self._cancel_lossless_draw()
        self._drawn += 1
        if is_lossless_redraw:
            self._lossless = self._drawn
        else:
            self._encoding += 1
            self._schedule_lossless_draw(array, _LOSSLESS_AFTER_S)
        work = partial(encoded, array, lossless=is_lossless_redraw)
        made = asyncio.get_running_loop().run_in_executor(self._encoders, work)
        made.add_done_callback(partial(self._send, self._drawn, is_lossless_redraw))

    def _cancel_lossless_draw(self) -> None:
        """Also discard a lossless frame that is still being encoded."""
        self._lossless = 0
        super()._cancel_lossless_draw()

    def _send(self, number: int, lossless: bool, made: asyncio.Future[bytes]) -> None:
        """Send an encoded frame to the pages, unless a newer one was sent already."""
        self._encoding -= not lossless
        if self._is_closed:
            return
        self._schedule_maybe_draw()
        data = made.result()
        if number < self._sent or (lossless and number != self._lossless):
            return
        self._sent = number
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
    """An (h, w, 4) image as PNG or JPEG, without alpha."""
    from PIL import Image

    height, width = array.shape[:2]
    # RGBX is Pillow's own layout, so JPEG needs no copy.
    image = Image.frombuffer("RGBX", (width, height), np.ascontiguousarray(array), "raw", "RGBX", 0, 1)
    buffer = io.BytesIO()
    if lossless:
        image.convert("RGB").save(buffer, "PNG", compress_level=1)
    else:
        image.save(buffer, "JPEG", quality=_QUALITY, subsampling=0)
    return buffer.getvalue()
