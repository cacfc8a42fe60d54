"""Input driver of a page in Chromium: its picture, mouse drags, and fingers."""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SIZE = {"width": 400, "height": 480}
PATIENCE_S = 120.0
_QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
_GET_IMAGE = "() => { const i = document.querySelector('img'); return i && i.complete && i.naturalWidth > 0 }"
Place = tuple[float, float]


@contextmanager
def opened_browser() -> Iterator[Any]:
    """Yield Chromium without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        one = play.chromium.launch(executable_path=CHROMIUM, args=list(_QUIET))
        yield one
        one.close()


@contextmanager
def visited(browser: Any, url: str, expected: str = "no error", **given: Any) -> Iterator[Any]:
    """Yield the page when it shows something; unexpected errors in its console fail the test."""
    one = browser.new_page(**{"viewport": SIZE} | given)
    errors: list[str] = []
    one.set_default_timeout(1000 * PATIENCE_S)
    one.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    one.on("pageerror", lambda error: errors.append(str(error)))
    listen(one)
    one.goto(url)
    wait_for_picture(one)
    yield one
    one.close()
    assert [text for text in errors if expected not in text] == []


def wait_for_picture(page: Any) -> None:
    page.wait_for_function(_GET_IMAGE, timeout=1000 * PATIENCE_S)


def wait(page: Any, reached: Callable[[], Any]) -> bool:
    """Return whether a condition becomes true, while the page continues."""
    end = time.monotonic() + PATIENCE_S
    while not reached() and time.monotonic() < end:
        page.wait_for_timeout(50)
    return bool(reached())


def listen(page: Any) -> None:
    """Record the kinds of frames that the page receives; call it before the page is opened."""
    page.frames_come = []

    def hear(message: Any) -> None:
        if isinstance(message, str) and '"framebufferdata"' in message:
            page.frames_come.append("image/png" if "image/png" in message else "image/jpeg")

    page.on("websocket", lambda socket: socket.on("framereceived", hear))


def is_final(page: Any) -> bool:
    """Return whether the last frame is lossless, which is sent when nothing changes any more."""
    return bool(page.frames_come) and page.frames_come[-1] == "image/png"


def pixels(page: Any) -> NDArray[np.int64]:
    from PIL import Image

    return np.array(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(np.int64)


def still(page: Any, judge: Callable[[NDArray[np.int64]], bool]) -> NDArray[np.int64]:
    """Return the first picture that satisfies `judge` and does not change any more."""
    last, end = pixels(page), time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        page.wait_for_timeout(400)
        found = pixels(page)
        if is_final(page) and judge(found) and np.abs(found - last).max() == 0:
            return found
        last = found
    raise AssertionError("the page never shows that")


def head(image: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the part that the panel does not cover."""
    return image[40:430, 205:]


def shows_head(image: NDArray[np.int64]) -> bool:
    return bool(head(image)[150:250, :60].mean() > 15.0 and head(image)[:20, -20:].mean() < 3.0)


def differs_from(before: NDArray[np.int64]) -> Callable[[NDArray[np.int64]], bool]:
    return lambda image: not looks_like(before)(image)


def looks_like(before: NDArray[np.int64]) -> Callable[[NDArray[np.int64]], bool]:
    """Return whether two images differ only by their encoding: a new frame is sent as JPEG, then as PNG."""
    return lambda image: bool(np.abs(head(image) - head(before)).mean() < 0.5)


def drag(page: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*end, steps=8)
    page.mouse.up()


def touch(page: Any, *moments: Sequence[Place]) -> None:
    """Move fingers through positions, each finger by its index in the list, and lift them."""
    session = page.context.new_cdp_session(page)
    for k, places in enumerate(moments):
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(places)]
        kind = "touchStart" if k == 0 or len(places) > len(moments[k - 1]) else "touchMove"
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        page.wait_for_timeout(60)
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    session.detach()


def height(image: NDArray[np.int64]) -> int:
    """Return the number of rows of the picture that show the head."""
    return int((head(image).max(axis=(1, 2)) > 25).sum())
