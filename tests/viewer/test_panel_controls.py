"""Every control of the panel, moved by a pointer: it is one step that can be undone and redone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from offscreen_input import InputDriver
from pydantic import Field

from dermis.apps.viewer.panel.sections import SECTIONS
from dermis.apps.viewer.state import ViewerState, states_equal
from dermis.mesh.pose import Pose
from dermis.scene.environment import Environment
from dermis.scene.frozen_model import FrozenModel, field_help, slider
from dermis.scene.settings import Settings
from dermis.scene.skin import Pigments, Skin, TissueLayer
from dermis.scene.talk_comparisons import COMPARISONS_HEADING

BUTTONS = {"undo", "redo", "help", "hide", "save", "load", "screenshot", "reset", "freeze"}
BUTTONS |= {"open", "search", "bones", "size", "head", "seed", "dice", "path", "open file"}
CAMERAS = {f"{name}##camera" for name in ("portrait", "three-quarter", "profile", "ear", "cheek")}
NO_STATE = BUTTONS | CAMERAS | {section.title for section in SECTIONS} | {"regions"}
STARTS: dict[str, Callable[[ViewerState], ViewerState]] = {
    "table": lambda state: state.with_environment(Environment(name="uniform")).with_settings(
        background=(0.2, 0.1, 0.1)
    ),
    "pigments": lambda state: state.with_skin(profile="light").with_pigments(structure="donner2008"),
    "layers": lambda state: state.with_skin(profile="dj3").with_settings(seams="clear-colour"),
    "window": lambda state: state.with_light_preset("window"),
}
EXPECTED = {
    "table": "show, profile, colour from, mix, roughness, rho_s, oiliness, BRDF, Fresnel, energy, "
    "reflection, rig, strength, irradiance, inner cone, outer cone, softness, shadows, copy, remove, add, "
    "environment, rotation, brightness, technique, stretch, seams, transmission, occlusion, atlas, "
    "shadow map, samples, exposure from, exposure, tone, gamma, bloom, background from, background, "
    "background blur",
    "pigments": "layers, melanin, eumelanin, thickness, blood##epidermis, blood, oxygen",
    "layers": "thickness##1, absorption##1, scattering##1, add above##1, remove##1, seam colour",
    "window": "width, height",
    "faces": "rest, jawOpen##target, mouthSmileLeft##target, browInnerUp##target, neck##bone, head##bone",
}


@pytest.fixture(scope="module")
def tall(make_driver: Callable[[], InputDriver]) -> InputDriver:
    """Yield a window that shows the whole panel; its picture is not rendered again."""
    driver = make_driver()
    driver.settled()
    view_renderer: Any = driver.viewer.session.view_renderer
    image = view_renderer.last_image
    view_renderer.render_images = lambda *_: (image, None)
    driver.canvas.set_logical_size(500, 1500)
    for section in SECTIONS:
        if section.applies(driver.viewer.session) and not section.is_open and section.title != "Timing":
            driver.press(section.title)
    return driver


def names_of(driver: InputDriver, label: str) -> list[str]:
    """Return the entries of an open list."""
    return [place for place in driver.viewer.session.positions if place.startswith(f"{label}/")]


def move(driver: InputDriver, label: str) -> None:
    """Drag a slider, press a button, tick a box, or choose another entry of a list."""
    session = driver.viewer.session
    session.controls.light = 0
    driver.frame()
    before, (x, y) = session.state, driver.position(label)
    driver.event("pointer_move", x=x, y=y, button=0, buttons=())
    for kind, way in (("pointer_down", 0.0), ("pointer_move", 23.0), ("pointer_up", 23.0)):
        driver.event(kind, x=x + way, y=y, button=1, buttons=(1,))
        driver.frame()
    driver.frame()
    if states_equal(session.state, before) and not names_of(driver, label):
        driver.press(label)  # a button, which the drag left
    for name in names_of(driver, label)[1::-1]:
        if states_equal(session.state, before):
            driver.click(session.positions[name])
            driver.frame()
        if states_equal(session.state, before):  # it is what was chosen already
            driver.press(label)
    for key in names_of(driver, label):
        del session.positions[key]


@pytest.mark.parametrize("start", [*STARTS, "faces"])
def test_every_control_is_an_undoable_step(start: str, tall: InputDriver, rigged: ViewerState) -> None:
    session = tall.viewer.session
    smiling = rigged.with_pose(Pose({"mouthSmileLeft": 0.5}, {"neck": (10.0, 0.0, 5.0)}))
    session.change(smiling if start == "faces" else STARTS[start](session.history.states[0]))
    session.controls.light = 0
    tall.frame()
    if start == "layers":
        tall.press("layer 1")
    if start == "faces":
        tall.press("bones")
    session.positions.clear()
    tall.frame()
    labels = [
        label for label in session.positions if label not in NO_STATE and not label.startswith("layer ")
    ]
    expected = EXPECTED[start].split(", ")
    assert set(expected) <= set(labels)
    for label in labels if start == "table" else expected:
        before = session.state
        move(tall, label)
        after = session.state
        assert not states_equal(before, after), label
        session.history.undo()
        assert session.state is before, label
        session.history.redo()
        assert session.state is after, label
        session.history.undo()
        tall.frame()


@pytest.mark.parametrize("kind", [Skin, Pigments, TissueLayer, Settings, Environment])
def test_every_field_has_a_help_text(kind: type[FrozenModel]) -> None:
    assert all(field_help(kind, name) for name in kind.model_fields)


def test_talk_comparisons_are_the_last_collapsed_section(driver: InputDriver) -> None:
    assert SECTIONS[-1].title == COMPARISONS_HEADING and not SECTIONS[-1].is_open
    labels = {"energy", "reflection", "stretch", "seams", "gamma"}
    session, opened = driver.viewer.session, ("Technique", "Picture")
    for section in opened:
        driver.press(section)
    session.positions.clear()
    driver.frame()
    assert not labels & set(session.positions) and {"BRDF", "tone", "technique"} <= set(session.positions)
    others = max(y for name, (_, y) in session.positions.items() if name != COMPARISONS_HEADING)
    assert session.positions[COMPARISONS_HEADING][1] > others
    driver.press(COMPARISONS_HEADING)
    driver.frame()
    assert labels <= set(session.positions)
    for section in (COMPARISONS_HEADING, *opened):
        driver.press(section)


def test_a_control_under_the_pointer_shows_its_help(driver: InputDriver) -> None:
    x, y = driver.position("mix")
    before = driver.settled()
    driver.event("pointer_move", x=x, y=y, button=0, buttons=())
    after = driver.settled()
    tooltip = np.s_[int(y) + 25 : int(y) + 40, 205 : int(x) + 250]
    assert (after[tooltip] != before[tooltip]).any()


class WetSkin(Skin):
    wetness: Annotated[float, Field(ge=0.5, le=3.0)] = 1.0
    """How wet the skin is."""


class GrainySettings(Settings):
    grain: Annotated[float, Field(ge=0, le=1, json_schema_extra=slider(0.01, 0.1, logarithmic=True))] = 0.02
    """Noise of the film."""


def test_a_new_field_of_a_model_gets_a_slider_with_its_range(tall: InputDriver) -> None:
    session = tall.viewer.session
    state = session.history.states[0]
    skin, settings = WetSkin(), GrainySettings(**state.settings.model_dump())
    session.change(replace(state, scene=replace(state.scene, skin=skin), settings=settings))
    for label, model, (low, high) in (
        ("wetness", lambda: session.state.scene.skin, (0.5, 3.0)),
        ("grain", lambda: session.state.settings, (0.01, 0.1)),
    ):
        x, y = tall.position(label)
        for end, expected in ((x - 90.0, low), (x + 300.0, high)):
            tall.drag((x, y), (end, y))
            assert getattr(model(), label) == pytest.approx(expected)
        session.history.undo()
        session.history.undo()
    assert session.state.scene.skin is skin


def test_the_panel_can_be_hidden_and_brought_back_without_keys(driver: InputDriver) -> None:
    driver.press("hide")
    assert not driver.viewer.panel.is_visible
    camera = driver.viewer.session.state.scene.camera
    driver.press("panel")
    assert driver.viewer.panel.is_visible and driver.viewer.session.state.scene.camera == camera


def test_touch_scrolls_the_panel_beside_controls(driver: InputDriver) -> None:
    _, y = driver.position("mix")
    driver.drag((170.0, y), (170.0, y - 90.0))  # on the label
    assert driver.position("mix")[1] == pytest.approx(y - 90.0, abs=2.0)
    driver.drag((170.0, y - 90.0), (170.0, y))
    assert driver.position("mix")[1] == pytest.approx(y, abs=2.0)


def test_help_overlay_closes_at_the_next_touch(driver: InputDriver) -> None:
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
def test_failed_screenshot_is_reported(
    name: str, view: str, size: tuple[int, int], said: str, driver: InputDriver, tmp_path: Path
) -> None:
    session = driver.viewer.session
    session.change(session.state.with_view(view))
    before = driver.settled()
    session.picture_file, session.picture_size = str(tmp_path / name), size
    for section in ("Profile", "Surface"):  # closed, else the button would be below the window's edge
        driver.press(section)
    driver.press("screenshot")
    for section in ("Surface", "Profile"):
        driver.press(section)
    assert said in session.message and len(session.message) < 400
    assert not list(tmp_path.iterdir())
    after = driver.settled()
    assert (after[:200, 205:] == before[:200, 205:]).all()
