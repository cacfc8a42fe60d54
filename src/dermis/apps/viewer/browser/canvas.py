"""Canvas for web pages, based on rendercanvas, with image encoding in threads."""

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

from dermis.apps.viewer.session import HEAD_FILE_SUFFIXES

_JPEG_QUALITY = 88
_LOSSLESS_FRAME_DELAY_S = 0.3
_UPLOAD_TICKET_BYTES = 18
_MAX_ENCODERS = 2  # frames encoded at the same time while the next one is rendered


class PageCanvas(HttpRenderCanvas):  # type: ignore[misc]
    """Canvas displayed by web pages; a slow page skips frames, so that it always gets the newest frame."""

    def __init__(self, **kwargs: object) -> None:
        self._encoders = ThreadPoolExecutor(_MAX_ENCODERS, "encoder")
        self._encoding_count = 0  # number of JPEG frames being encoded
        self._drawn_number = self._sent_number = 0  # numbers of the last drawn and of the last sent frame
        self._lossless_number = 0  # number of the current lossless frame, 0 after a newer frame
        self._ticket_holder = 0  # id of the page that received the ticket
        self.ticket = ""  # upload ticket of the page that has control
        self.on_file: Callable[[Path, str], None] | None = None  # handler of uploads, set by the viewer
        self._startup_message: dict[str, object] | None = None  # shown by pages before the first frame
        super().__init__(**kwargs)

    def send_progress(self, stage_name: str, stage_number: int, stage_count: int) -> None:
        """Send the progress of the preparation to all pages; they display it until the first picture.

        stage_name : name of the stage, such as "compiling shaders"
        stage_number : position of the stage, counted from 1
        stage_count : number of stages
        """
        self._broadcast({"type": "stage", "text": stage_name, "number": stage_number, "total": stage_count})

    def send_failure(self, failure_text: str) -> None:
        """Send an error message to all pages; they display it instead of a picture."""
        self._broadcast({"type": "failure", "text": failure_text})

    def _broadcast(self, message: dict[str, object]) -> None:
        self._startup_message = message
        asgi.send_all(message)

    def request_file(self) -> None:
        """Ask the page that controls the viewer to let the user choose a file to upload."""
        asgi.send_to({"type": "choose", "kinds": ",".join(HEAD_FILE_SUFFIXES)}, [], self._active_client)

    def _rc_close(self) -> None:
        if not self._is_closed:  # garbage collection of an old canvas must not close the pages of a newer one
            super()._rc_close()

    def _update_active_states(self) -> None:
        super()._update_active_states()
        if self._active_client != self._ticket_holder:
            self.ticket, self._ticket_holder = (
                secrets.token_urlsafe(_UPLOAD_TICKET_BYTES),
                self._active_client,
            )
            asgi.send_to({"type": "ticket", "value": self.ticket}, [], self._active_client)
        if self._startup_message and not self._sent_number:
            asgi.send_all(self._startup_message)

    def offer_download(self, file_name: str, file_content: bytes) -> None:
        """Send a file to the page that controls the viewer, which offers the file as a download."""
        asgi.send_to(
            {"type": "download", "name": file_name, "nbuffers": 1}, [file_content], self._active_client
        )

    def _on_event(self, event: dict[str, Any], id: int) -> None:
        kind = str(event.get("type"))
        if kind == "_framefeedback":  # a page cannot have displayed a frame that was not sent
            event["index"] = min(event["index"], self._frame_info_per_client[id]["sent"])
        super()._on_event(event, id)
        is_input = kind == "_clients_change" or (kind[:1] != "_" and id == self._active_client)
        if is_input and self._frame_info_per_client:
            # rendercanvas would draw one tick later, and after a reload or resize only when something moves.
            self.request_draw()
        elif kind == "_framefeedback" and not self._draw_requested:
            self._send_last_frame_to_ready_clients()  # it was encoded while this page was not ready

    def _maybe_draw(self) -> None:
        """Draw a frame, unless too many frames are being encoded or await the page's confirmation."""
        info = self._frame_info_per_client.get(self._active_client)
        if info and info["sent"] - info["confirmed"] + self._encoding_count >= self._max_buffered_frames:
            self._pending_maybe_draw = False  # retried after the next frame is encoded or confirmed
            self._send_last_frame_to_ready_clients()
        else:
            super()._maybe_draw()

    def _encode_frame(self, pixels: NDArray[np.uint8], is_lossless_redraw: bool = False) -> None:
        """Encode a frame in a thread, and send the result to the pages.

        pixels : (h, w, 4) image of the frame
        is_lossless_redraw : True encodes the frame as PNG, because the picture has stopped changing; False
            encodes it as JPEG
        """
        self._cancel_lossless_draw()
        self._drawn_number += 1
        if is_lossless_redraw:
            self._lossless_number = self._drawn_number
        else:
            self._encoding_count += 1
            self._schedule_lossless_draw(pixels, _LOSSLESS_FRAME_DELAY_S)
        task = partial(encode_image, pixels, is_lossless=is_lossless_redraw)
        future = asyncio.get_running_loop().run_in_executor(self._encoders, task)
        future.add_done_callback(partial(self._send_frame, self._drawn_number, is_lossless_redraw))

    def _cancel_lossless_draw(self) -> None:
        """Cancel the lossless redraw of the last frame, even after its encoding has started."""
        self._lossless_number = 0
        super()._cancel_lossless_draw()

    def _send_frame(self, frame_number: int, is_lossless: bool, encoded_frame: asyncio.Future[bytes]) -> None:
        """Send an encoded frame to all pages, unless a newer frame has already been sent.

        frame_number : number of the frame, in the order of drawing
        is_lossless : whether the frame is encoded as PNG
        encoded_frame : result of `encode_image`
        """
        self._encoding_count -= not is_lossless
        if self._is_closed:
            return
        self._schedule_maybe_draw()
        data = encoded_frame.result()
        if frame_number < self._sent_number or (is_lossless and frame_number != self._lossless_number):
            return
        self._sent_number = frame_number
        message = {
            "type": "framebufferdata",
            "nbuffers": 1,
            "mimetype": "image/png" if is_lossless else "image/jpeg",
            "timestamp": time.time(),
            "index": 0,
        }
        self._last_frame = message, [data]
        self._ref_index += 1
        self._send_last_frame_to_ready_clients()


def encode_image(pixels: NDArray[np.uint8], *, is_lossless: bool) -> bytes:
    """Encode an image (h, w, 4), without its alpha channel, as PNG (lossless) or JPEG."""
    from PIL import Image

    height, width = pixels.shape[:2]
    # RGBX is the internal layout of Pillow, so JPEG needs no copy.
    image = Image.frombuffer("RGBX", (width, height), np.ascontiguousarray(pixels), "raw", "RGBX", 0, 1)
    buffer = io.BytesIO()
    if is_lossless:
        image.convert("RGB").save(buffer, "PNG", compress_level=1)
    else:
        image.save(buffer, "JPEG", quality=_JPEG_QUALITY, subsampling=0)
    return buffer.getvalue()
