"""Sections about the skin: the diffusion profile and what it is made of, and the surface."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from imgui_bundle import imgui, implot

from dermis.apps.viewer.panel.fields import (
    ALBEDO,
    LAYER,
    PROFILES,
    SURFACE,
    Style,
    attempt,
    begin_plot,
    button,
    combo,
    draw_fields,
    record_position,
)
from dermis.apps.viewer.session import Session, apply_regions
from dermis.apps.viewer.state import ViewerState, changed
from dermis.base.errors import DermisError
from dermis.human.regions.zones import DEFAULT
from dermis.optics.pigments.parameters import DEFAULT_SKIN, DEFAULT_STRUCTURE, SKINS
from dermis.optics.profiles import PUBLISHED, preset_names
from dermis.scene.head_table import AUTO, NO_REGIONS, names_regions
from dermis.scene.plain import fields_under
from dermis.scene.skin import MOST_LAYERS, Pigments, Skin, TissueLayer
from dermis.scene.tissue import layers_of

Layers = tuple[TissueLayer, ...]
_PROFILE_FIELDS = ("profile", "profile_map", "other_profiles", "albedo", "pigments", "layers")
_BLOODY_STRUCTURE = "donner2008"  # the one with blood in its epidermis
_DERMIS = ("blood", "oxygen")
_PERCENT = {name: Style(unit=0.01, form="%.2f %%") for name in Pigments.model_fields if "_" not in name}
_PIGMENTS = _PERCENT | {
    "structure": Style("layers"),
    "eumelanin": Style("eumelanin share###eumelanin", unit=0.01, form="%.2f %%"),
    "oxygen": Style("oxygen saturation###oxygen", unit=0.01, form="%.2f %%"),
    "epidermis_mm": Style("thickness"),
    "epidermal_blood": Style("blood##epidermis", unit=0.01, form="%.2f %%"),
}
_SKINS = (PUBLISHED, "skin1", "skin2", "dj3", *SKINS)
_NEW_MM = 0.2
_CHANNELS = ((0.9, 0.35, 0.3), (0.35, 0.8, 0.4), (0.4, 0.55, 1.0))
_RADII_MM = np.geomspace(0.01, 30.0, 160)


def draw_profile(session: Session) -> None:
    """The profile's name, where its colour comes from, and what it is made of."""
    skin, with_skin = session.state.scene.skin, session.state.with_skin

    def take(name: str) -> ViewerState:
        return with_skin(profile=name, pigments=None, layers=())

    foods = (name for name in preset_names() if name not in _SKINS)  # and other materials
    combo(session, "profile", skin.profile, (*_SKINS, "", *foods), take, PROFILES)
    draw_fields(session, skin, with_skin, ALBEDO, ["albedo"])
    if skin.profile in SKINS:
        _pigments(session, skin)
    elif layers := skin.layers or _named_layers(skin.profile):
        _stack(session, layers)
    else:
        imgui.text_disabled("a sum of Gaussians, without layers")
    if skin.has_own_tissue and button(session, "reset"):
        session.change(with_skin(pigments=None, layers=()))
    _plot_profile(session)


def draw_surface(session: Session) -> None:
    """All that the section above leaves of the skin's fields: a new one appears here."""
    state, known = session.state, session.history.states
    replaced = {
        "rho_s": names_regions(state.head) and "rho_s comes from the regions",
    }
    for name in fields_under("", type(state.scene.skin)):
        if name == "rho_s":
            now = str(state.head.get("regions", AUTO))
            names = dict.fromkeys((AUTO, NO_REGIONS, DEFAULT, now))
            combo(session, "regions", now, names, lambda name: apply_regions(state, name, known))
        if text := replaced.get(name):
            imgui.text_disabled(text)
        elif name not in _PROFILE_FIELDS:
            draw_fields(session, state.scene.skin, state.with_skin, SURFACE, [name])


def _pigments(session: Session, skin: Skin) -> None:
    given = skin.pigments or Pigments()
    own = SKINS.get(skin.profile, DEFAULT_SKIN)
    numbers = [name for name in Pigments.model_fields if name != "structure"]
    defaults = {name: getattr(own, name) for name in numbers} | {"structure": DEFAULT_STRUCTURE}
    values = Pigments(**defaults | given.model_dump(exclude_none=True))
    apply = session.state.with_pigments
    draw_fields(session, values, apply, _PIGMENTS, ["structure"])
    if values.structure != _BLOODY_STRUCTURE:
        numbers.remove("epidermal_blood")
    imgui.separator_text("epidermis")
    draw_fields(session, values, apply, _PIGMENTS, [name for name in numbers if name not in _DERMIS])
    imgui.separator_text("dermis")
    draw_fields(session, values, apply, _PIGMENTS, _DERMIS)


def _plot_profile(session: Session) -> None:
    """Plot r R(r) of the Gaussians that the frame blurs with, by channel."""
    try:
        profile = session.studio.renderer.profile_of(session.state.scene.skin)
    except DermisError:  # the message over the picture says why
        return
    r, values = _RADII_MM, profile.radiant_exitance(_RADII_MM)
    highest = float((r[:, None] * values).max())
    if not begin_plot("profile", ("r [mm]", "r R(r) [1/mm]"), (r[0], r[-1]), max(highest, 1e-9)):
        return
    implot.setup_axis_scale(int(implot.ImAxis_.x1), int(implot.Scale_.log10))
    for k, (name, colour) in enumerate(zip(("red", "green", "blue"), _CHANNELS, strict=True)):
        spec = implot.Spec()
        spec.line_color, spec.line_weight = imgui.ImVec4(*colour, 1.0), 1.5
        implot.plot_line(name, r, np.ascontiguousarray(r * values[:, k]), spec)
    implot.end_plot()


@lru_cache(maxsize=16)
def _named_layers(profile: str) -> tuple[TissueLayer, ...]:
    """Layers of a named profile, none for a table of Gaussians; files are not read again in each frame."""
    try:
        return layers_of(Skin(profile=profile))
    except DermisError:  # a table, or a file that the message over the picture is about
        return ()


def _stack(session: Session, layers: Layers) -> None:
    """The layers, topmost first; each opens to its numbers."""
    for index, layer in enumerate(layers):
        depth = "semi-infinite" if layer.thickness_mm is None else f"{layer.thickness_mm:.3g} mm"
        is_open = imgui.tree_node_ex(f"layer{index}", 0, f"{index + 1} {layer.name}, {depth}")
        record_position(session, f"layer {index + 1}")
        if is_open:
            _layer(session, layers, index)
            imgui.tree_pop()


def _layer(session: Session, layers: Layers, index: int) -> None:
    layer, suffix = layers[index], f"##{index + 1}"

    def apply(**fields: object) -> ViewerState:
        return _with_layers(session, layers, index, changed(layer, **fields))

    draw_fields(session, layer, apply, LAYER, suffix=suffix)
    imgui.text_disabled("red, green, blue [1/mm]")
    if len(layers) < MOST_LAYERS and button(session, f"add above{suffix}"):
        copy = changed(layer, thickness_mm=layer.thickness_mm or _NEW_MM)
        attempt(session, lambda: session.change(_with_layers(session, layers, index, copy, layer)))
    imgui.same_line()
    if len(layers) > 1 and button(session, f"remove{suffix}"):
        attempt(session, lambda: session.change(_with_layers(session, layers, index)))


def _with_layers(session: Session, layers: Layers, index: int, *instead: TissueLayer) -> ViewerState:
    """The state with other layers in place of one."""
    stack = (*layers[:index], *instead, *layers[index + 1 :])
    return session.state.with_skin(layers=[layer.model_dump() for layer in stack])
