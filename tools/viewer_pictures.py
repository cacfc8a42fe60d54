"""Make the pictures of the viewer for the documentation: window on a virtual screen, page in Chromium."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image, ImageChops, ImageGrab

from dermis.base.command_line import run_script

FOLDER = Path(__file__).parent.parent / "docs" / "images"
SIZE = 1100, 760
SCENE = ("--atlas", "1024", "--samples", "4")
PATIENCE_S = 300.0
REFINED_S = 45.0  # time without a change; software adapters render still pictures slowly
ANSWERED_S = 2.0
# positions of controls in the page, to click on [pixel]
VIEW_LIST, IRRADIANCE = (30, 168), (30, 251)
COMPARE, FREEZE = (100, 243), (30, 268)
CHROMIUM = "chromium", "chromium-browser", "google-chrome"


def main(head: str = "lee_perry_smith") -> None:
    """Make both pictures."""
    for name, take in (("viewer-window", window), ("viewer-browser", page)):
        take(head).save(FOLDER / f"{name}.webp", quality=88, method=6)


def window(head: str) -> Image.Image:
    """Return a screenshot of the window."""
    with screen() as display:
        environment = os.environ | {"DISPLAY": display}
        environment.pop("WAYLAND_DISPLAY", None)
        light = ["--env", "royal_esplanade", "--profile", "light"]
        words = ["view", head, "--size", f"{SIZE[0]}x{SIZE[1]}", *light, *SCENE]
        with running(subprocess.Popen([sys.executable, "-m", "dermis", *words], env=environment)):
            return wait_until_still(lambda: ImageGrab.grab(xdisplay=display).convert("RGB"))


def page(head: str) -> Image.Image:
    """Return a screenshot of the page, with the light before scattering right of the divider."""
    from playwright.sync_api import sync_playwright

    words = ["view", head, "--browser", "--port", "0", "--size", f"{SIZE[0]}x{SIZE[1]}", *SCENE]
    command = [sys.executable, "-m", "dermis", *words]
    with (
        running(subprocess.Popen(command, stdout=subprocess.PIPE, text=True)) as server,
        sync_playwright() as play,
    ):
        assert server.stdout is not None
        url = server.stdout.readline().split()[0]
        found = next(filter(None, map(shutil.which, CHROMIUM)))
        browser = play.chromium.launch(executable_path=found, args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        tab.goto(url)

        def screenshot() -> Image.Image:
            return Image.open(io.BytesIO(tab.screenshot())).convert("RGB")

        wait_until_still(screenshot)
        for position in (COMPARE, FREEZE, VIEW_LIST, IRRADIANCE):
            tab.mouse.click(*position)
            wait_until_still(screenshot, ANSWERED_S)
        tab.mouse.move(SIZE[0] - 5, 5)
        taken = wait_until_still(screenshot)
        browser.close()
    return taken


@contextmanager
def screen() -> Iterator[str]:
    """Yield the name of a virtual screen in memory."""
    read, write = os.pipe()
    size = f"{SIZE[0]}x{SIZE[1]}x24"
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", size, "-nolisten", "tcp", "-noreset"]
    with running(subprocess.Popen(command, pass_fds=(write,), stderr=subprocess.DEVNULL)):
        os.close(write)
        with os.fdopen(read) as numbers:
            yield f":{numbers.readline().strip()}"


@contextmanager
def running(process: subprocess.Popen[Any]) -> Iterator[subprocess.Popen[Any]]:
    """Yield a process, which is terminated at the end of the block."""
    try:
        yield process
    finally:
        process.terminate()
        process.wait(20)


def wait_until_still(take: Callable[[], Image.Image], quiet_s: float = REFINED_S) -> Image.Image:
    """Return the first non-empty picture that does not change any more."""
    end = time.monotonic() + PATIENCE_S
    last, since = take(), time.monotonic()
    while time.monotonic() < end:
        time.sleep(0.5)
        now = take()
        if ImageChops.difference(now, last).getbbox():
            last, since = now, time.monotonic()
        elif now.getextrema() != ((0, 0),) * 3 and time.monotonic() - since > quiet_s:
            return now
    raise SystemExit("the viewer does not come to rest")


if __name__ == "__main__":
    run_script(main)
