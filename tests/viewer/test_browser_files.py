"""Files in a real browser: what is saved comes as a download."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest
from chromium_input import CHROMIUM, visited, wait

from dermis.scene.files import load_scene

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")


def test_scene_and_screenshot_are_downloads_and_nothing_is_left_on_the_server(
    browser: Any, shown: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PIL import Image

    monkeypatch.chdir(tmp_path)
    session = shown.session
    session.change(session.state.with_skin(mix=0.25))
    with visited(browser, shown.url) as page:
        with page.expect_download() as coming:
            page.keyboard.press("Control+s")
        coming.value.save_as(tmp_path / "got.toml")
        assert load_scene(tmp_path / "got.toml")[0].skin.mix == 0.25
        assert page.inner_text("#files a") == "scene.toml" == coming.value.suggested_filename
        session.picture_file = "nowhere/view.png"
        for title in ("Surface", "Profile"):  # closed, else the button would be below the window's edge
            page.mouse.click(*session.positions[title])
        assert wait(page, lambda: session.positions.get("screenshot", (0, 500))[1] < 450)
        with page.expect_download() as coming:
            page.mouse.click(*session.positions["screenshot"])
        assert coming.value.suggested_filename == "view.png"
        picture = Image.open(io.BytesIO(Path(coming.value.path()).read_bytes()))
        assert picture.size == session.view_size == (200, 480)
    assert [path.name for path in tmp_path.iterdir()] == ["got.toml"]
