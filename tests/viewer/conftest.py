"""What the viewer's tests share: a small head, a studio on the session's adapter, and an offscreen viewer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from offscreen_hands import ADAPTER, SETTINGS, Hands
from small_head import write_head

from dermis.assets.head import Head, load_head
from dermis.scene.model import Scene
from dermis.viewer.state import ViewerState


@pytest.fixture(scope="session")
def head_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_head(tmp_path_factory.mktemp("viewer") / "head.obj")


@pytest.fixture(scope="session")
def head(head_file: Path) -> Head:
    return load_head(head_file)


@pytest.fixture
def state(head: Head, head_file: Path) -> ViewerState:
    return ViewerState(Scene(head), SETTINGS, {"name": str(head_file)})


@pytest.fixture(scope="module")
def make_hands(head: Head, head_file: Path) -> Callable[[], Hands]:
    """A viewer of 400 x 480 pixels."""
    pytest.importorskip("imgui_bundle", reason="the extra `viewer` is not installed")
    from rendercanvas.offscreen import OffscreenRenderCanvas

    from dermis.viewer.viewer import Viewer

    def make() -> Hands:
        canvas = OffscreenRenderCanvas(size=(400, 480))
        first = ViewerState(Scene(head), SETTINGS, {"name": str(head_file)})
        hands = Hands(None, canvas)
        hands.viewer = Viewer(first, canvas, ADAPTER, clock=lambda: hands.now)
        return hands

    return make


@pytest.fixture(scope="module")
def shared_hands(make_hands: Callable[[], Hands]) -> Hands:
    return make_hands()


@pytest.fixture
def hands(shared_hands: Hands, caplog: pytest.LogCaptureFixture) -> Iterator[Hands]:
    """The module's viewer, back at its first state; errors that rendercanvas only logs fail the test."""
    history = shared_hands.viewer.desk.history
    while history.can_undo:
        history.undo()
    shared_hands.viewer.panel.visible = True
    shared_hands.viewer.desk.split.release()
    yield shared_hands
    assert [record.message for record in caplog.records if record.levelname == "ERROR"] == []
