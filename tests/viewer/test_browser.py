"""The viewer in a real browser: the head is there, turns, obeys the panel, and comes back after a loss."""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_hands import ADAPTER

SIZE = {"width": 400, "height": 480}
_CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
_QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
_PATIENCE_S = 25.0
_GET_IMAGE = (
    "() => { const i = document.querySelector('img'); return i && i.complete && i.naturalWidth === 400 }"
)

pytestmark = pytest.mark.skipif(_CHROMIUM is None, reason="there is no Chromium here")


@pytest.fixture(scope="module")
def url(head_file: Path) -> Iterator[str]:
    """Of a page that `dermis view --browser` serves."""
    pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
    words = ["view", str(head_file), "--browser", "--port", "0", "--size", "400x480", "--adapter", ADAPTER]
    command = [sys.executable, "-m", "dermis", *words, "--atlas", "128", "--samples", "1"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert server.stdout is not None
    yield server.stdout.readline().split()[0]
    server.terminate()
    _, errors = server.communicate(timeout=20)
    assert "Traceback" not in errors and "rror" not in errors, errors


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    sync = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with sync.sync_playwright() as play:
        one = play.chromium.launch(executable_path=_CHROMIUM, args=list(_QUIET))
        yield one
        one.close()


@pytest.fixture
def page(browser: Any, url: str) -> Iterator[Any]:
    """The page, showing something; an error in its console fails the test."""
    one = browser.new_page(viewport=SIZE)
    errors: list[str] = []
    one.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    one.on("pageerror", lambda error: errors.append(str(error)))
    one.goto(url)
    one.wait_for_function(_GET_IMAGE, timeout=1000 * _PATIENCE_S)
    yield one
    one.close()
    assert errors == []


def pixels(page: Any) -> NDArray[np.int64]:
    from PIL import Image

    return np.array(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(np.int64)


def still(page: Any, judge: Callable[[NDArray[np.int64]], bool]) -> NDArray[np.int64]:
    """The first picture that satisfies `judge` and does not change any more."""
    last, end = pixels(page), time.monotonic() + _PATIENCE_S
    while time.monotonic() < end:
        time.sleep(0.4)
        found = pixels(page)
        if judge(found) and np.abs(found - last).max() == 0:
            return found
        last = found
    raise AssertionError("the page never shows that")


def head(image: NDArray[np.int64]) -> NDArray[np.int64]:
    """The part that the panel does not cover."""
    return image[40:430, 205:]


def shows_head(image: NDArray[np.int64]) -> bool:
    return bool(head(image)[150:250, :60].mean() > 15.0 and head(image)[:20, -20:].mean() < 3.0)


def differs_from(before: NDArray[np.int64]) -> Callable[[NDArray[np.int64]], bool]:
    return lambda image: not looks_like(before)(image)


def looks_like(before: NDArray[np.int64]) -> Callable[[NDArray[np.int64]], bool]:
    """Whether an image is the same but for its encoding: a new frame comes as JPEG, then as PNG."""
    return lambda image: bool(np.abs(head(image) - head(before)).mean() < 0.5)


def drag(page: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*end, steps=8)
    page.mouse.up()


def test_the_page_shows_the_head_and_a_drag_turns_it(page: Any) -> None:
    before = still(page, shows_head)
    drag(page, (320, 240), (230, 240))
    still(page, differs_from(before))


def test_the_panel_alters_the_picture(page: Any) -> None:
    before = still(page, shows_head)
    page.mouse.click(30, 43)  # the list of views, at the top of the panel
    page.wait_for_timeout(400)
    page.mouse.click(30, 126)  # irradiance
    still(page, differs_from(before))
    page.mouse.click(30, 43)
    page.wait_for_timeout(400)
    page.mouse.click(30, 69)
    still(page, looks_like(before))


def test_a_lost_connection_comes_back_by_itself(page: Any) -> None:
    before = still(page, shows_head)
    page.evaluate("window.websocket.close()")
    page.wait_for_function("() => window.websocket.readyState === WebSocket.OPEN", timeout=20000)
    page.wait_for_timeout(500)  # until the server has noticed that the other connection is gone
    drag(page, (320, 240), (260, 200))
    still(page, differs_from(before))


def test_a_reloaded_page_shows_the_head_again(page: Any) -> None:
    still(page, shows_head)
    page.reload()
    page.wait_for_function(_GET_IMAGE, timeout=1000 * _PATIENCE_S)
    still(page, shows_head)


def test_a_second_page_watches_and_does_not_touch(page: Any, browser: Any, url: str) -> None:
    before = still(page, shows_head)
    watcher = browser.new_page(viewport=SIZE)
    watcher.goto(url)
    watcher.wait_for_function(_GET_IMAGE, timeout=1000 * _PATIENCE_S)
    assert "passive" in watcher.inner_text("#status")
    drag(watcher, (320, 240), (230, 240))
    watcher.wait_for_timeout(700)
    assert looks_like(before)(pixels(page))
    drag(page, (320, 240), (230, 240))
    still(watcher, differs_from(before))
    page.close()
    watcher.wait_for_function("() => !document.querySelector('#status').innerText.includes('passive')")
    watcher.close()
