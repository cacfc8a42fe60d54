"""Gallery page: no network, working sliders, a layout for phones and desktops."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chromium_input import CHROMIUM

from dermis.apps.gallery.page import _equation_html, write_page
from dermis.apps.gallery.panels import panel_sheet
from dermis.apps.gallery.script import GalleryPicture, Panel, Script, draw_pictures, encode_webp, read_script

QUIET = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")


def picture(tmp_path: Path, name: str, facts: str, **panels: Panel) -> GalleryPicture:
    path = tmp_path / f"{name}.py"
    path.write_text(f'"""{name} <first>.\n\nSee & believe.\n\n{facts}\n"""\n', encoding="utf-8")
    files = {caption: encode_webp(panel) for caption, panel in panels.items()}
    return GalleryPicture(read_script(path), files, (64, 64), 1.0, 12.5)


def plain(*colour: int) -> np.ndarray:
    return np.full((64, 64, 3), colour, np.uint8)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    two = {"red": plain(255, 0, 0), "blue": plain(0, 0, 255)}
    slider = picture(tmp_path, "01_a", "Deck: S1\nSlider: red | blue", **two)
    many = {f"panel{number}": plain(0, 40 * number, 0) for number in range(5)}
    grid = picture(tmp_path, "02_b", "Deck: S2\nSources: Schlick1994\nColumns: 5", **many)
    path = tmp_path / "index.html"
    write_page(path, [slider, grid], "a <head>", "an adapter")
    return path


def test_page_is_self_contained_and_escapes_text(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "a &lt;head&gt;" in text and "See &amp; believe." in text
    assert "http://" not in text and "https://" not in text
    assert text.count("data:image/webp") == 7
    assert text.count('<tr id="S') == 25 and "dermis gallery --only 01_a" in text


def test_equations_have_indices_and_powers() -> None:
    shown = _equation_html("E_k = a^(1−mix) & x^2")
    assert shown == "E<sub>k</sub> = a<sup>1−mix</sup> &amp; x<sup>2</sup>"


def test_failed_sections_show_an_error_and_others_are_drawn(tmp_path: Path) -> None:
    from dermis.base.errors import refuse

    class Faulty(Script):
        def draw(self, studio: Any) -> Any:
            refuse("sample x", "a file", "there is none", "Fetch it")

    class Fine(Script):
        def draw(self, studio: Any) -> Any:
            return {"one": plain(9, 9, 9)}

    described = vars(picture(tmp_path, "01_a", "Deck: S1").script)
    studio: Any = type("Studio", (), {})()
    first, second = draw_pictures([Faulty(**described), Fine(**described)], studio)
    assert "there is none" in first.fault and not first.panels
    assert second.fault == "" and second.size == (64, 64)


def test_contact_sheet_has_rows_with_captions() -> None:
    page_file = panel_sheet(
        {"a": plain(255, 0, 0), "b": plain(0, 255, 0), "film": [plain(0, 0, 255)]}, columns=2
    )
    assert page_file.shape == (2 * (64 + 24), 128, 3)
    assert page_file[10, 10].tolist() == [255, 0, 0] and page_file[100, 10].tolist() == [0, 0, 255]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here")
    sync = pytest.importorskip("playwright.sync_api")
    with sync.sync_playwright() as play:
        opened = play.chromium.launch(executable_path=CHROMIUM, args=list(QUIET))
        yield opened
        opened.close()


@pytest.mark.parametrize("width", [390, 1280])
def test_page_works_in_a_browser(page: Path, browser: Any, width: int) -> None:
    view = browser.new_page(viewport={"width": width, "height": 800})
    content: list[str] = []
    view.on("console", lambda message: content.append(message.text))
    view.on("pageerror", lambda fault: content.append(str(fault)))
    view.goto(page.as_uri())
    assert view.evaluate("document.documentElement.scrollWidth") <= width
    seam = view.locator(".slider")
    box = seam.locator("img").first.bounding_box()
    assert box["width"] > 0.8 * min(width, 736)
    shown = [_colour(view, box, fraction) for fraction in (0.25, 0.75)]
    assert shown == ["red", "blue"]
    view.mouse.click(box["x"] + 0.9 * box["width"], box["y"] + 20)
    assert _colour(view, box, 0.75) == "red"
    view.locator(".panels img").first.click()
    assert view.locator("dialog").is_visible()
    view.keyboard.press("Escape")
    assert not view.locator("dialog").is_visible()
    view.locator(".panels img").nth(1).focus()
    view.keyboard.press("Enter")
    assert view.locator("dialog img").get_attribute("alt") == "panel1"
    view.keyboard.press("Enter")
    assert not view.locator("dialog").is_visible()
    assert content == []


def _colour(view: Any, box: dict[str, float], fraction: float) -> str:
    """Return the colour of the slider's picture at a fraction of its width."""
    import io

    from PIL import Image

    x, y = box["x"] + fraction * box["width"], box["y"] + 0.5 * box["height"]
    shot = view.screenshot(clip={"x": x, "y": y, "width": 4, "height": 4})
    red, _, blue = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"))[1, 1]
    return "red" if red > blue else "blue"
