"""Every control of the panel, moved by a pointer: it is one step, which undo takes back and redo repeats."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from offscreen_input import InputDriver

from dermis.scene.environment import Environment
from dermis.scene.skin import Skin
from dermis.viewer.panel.meanings import meanings
from dermis.viewer.panel.sections import SECTIONS
from dermis.viewer.state import ViewerState, same

BUTTONS = {"undo", "redo", "help", "hide", "save", "load", "screenshot", "reset", "freeze"}
CAMERAS = {f"{name}##camera" for name in ("portrait", "three-quarter", "profile", "ear", "cheek")}
NO_STATE = BUTTONS | CAMERAS | {section.TITLE for section in SECTIONS} | {"regions"}
STARTS: dict[str, Callable[[ViewerState], ViewerState]] = {
    "table": lambda state: state.with_environment(Environment(name="uniform")),
    "pigments": lambda state: state.with_skin(profile="light").with_pigments(structure="donner2008"),
    "layers": lambda state: state.with_skin(profile="dj3").with_settings(seams="clear-colour"),
    "window": lambda state: state.with_rig("window"),
}
EXPECTED = {
    "table": "show, profile, colour from, mix, roughness, rho_s, oiliness, BRDF, Fresnel, energy, "
    "reflection, rig, strength, irradiance, inner cone, outer cone, softness, shadows, copy, remove, "
    "environment, turn, brightness, seen behind, technique, stretch, seams, transmission, occlusion, atlas, "
    "shadow map, samples, exposure, tone, gamma, bloom, background",
    "pigments": "layers, melanin, eumelanin, thickness, blood##epidermis, blood, oxygen",
    "layers": "thickness##1, absorption##1, scattering##1, add above##1, remove##1, beside charts",
    "window": "width, height",
}


@pytest.fixture(scope="module")
def tall(make_driver: Callable[[], InputDriver]) -> InputDriver:
    """A window that holds the whole panel, whose picture is not drawn again: the panel alone is looked at."""
    driver = make_driver()
    driver.settled()
    studio: Any = driver.viewer.desk.studio
    image = studio.last_image
    studio.pictures = lambda *_: (image, None)
    driver.canvas.set_logical_size(400, 1500)
    for section in SECTIONS:
        if not section.OPEN and section.TITLE != "Timing":
            driver.press(section.TITLE)
    return driver


def names_of(driver: InputDriver, label: str) -> list[str]:
    """What an open list offers."""
    return [place for place in driver.viewer.desk.places if place.startswith(f"{label}/")]


def move(driver: InputDriver, label: str) -> None:
    """Drag a slider, press a button, tick a box, or take another entry of a list."""
    desk = driver.viewer.desk
    desk.controls.light = 0
    driver.frame()
    before, (x, y) = desk.state, driver.place(label)
    driver.event("pointer_move", x=x, y=y, button=0, buttons=())
    for kind, way in (("pointer_down", 0.0), ("pointer_move", 23.0), ("pointer_up", 23.0)):
        driver.event(kind, x=x + way, y=y, button=1, buttons=(1,))
        driver.frame()
    driver.frame()
    if same(desk.state, before) and not names_of(driver, label):
        driver.press(label)  # a button, which the drag left
    for name in names_of(driver, label)[1::-1]:
        if same(desk.state, before):
            driver.click(desk.places[name])
            driver.frame()
        if same(desk.state, before):  # it is what was chosen already
            driver.press(label)
    for key in names_of(driver, label):
        del desk.places[key]


@pytest.mark.parametrize("start", STARTS)
def test_every_control_is_a_step_that_undo_takes_back(start: str, tall: InputDriver) -> None:
    desk = tall.viewer.desk
    desk.change(STARTS[start](desk.history.states[0]))
    desk.controls.light = 0
    tall.frame()
    if start == "layers":
        tall.press("layer 1")
    desk.places.clear()
    tall.frame()
    labels = [label for label in desk.places if label not in NO_STATE and not label.startswith("layer ")]
    expected = EXPECTED[start].split(", ")
    assert set(expected) <= set(labels)
    for label in labels if start == "table" else expected:
        before = desk.state
        move(tall, label)
        after = desk.state
        assert not same(before, after), label
        desk.history.undo()
        assert desk.state is before, label
        desk.history.redo()
        assert desk.state is after, label
        desk.history.undo()
        tall.frame()


def test_controls_are_explained_by_the_settings_own_words() -> None:
    said = meanings(Skin)
    assert said["mix"].startswith("Share of the colour map") and "Schlick" in said["fresnel"]
    assert {"mix", "roughness", "rho_s", "oiliness", "specular", "energy"} <= said.keys()


def test_the_panel_can_be_hidden_and_brought_back_without_keys(driver: InputDriver) -> None:
    driver.press("hide")
    assert not driver.viewer.panel.visible
    camera = driver.viewer.desk.state.scene.camera
    driver.press("panel")
    assert driver.viewer.panel.visible and driver.viewer.desk.state.scene.camera == camera


def test_a_finger_scrolls_the_panel_beside_its_controls(driver: InputDriver) -> None:
    _, y = driver.place("mix")
    driver.drag((170.0, y), (170.0, y - 90.0))  # on the label
    assert driver.place("mix")[1] == pytest.approx(y - 90.0, abs=2.0)
    driver.drag((170.0, y - 90.0), (170.0, y))
    assert driver.place("mix")[1] == pytest.approx(y, abs=2.0)


def test_help_lies_over_the_picture_and_goes_at_the_next_touch(driver: InputDriver) -> None:
    before = driver.settled()
    driver.event("key_down", key="?")
    shown = driver.settled()
    assert (shown[150:330, 215:385].astype(int) != before[150:330, 215:385]).mean() > 0.5
    driver.click((300.0, 400.0))
    assert (driver.settled()[150:330, 215:385] == before[150:330, 215:385]).all()


@pytest.mark.parametrize(
    ("name", "view", "size", "said"),
    [
        ("nowhere/a.png", "picture", (8, 8), "writable folder"),
        ("a.jpg", "picture", (8, 8), ".png or .exr"),
        ("a.exr", "normals", (8, 8), ".png"),
        ("a.png", "picture", (90_000, 8), "16384"),
        ("a.png", "picture", (16_000, 16_000), "at most 134 million"),
    ],
)
def test_a_screenshot_that_cannot_be_is_told_and_the_viewer_goes_on(
    name: str, view: str, size: tuple[int, int], said: str, driver: InputDriver, tmp_path: Path
) -> None:
    desk = driver.viewer.desk
    desk.change(desk.state.in_view(view))
    before = driver.settled()
    desk.names.picture, desk.names.size = str(tmp_path / name), size
    for section in ("Profile", "Surface"):  # closed, else the button would be below the window's edge
        driver.press(section)
    driver.press("screenshot")
    for section in ("Surface", "Profile"):
        driver.press(section)
    assert said in desk.messages.said and len(desk.messages.said) < 400
    assert not list(tmp_path.iterdir())
    after = driver.settled()
    assert (after[:200, 205:] == before[:200, 205:]).all()
