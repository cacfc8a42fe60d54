"""Pages of exported heads in headless Chromium."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from dermis.base.extras import needed

if TYPE_CHECKING:
    from playwright.sync_api import Page

SOFTWARE_WEBGL = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@contextmanager
def chromium_page(side: int, flags: Sequence[str] = SOFTWARE_WEBGL) -> Iterator[Page]:
    """Open an empty page without a network, `side` pixels wide and high.

    Raises DermisError when the package playwright is not installed.
    """
    with needed("playwright.sync_api", "a page in Chromium").sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=list(flags))
        yield browser.new_page(viewport={"width": side, "height": side}, offline=True)
        browser.close()
