"""Shared fixtures of the viewer tests: a small head, a renderer, and an offscreen viewer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from chromium_input import opened_browser
from offscreen_input import ADAPTER, SETTINGS, InputDriver
from rigged_head import write_rigged_head
from served_viewer import served
from small_head import write_head

from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.state import ViewerState
from dermis.mesh.head import Head
from dermis.scene.heads import load_head
from dermis.scene.model import Scene


@pytest.fixture(scope="session")
def head_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_head(tmp_path_factory.mktemp("viewer") / "head.obj")


@pytest.fixture(scope="session")
def head(head_file: Path) -> Head:
    return load_head(head_file, subdivide=0)


@pytest.fixture
def state(head: Head, head_file: Path) -> ViewerState:
    return ViewerState(Scene(head), SETTINGS, {"name": str(head_file)})


@pytest.fixture(scope="session")
def rigged_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rigged_head(tmp_path_factory.mktemp("viewer") / "rigged.glb")


@pytest.fixture(scope="session")
def rigged_head(rigged_file: Path) -> Head:
    return load_head(rigged_file, subdivide=0)


@pytest.fixture
def rigged(rigged_head: Head, rigged_file: Path) -> ViewerState:
    """Return the state of a head with expressions and bones."""
    return ViewerState(Scene(rigged_head), SETTINGS, {"name": str(rigged_file)})


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with opened_browser() as one:
        yield one


@pytest.fixture(scope="module")
def shown(head: Head, head_file: Path) -> Iterator[Any]:
    """Yield a viewer served by this process; `shown.url` is its page."""
    pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
    with served(ViewerState(Scene(head), SETTINGS, {"name": str(head_file)}), (400, 480)) as one:
        yield one


@pytest.fixture(scope="module")
def make_driver(head: Head, head_file: Path) -> Callable[..., InputDriver]:
    """Return a function that opens a viewer of 400 x 480 pixels with the small head or another state."""
    pytest.importorskip("imgui_bundle", reason="the extra `viewer` is not installed")
    from rendercanvas.offscreen import OffscreenRenderCanvas

    from dermis.apps.viewer.viewer import Viewer

    def make(state: ViewerState | None = None, motion: MotionFile | None = None) -> InputDriver:
        canvas = OffscreenRenderCanvas(size=(400, 480))
        first = state or ViewerState(Scene(head), SETTINGS, {"name": str(head_file)})
        driver = InputDriver(None, canvas)
        driver.viewer = Viewer(first, canvas, ADAPTER, clock=lambda: driver.now, motion=motion)
        return driver

    return make


@pytest.fixture(scope="module")
def shared_driver(make_driver: Callable[[], InputDriver]) -> InputDriver:
    return make_driver()


@pytest.fixture
def driver(shared_driver: InputDriver, caplog: pytest.LogCaptureFixture) -> Iterator[InputDriver]:
    """Yield the shared viewer in its initial state; errors that rendercanvas only logs fail the test."""
    history = shared_driver.viewer.session.history
    while history.can_undo:
        history.undo()
    shared_driver.viewer.panel.is_visible = True
    shared_driver.viewer.session.split.release()
    yield shared_driver
    assert [record.message for record in caplog.records if record.levelname == "ERROR"] == []
