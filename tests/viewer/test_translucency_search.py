"""What lies opposite thin parts is looked for while pigments move; the picture at rest has waited for it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from offscreen_input import ADAPTER, InputDriver

from dermis.frame import translucency
from dermis.frame.renderer import Renderer
from dermis.viewer.chart import ATLAS
from dermis.viewer.state import ViewerState
from dermis.viewer.studio import Studio

SIZE = (96, 96)
PALE, DARK = 0.01, 0.2  # whose widest Gaussians are more than a step of width apart


@dataclass
class Held:
    """Searches that wait until they may go on.

    widths : of those that were begun [mm]
    """

    begun: threading.Event = field(default_factory=threading.Event)
    may_go_on: threading.Event = field(default_factory=threading.Event)
    widths: list[float] = field(default_factory=list)


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> Iterator[Held]:
    found, search = Held(), translucency.cached_pairs

    def waiting(mesh: Any, atlas: Any, widest_mm: float) -> Any:
        found.widths.append(widest_mm)
        found.begun.set()
        assert found.may_go_on.wait(60.0)
        return search(mesh, atlas, widest_mm)

    monkeypatch.setattr(translucency, "cached_pairs", waiting)
    yield found
    found.may_go_on.set()


@pytest.fixture
def studio(held: Held, state: ViewerState, monkeypatch: pytest.MonkeyPatch) -> Studio:
    """With the picture of pale skin, after which searches wait."""
    studio = Studio(ADAPTER)
    monkeypatch.setattr(studio.pace, "note", lambda _: None)  # a busy machine would get smaller pictures
    held.may_go_on.set()
    image(studio, skin(state, PALE))
    held.may_go_on.clear()
    held.begun.clear()
    held.widths.clear()
    return studio


def skin(state: ViewerState, melanin: float) -> ViewerState:
    return state.with_skin(profile="light", albedo="profile").with_pigments(melanin=melanin)


def image(studio: Studio, state: ViewerState, moving: bool = False) -> Any:
    return studio.read(studio.image(state, state.scene.camera, SIZE, moving)).astype(int)


def anew(state: ViewerState) -> Any:
    settings = state.settings.model_copy(update={"size": SIZE})
    return Renderer(ADAPTER).draw(state.scene, settings).srgb8().astype(int)


def test_pigments_move_on_while_the_search_goes_on(studio: Studio, held: Held, state: ViewerState) -> None:
    pale, dark = image(studio, skin(state, PALE), True), skin(state, DARK)
    moved = [image(studio, skin(state, melanin), True) for melanin in (0.1, 0.15, DARK)]
    assert all(np.abs(one - pale).mean() > 1.0 for one in moved)
    assert held.begun.wait(60.0)
    assert len(held.widths) == 1  # one after the other
    assert not studio.is_current
    held.may_go_on.set()
    still = image(studio, dark)
    assert studio.is_current
    assert np.abs(still - anew(dark)).max() <= 1  # whose fit begins elsewhere
    assert len(set(held.widths)) == len(held.widths) - 1 == 2  # what passed by, and dark skin twice


def test_a_moving_picture_shows_what_was_found(studio: Studio, held: Held, state: ViewerState) -> None:
    dark = skin(state, DARK)
    image(studio, dark, True)
    assert studio.renderer.memo.provisional
    held.may_go_on.set()
    for k in range(1000):
        if not studio.renderer.memo.provisional:
            break
        time.sleep(0.01)
        image(studio, dark.with_settings(exposure=1.0 + 1e-4 * k), True)
    assert not studio.renderer.memo.provisional
    assert len(held.widths) == 1


def test_both_sides_of_the_divider_and_the_atlas_wait_at_rest(
    studio: Studio, held: Held, state: ViewerState
) -> None:
    dark = skin(state, DARK).in_view(ATLAS)
    camera = state.scene.camera
    studio.pictures(dark, skin(state, DARK), camera, SIZE, True)
    assert not studio.is_current
    held.may_go_on.set()
    live, frozen = (
        studio.read(one).astype(int) for one in studio.pictures(dark, skin(state, DARK), camera, SIZE, False)
    )
    assert studio.is_current
    assert np.abs(frozen - anew(skin(state, DARK))).max() <= 1
    assert np.array_equal(live, image(Studio(ADAPTER), dark))


def test_the_viewer_stays_alive_until_it_is_found(
    held: Held, make_driver: Callable[[], InputDriver], state: ViewerState
) -> None:
    held.may_go_on.set()
    driver = make_driver()
    session = driver.viewer.session
    session.change(skin(state, PALE))
    driver.settled()
    held.may_go_on.clear()
    session.change(skin(state, DARK))
    for _ in range(20):  # of 50 ms: long after what counts as motion
        driver.frame()
        assert session.studio.is_searching and not driver.viewer.is_still
    camera = session.state.scene.camera
    driver.drag((300.0, 240.0), (230.0, 240.0))
    assert session.state.scene.camera != camera and session.studio.is_searching
    held.may_go_on.set()
    driver.settled()
    assert session.studio.is_current and not session.studio.is_searching


def test_a_search_that_fails_is_begun_again(
    studio: Studio, held: Held, state: ViewerState, monkeypatch: pytest.MonkeyPatch
) -> None:
    waiting = translucency.cached_pairs

    def broken(mesh: Any, atlas: Any, widest_mm: float) -> Any:
        raise MemoryError("no room")

    monkeypatch.setattr(translucency, "cached_pairs", broken)
    with pytest.raises(Exception, match="no room"):
        image(studio, skin(state, DARK))
    monkeypatch.setattr(translucency, "cached_pairs", waiting)
    held.may_go_on.set()
    assert np.abs(image(studio, skin(state, DARK)) - anew(skin(state, DARK))).max() <= 1
