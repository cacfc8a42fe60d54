"""Files in a real browser: saved files are downloaded, heads are uploaded."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest
from chromium_input import CHROMIUM, visited, wait
from small_head import write_head

from dermis.scene.files import load_scene

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")


def test_scene_and_screenshot_are_downloads_without_server_files(
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
        sections = ("Surface", "Profile", "Head")
        for title in sections:  # closed, else the button would be below the window's edge
            page.mouse.click(*session.positions[title])
        assert wait(page, lambda: session.positions.get("screenshot", (0, 500))[1] < 450)
        with page.expect_download() as coming:
            page.mouse.click(*session.positions["screenshot"])
        assert coming.value.suggested_filename == "view.png"
        picture = Image.open(io.BytesIO(Path(coming.value.path()).read_bytes()))
        assert picture.size == session.view_size == (200, 480)
        for title in sections[::-1]:
            page.mouse.click(*session.positions[title])
            page.wait_for_timeout(300)
    assert [path.name for path in tmp_path.iterdir()] == ["got.toml"]


def test_chosen_file_is_uploaded_and_others_are_refused(browser: Any, shown: Any, tmp_path: Path) -> None:
    session, first = shown.session, shown.session.state
    good, bad, other = (tmp_path / name for name in ("mine.obj", "broken.obj", "notes.txt"))
    write_head(good)
    bad.write_text("v 1 2\nf 1 2 3\n")
    other.write_text("x")
    with visited(browser, shown.url, expected="status of 400") as page:

        def choose(path: Path) -> None:
            assert wait(page, lambda: "upload a file" in session.positions)
            with page.expect_file_chooser() as chooser:
                page.mouse.click(*session.positions["upload a file"])
            chooser.value.set_files(path)

        choose(good)
        assert wait(page, lambda: session.state.scene.head is not first.scene.head)
        (opened,) = session.heads.recent
        assert opened.startswith(shown.folder) and session.heads.display_name(opened) == "mine.obj"
        page.wait_for_function("() => document.querySelector('#files').innerText === ''")
        with page.expect_download() as coming:
            page.keyboard.press("Control+s")
        saved = Path(coming.value.path()).read_text()
        assert 'name = "mine.obj"' in saved and shown.folder not in saved
        state = session.state
        choose(bad)
        assert wait(page, lambda: "broken.obj: " in session.message) and session.state is state
        choose(other)
        page.wait_for_function("() => document.querySelector('#files').innerText.includes('.obj, .ply')")
        assert session.heads.recent == [opened] and len(list(Path(shown.folder).rglob("*.*"))) == 2
