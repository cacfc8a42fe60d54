"""The rough white surface over the skin."""

from __future__ import annotations

from imgui_bundle import imgui

from dermis.human.regions.table import DEFAULT
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import choice, field_choice, field_slider
from dermis.viewer.regions import NO_REGIONS, regional

TITLE = "Surface"
OPEN = True


def draw(desk: Desk) -> None:
    """Numbers of the lobe, and its model."""
    skin, apply = desk.state.scene.skin, desk.state.with_skin
    field_slider(desk, "mix", skin, "mix", apply, 0.0, 1.0)
    if desk.state.scene.head.maps.roughness is not None:
        imgui.text_disabled("roughness is the head's own map")
    else:
        field_slider(desk, "roughness", skin, "roughness", apply, 0.05, 1.0)
    _regions(desk)
    if "regions" in desk.state.head:
        imgui.text_disabled("rho_s is that of the regions")
    else:
        field_slider(desk, "rho_s", skin, "rho_s", apply, 0.0, 1.0)
    field_slider(desk, "oiliness", skin, "oiliness", apply, 0.0, 1.0)
    field_choice(desk, "BRDF", skin, "specular", apply)
    field_choice(desk, "Fresnel", skin, "fresnel", apply)
    field_choice(desk, "energy", skin, "energy", apply)
    field_choice(desk, "directions", skin, "direction", apply)
    field_choice(desk, "reflection", skin, "specular_colour", apply)


def _regions(desk: Desk) -> None:
    """Maps by region of the face; a table of one's own is kept in the list while it is the head's."""
    now = str(desk.state.head.get("regions", NO_REGIONS))
    names = dict.fromkeys((NO_REGIONS, DEFAULT, now))
    choice(desk, "regions", now, names, lambda name: regional(desk.state, name, desk.history.states))
