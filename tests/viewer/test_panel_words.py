"""Labels of the panel: common terms for all fields and values, short enough to be read."""

from __future__ import annotations

import pytest
from offscreen_input import InputDriver

from dermis.apps.viewer.panel import fields
from dermis.apps.viewer.panel.fields import FieldStyle
from dermis.optics.profiles import preset_names
from dermis.scene.frozen_model import FrozenModel, field_choices
from dermis.scene.lights import LIGHTS
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin, TissueLayer

KINDS = {
    Skin: fields.SURFACE_STYLES | fields.ALBEDO_STYLES,
    Settings: fields.TECHNIQUE_STYLES,
    TissueLayer: fields.LAYER_STYLES,
}


@pytest.mark.parametrize("kind", KINDS)
def test_labels_refer_to_existing_fields_and_choices(kind: type[FrozenModel]) -> None:
    for name, style in KINDS[kind].items():
        assert name in kind.model_fields
        assert set(style.names) <= set(field_choices(kind, name)), name


def test_labels_refer_to_existing_light_types() -> None:
    assert set(fields.LIGHT_KIND_NAMES) <= set(LIGHTS)
    assert all(any(name in kind.model_fields for kind in LIGHTS.values()) for name in fields.LIGHT_STYLES)
    assert set(fields.PROFILE_NAMES) <= set(preset_names())


def test_labels_fit_beside_their_controls(driver: InputDriver) -> None:
    from imgui_bundle import imgui

    driver.canvas.set_logical_size(1280, 480)
    driver.frame()
    room = driver.viewer.panel.label_width
    styles: list[FieldStyle] = [one for table in KINDS.values() for one in table.values()]
    labels = [style.label.partition("###")[0] for style in (*styles, *fields.LIGHT_STYLES.values())]
    wide = {label: imgui.calc_text_size(label).x for label in labels}
    driver.canvas.set_logical_size(400, 480)
    assert {label for label, width in wide.items() if width > room} == set()


def test_food_media_are_listed_after_skins(driver: InputDriver) -> None:
    session = driver.viewer.session
    driver.press("profile")
    offered = {name.partition("/")[2]: y for name, (_, y) in session.positions.items() if "profile/" in name}
    assert set(offered) == set(preset_names())
    skins = {"gpu-gems-3", "skin1", "skin2", "dj3", "spectral", "light", "medium", "dark"}
    lowest = max(offered[name] for name in skins)
    assert all(y > lowest for name, y in offered.items() if name not in skins)
    driver.click(session.positions["profile/skimmilk"])
    assert session.state.scene.skin.profile == "skimmilk"


@pytest.mark.parametrize("kind", LIGHTS)
def test_light_of_each_type_is_added_copied_and_removed(kind: str, driver: InputDriver) -> None:
    session = driver.viewer.session
    rest = session.state.scene.lights
    for section in ("Profile", "Surface", "Light"):
        driver.press(section)
    driver.choose("add", kind)
    driver.frame()
    *before, added = session.state.scene.lights
    assert tuple(before) == tuple(rest) and added.kind == kind
    driver.press("copy")
    assert session.state.scene.lights[-2:] == (added, added) and session.controls.light == len(rest) + 1
    for _ in range(2):
        driver.press("remove")
    assert session.state.scene.lights == tuple(rest)
    driver.settled()
    assert session.message == ""
    for section in ("Light", "Surface", "Profile"):
        driver.press(section)
