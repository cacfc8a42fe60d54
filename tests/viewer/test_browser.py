"""The viewer in a real browser: it shows the head, responds to input, and recovers from a lost connection."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import child_process
import numpy as np
import pytest
from chromium_input import (
    CHROMIUM,
    PATIENCE_S,
    SIZE,
    differs_from,
    drag,
    head,
    height,
    is_final,
    listen,
    looks_like,
    pixels,
    shows_head,
    still,
    touch,
    visited,
    wait,
    wait_for_picture,
)
from numpy.typing import NDArray
from offscreen_input import ADAPTER, InputDriver

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")


@pytest.fixture(scope="module")
def url(head_file: Path) -> Iterator[str]:
    """Yield the URL of a page served by `dermis view --browser --token`."""
    pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
    options = "--browser --token --port 0 --size 400x480 --atlas 128 --samples 1 --background #000000"
    command = [sys.executable, "-m", "dermis", "view", str(head_file), *options.split(), "--adapter", ADAPTER]
    pipe = subprocess.PIPE
    server = child_process.start(command, stdout=pipe, stderr=pipe, text=True)
    assert server.stdout is not None
    yield server.stdout.readline().split()[0]
    server.terminate()
    _, errors = server.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in errors and "rror" not in errors, errors


@pytest.fixture
def page(browser: Any, url: str) -> Iterator[Any]:
    with visited(browser, url) as one:
        assert wait(one, lambda: is_final(one))
        known = len(one.frames_come)
        one.keyboard.press("1")  # the portrait, wherever the test before left the camera
        assert wait(one, lambda: len(one.frames_come) > known)
        yield one


def test_page_shows_the_head_and_drag_orbits_it(page: Any) -> None:
    before = still(page, shows_head)
    drag(page, (320, 240), (230, 240))
    still(page, differs_from(before))


@pytest.fixture(scope="module")
def places(make_driver: Callable[[], InputDriver]) -> dict[str, tuple[float, float]]:
    """Return the positions of the controls in a window of the page's size, with the list of views open."""
    driver = make_driver()
    driver.press("show")
    return driver.viewer.session.positions


def test_panel_changes_the_picture(page: Any, places: dict[str, tuple[float, float]]) -> None:
    before = still(page, shows_head)
    for view, judge in (("irradiance", differs_from(before)), ("picture", looks_like(before))):
        closed = pixels(page)[80:280, :100]
        page.mouse.click(*places["show"])
        still(page, lambda image: bool(np.abs(image[80:280, :100] - closed).mean() > 3.0))  # noqa: B023
        page.mouse.click(*places[f"show/{view}"])
        still(page, judge)


def test_lost_connection_is_restored(page: Any) -> None:
    before = still(page, shows_head)
    page.evaluate("window.websocket.close()")
    page.wait_for_function("() => window.websocket.readyState === WebSocket.OPEN")
    page.wait_for_timeout(500)  # until the server has noticed that the other connection is gone
    drag(page, (320, 240), (260, 200))
    still(page, differs_from(before))


def test_a_reloaded_page_shows_the_head_again(page: Any) -> None:
    still(page, shows_head)
    assert "token" not in page.url  # a cookie has it, which scripts cannot read
    assert page.evaluate("document.cookie") == "" and page.context.cookies()[0]["sameSite"] == "Strict"
    page.reload()
    wait_for_picture(page)
    still(page, shows_head)


@pytest.fixture
def watcher(browser: Any) -> Iterator[Any]:
    """Yield a second page, which is always closed, because it would watch or control the other tests."""
    one = browser.new_page(viewport=SIZE)
    listen(one)
    yield one
    one.close()


def test_second_page_is_read_only(page: Any, watcher: Any, url: str) -> None:
    before = still(page, shows_head)
    watcher.goto(url)
    wait_for_picture(watcher)
    assert "watching" in watcher.inner_text("#notice")
    drag(watcher, (320, 240), (230, 240))
    watcher.wait_for_timeout(700)
    still(page, looks_like(before))
    drag(page, (320, 240), (230, 240))
    still(watcher, differs_from(before))
    page.close()
    watcher.wait_for_function("() => document.querySelector('#notice').innerText === ''")


def test_one_finger_orbits_and_two_zoom_and_pan(browser: Any, url: str) -> None:
    page = browser.new_context(viewport=SIZE, has_touch=True).new_page()
    listen(page)
    page.goto(url)
    wait_for_picture(page)
    before = still(page, shows_head)
    touch(page, [(320, 240)], [(300, 240)], [(270, 250)], [(240, 260)])
    turned = still(page, differs_from(before))
    assert abs(height(turned) - height(before)) < 30  # it came no nearer
    touch(page, [(300, 230)], *([(300, 230 + 5 * k), (300, 270 - 5 * k)] for k in range(4)))
    farther = still(page, lambda image: height(image) < 0.8 * height(turned))
    touch(page, [(300, 240)], *([(300, 240 + 30 * k), (330, 240 + 30 * k)] for k in range(4)))
    panned = still(page, lambda image: lowest(image) > lowest(farther) + 40)
    for _ in range(2):
        page.touchscreen.tap(300, 300)
    still(page, lambda image: lowest(image) < lowest(panned) - 20)  # the place is in the middle now
    page.context.close()


def lowest(image: NDArray[np.int64]) -> int:
    """Return the last row of the picture that shows the head."""
    return int(np.flatnonzero(head(image).max(axis=(1, 2)) > 25)[-1])


def test_keys_and_the_wheel_work_without_a_click(page: Any) -> None:
    before = still(page, shows_head)
    for _ in range(2):  # Tab must not leave the picture
        page.keyboard.press("Tab")
        bare = still(page, lambda image: bool(image[100:300, :60].max() < 30))
        page.keyboard.press("Tab")
        still(page, looks_like(before))
    assert bare.shape == before.shape
    page.mouse.move(300, 240)
    page.mouse.wheel(0, 400)
    still(page, lambda image: height(image) < 0.85 * height(before))
    page.keyboard.press("Control+z")
    still(page, looks_like(before))


def test_resized_window_is_filled(page: Any) -> None:
    still(page, shows_head)
    page.set_viewport_size({"width": 500, "height": 300})
    page.wait_for_function("() => document.querySelector('img').naturalWidth === 500")
    page.set_viewport_size(SIZE)
    wait_for_picture(page)


def test_watcher_that_takes_over_uses_its_size(page: Any, watcher: Any, url: str) -> None:
    still(page, shows_head)
    watcher.set_viewport_size({"width": 520, "height": 320})
    watcher.goto(url)
    wait_for_picture(watcher)
    page.close()
    watcher.wait_for_function(
        "() => document.querySelector('img').naturalWidth === 520", timeout=1000 * PATIENCE_S
    )


_RECORD_SOCKETS = """
    window.opened = []
    window.WebSocket = class extends EventTarget {
        constructor (address) { super(); window.opened.push(address) }
    }
"""


@pytest.mark.parametrize(("page_at", "socket_at"), [("http:", "ws:"), ("https:", "wss:")])
def test_https_page_opens_a_wss_socket(page_at: str, socket_at: str, browser: Any, url: str) -> None:
    """As behind a proxy, which is simulated with the server's own files."""
    page, base = browser.new_page(), url.partition("?")[0]
    page.add_init_script(_RECORD_SOCKETS)
    elsewhere = f"{page_at}//skin.example/some/folder/"
    page.request.get(url)  # which gives the cookie
    page.route(
        elsewhere + "**",
        lambda route: route.fulfill(response=page.request.get(base + route.request.url[len(elsewhere) :])),
    )
    page.goto(elsewhere)
    page.wait_for_function("() => window.opened.length > 0")
    assert page.evaluate("window.opened") == [f"{socket_at}//skin.example/some/folder/"]
    page.close()
