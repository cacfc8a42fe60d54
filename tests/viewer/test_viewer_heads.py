"""Other heads: built-in, random or opened from a file while the picture stays interactive."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from offscreen_input import InputDriver
from page_client import PATIENCE_S
from small_head import write_head

from dermis.apps.viewer import session as viewer_session
from dermis.apps.viewer.session import HeadLoader
from dermis.apps.viewer.state import ViewerState
from dermis.mesh.head import Head


@pytest.fixture
def gate(head: Head, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Return an event that lets heads be opened, each replaced by the small one.

    The attribute `asked` has their names.
    """
    one: Any = threading.Event()
    one.asked = []

    def slowly(name: str) -> Head:
        one.asked.append(name)
        assert one.wait(PATIENCE_S)
        return Head(name, head.mesh, head.maps)

    monkeypatch.setattr(viewer_session, "load_head", slowly)
    yield one
    one.set()


def wait(driver: InputDriver) -> None:
    end = time.monotonic() + PATIENCE_S
    while driver.viewer.session.heads.loading_message and time.monotonic() < end:
        time.sleep(0.02)
        driver.frame()


def test_viewer_stays_responsive_while_a_person_loads(driver: InputDriver, gate: Any) -> None:
    session = driver.viewer.session
    first = session.state
    driver.press("dice")
    (name,) = gate.asked
    assert name.startswith("human:") and session.heads.loading_message == f"opening {name} ..."
    driver.drag((300.0, 200.0), (260.0, 200.0))
    turned = session.state.scene.camera
    assert turned != first.scene.camera and session.state.scene.head is first.scene.head
    gate.set()
    wait(driver)
    assert session.state.scene.head.name == name == session.state.head["name"]
    assert session.state.scene.camera == turned  # what changed meanwhile stays
    session.history.undo()
    assert session.state.scene.head is first.scene.head


def test_last_choice_is_loaded(driver: InputDriver, gate: Any) -> None:
    session = driver.viewer.session
    for number in (3, 4, 5):
        session.heads.open(f"human:{number}")
    gate.set()
    wait(driver)
    assert session.state.scene.head.name == "human:5"


def test_a_file_is_opened_by_its_path_and_listed(driver: InputDriver, tmp_path: Path) -> None:
    session, path = driver.viewer.session, write_head(tmp_path / "mine.obj")
    session.head_file = str(path)
    driver.press("open file")
    wait(driver)
    assert session.state.head == {"name": str(path)} and session.heads.recent == [str(path)]
    driver.press("head")
    assert f"head/{path}" in session.positions and "head/human" in session.positions
    driver.event("key_down", key="Escape")
    driver.event("key_up", key="Escape")


@pytest.mark.parametrize(
    ("name", "said"), [("nobody.obj", "neither"), ("human:x", "SEED"), ("gone.toml", "gone.toml")]
)
def test_failed_load_is_reported_and_the_head_stays(name: str, said: str, driver: InputDriver) -> None:
    session = driver.viewer.session
    first = session.state
    session.heads.open(name)
    wait(driver)
    assert said in session.message and session.state is first
    session.message = ""


def test_pose_is_kept_for_equal_names(rigged: ViewerState, rigged_file: Path) -> None:
    posed = rigged.with_pose({"jawOpen": 0.5})  # type: ignore[arg-type]
    for name, kept in ((str(rigged_file), True), (str(rigged_file.with_name("bare.obj")), False)):
        if not kept:
            write_head(rigged_file.with_name("bare.obj"))
        opening = HeadLoader()
        opening.open(name)
        end, found = time.monotonic() + PATIENCE_S, None
        while found is None and time.monotonic() < end:
            found = opening.take_loaded_state(posed)
        assert found is not None and (found.scene.pose is not None) is kept
