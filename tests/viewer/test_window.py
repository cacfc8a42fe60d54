"""The desktop window: it shows the head, rotates it, and follows the size of the window."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import child_process
import numpy as np
import pytest
from numpy.typing import NDArray
from offscreen_input import ADAPTER

_NEEDED = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
_PATIENCE_S = 60.0

pytestmark = pytest.mark.skipif(bool(_NEEDED), reason=f"there is no {' and no '.join(_NEEDED)} here")


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """Yield a virtual screen in memory."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24", "-nolisten", "tcp"]
    server = child_process.start(command, pass_fds=(write,), stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as numbers:
        number = numbers.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait(_PATIENCE_S)


@pytest.fixture(scope="module")
def window(display: str, head_file: Path) -> Iterator[subprocess.Popen[str]]:
    pytest.importorskip("glfw", reason="the extra `viewer` is not installed")
    words = ["view", str(head_file), "--size", "400x480", "--atlas", "128", "--samples", "1"]
    command = [sys.executable, "-m", "dermis", *words, "--adapter", ADAPTER]
    environment = os.environ | {"DISPLAY": display}
    environment.pop("WAYLAND_DISPLAY", None)
    pipe = subprocess.PIPE
    one = child_process.start(command, env=environment, stdout=pipe, stderr=pipe, text=True)
    yield one
    if one.poll() is None:
        one.terminate()
        one.communicate(timeout=_PATIENCE_S)


def tool(display: str, *words: str) -> str:
    environment = os.environ | {"DISPLAY": display}
    return subprocess.run(["xdotool", *words], env=environment, capture_output=True, text=True).stdout.strip()


def screen(display: str) -> NDArray[np.int64]:
    from PIL import ImageGrab

    return np.array(ImageGrab.grab(xdisplay=display).convert("RGB")).astype(np.int64)


def still(display: str, judge: Callable[[NDArray[np.int64]], bool]) -> NDArray[np.int64]:
    """Return the first picture that satisfies `judge` and does not change any more."""
    last, end = screen(display), time.monotonic() + _PATIENCE_S
    while time.monotonic() < end:
        time.sleep(0.4)
        found = screen(display)
        if judge(found) and np.abs(found - last).max() == 0:
            return found
        last = found
    raise AssertionError("the screen never shows that")


def test_window_shows_and_orbits_the_head_and_follows_its_size(
    display: str, window: subprocess.Popen[str]
) -> None:
    name = ""
    for _ in range(150):
        name = name or tool(display, "search", "--name", "^dermis$").partition("\n")[0]
        if name:
            break
        assert window.poll() is None, window.communicate()[1]
        time.sleep(0.4)
    tool(display, "windowmove", name, "0", "0")
    before = still(display, lambda image: bool(image[200:280, 205:260].mean() > 15.0))
    tool(display, "mousemove", "320", "240", "mousedown", "1")
    for x in range(310, 230, -10):
        tool(display, "mousemove", str(x), "240")
        time.sleep(0.05)
    tool(display, "mouseup", "1")
    part = np.s_[40:430, 205:395]
    turned = still(display, lambda image: bool(np.abs(image[part] - before[part]).mean() > 0.5))
    assert np.abs(turned[30:400, :190] - before[30:400, :190]).max() == 0  # the panel is not turned
    tool(display, "windowsize", name, "600", "400")
    still(display, lambda image: bool(image[150:250, 430:460].mean() > 15.0 and image[450:, :].max() == 0))
    assert window.poll() is None
