"""Sections of the panel for the skin: diffusion profile, tissue and surface."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from imgui_bundle import imgui, implot

from dermis.apps.viewer.panel.fields import (
    ALBEDO_STYLES,
    LAYER_STYLES,
    PROFILE_NAMES,
    SURFACE_STYLES,
    FieldStyle,
    begin_plot,
    draw_button,
    draw_combo,
    draw_fields,
    draw_tooltip,
    record_position,
    run_action,
)
from dermis.apps.viewer.session import Session, with_region_table
from dermis.apps.viewer.state import ViewerState, validated_copy
from dermis.base.errors import DermisError
from dermis.human.regions.region_table import DEFAULT_TABLE_NAME
from dermis.images.skin_tone import SKIN_CLASS_DISCLAIMER, skin_tone
from dermis.optics.pigments.parameters import DEFAULT_SKIN, DEFAULT_STRUCTURE, SKINS
from dermis.optics.profiles import PUBLISHED_PRESET, preset_names
from dermis.scene.frozen_model import fields_under
from dermis.scene.head_table import AUTO, NO_REGIONS, has_region_table
from dermis.scene.skin import MAX_LAYERS, Pigments, Skin, TissueLayer
from dermis.scene.tissue import tissue_layers

Layers = tuple[TissueLayer, ...]
_PROFILE_FIELDS = ("profile", "profile_map", "other_profiles", "albedo", "pigments", "layers")
_EPIDERMAL_BLOOD_STRUCTURE = "donner2008"  # the only structure with blood in the epidermis
_DERMAL_PIGMENT_FIELDS = ("blood", "oxygen")
_PERCENT_STYLES = {
    name: FieldStyle(unit=0.01, number_format="%.2f %%") for name in Pigments.model_fields if "_" not in name
}
_PIGMENT_STYLES = _PERCENT_STYLES | {
    "structure": FieldStyle("layers"),
    "eumelanin": FieldStyle("eumelanin fraction###eumelanin", unit=0.01, number_format="%.2f %%"),
    "oxygen": FieldStyle("oxygen saturation###oxygen", unit=0.01, number_format="%.2f %%"),
    "epidermis_mm": FieldStyle("thickness"),
    "epidermal_blood": FieldStyle("blood##epidermis", unit=0.01, number_format="%.2f %%"),
    "baseline": FieldStyle("other tissue###baseline", unit=0.01, number_format="%.0f %%"),
}
_SKIN_PROFILES = (PUBLISHED_PRESET, "skin1", "skin2", "dj3", *SKINS)
_NEW_LAYER_THICKNESS_MM = 0.2
_CHANNEL_COLOURS = ((0.9, 0.35, 0.3), (0.35, 0.8, 0.4), (0.4, 0.55, 1.0))
_PLOTTED_RADII_MM = np.geomspace(0.01, 30.0, 160)


def draw_profile(session: Session) -> None:
    """Draw the controls of the diffusion profile: its name, its colour, and its pigments or layers."""
    skin, with_skin = session.state.scene.skin, session.state.with_skin

    def state_with_profile(profile_name: str) -> ViewerState:
        return with_skin(profile=profile_name, pigments=None, layers=())

    other_media = (name for name in preset_names() if name not in _SKIN_PROFILES)
    draw_combo(
        session,
        "profile",
        skin.profile,
        (*_SKIN_PROFILES, "", *other_media),
        state_with_profile,
        PROFILE_NAMES,
    )
    draw_fields(session, skin, with_skin, ALBEDO_STYLES, ["albedo"])
    if skin.profile in SKINS:
        _draw_pigments(session, skin)
    elif layers := skin.layers or _profile_layers(skin.profile):
        _draw_layers(session, layers)
    else:
        imgui.text_disabled("a sum of Gaussians, without layers")
    if skin.overrides_tissue and draw_button(session, "reset"):
        session.change(with_skin(pigments=None, layers=()))
    _plot_profile(session)


def draw_surface(session: Session) -> None:
    """Draw controls for all fields of `Skin` that the profile section does not show."""
    state, earlier_states = session.state, session.history.states
    for name in fields_under("", type(state.scene.skin)):
        if name == "rho_s":
            current = str(state.head.get("regions", AUTO))
            names = dict.fromkeys((AUTO, NO_REGIONS, DEFAULT_TABLE_NAME, current))
            draw_combo(
                session,
                "regions",
                current,
                names,
                lambda name: with_region_table(state, name, earlier_states),
            )
        if name == "rho_s" and has_region_table(state.head):
            imgui.text_disabled("rho_s is set by the regions")
        elif name not in _PROFILE_FIELDS:
            draw_fields(session, state.scene.skin, state.with_skin, SURFACE_STYLES, [name])
    _draw_skin_tone_text(session)


def _draw_skin_tone_text(session: Session) -> None:
    """Display a description of the mean colour of the head's skin."""
    colour = session.state.scene.head.maps.mean_colour
    if colour is not None:
        imgui.text_disabled(skin_tone(colour).as_text())
        draw_tooltip(SKIN_CLASS_DISCLAIMER)


def _draw_pigments(session: Session, skin: Skin) -> None:
    pigments = skin.pigments or Pigments()
    preset = SKINS.get(skin.profile, DEFAULT_SKIN)
    numbers = [name for name in Pigments.model_fields if name != "structure"]
    defaults = {name: getattr(preset, name) for name in numbers} | {"structure": DEFAULT_STRUCTURE}
    values = Pigments(**defaults | pigments.model_dump(exclude_none=True))
    state_with_fields = session.state.with_pigments
    draw_fields(session, values, state_with_fields, _PIGMENT_STYLES, ["structure"])
    if values.structure != _EPIDERMAL_BLOOD_STRUCTURE:
        numbers.remove("epidermal_blood")
    imgui.separator_text("epidermis")
    draw_fields(
        session,
        values,
        state_with_fields,
        _PIGMENT_STYLES,
        [name for name in numbers if name not in _DERMAL_PIGMENT_FIELDS],
    )
    imgui.separator_text("dermis")
    draw_fields(session, values, state_with_fields, _PIGMENT_STYLES, _DERMAL_PIGMENT_FIELDS)


def _plot_profile(session: Session) -> None:
    """Plot r R(r), the diffusion profile R times the radius r, for red, green and blue.

    The plotted profile is the sum of Gaussians that the renderer uses to blur light.
    """
    try:
        profile = session.view_renderer.renderer.skin_profile(session.state.scene.skin)
    except DermisError:  # reported by the message over the picture
        return
    r, values = _PLOTTED_RADII_MM, profile.radiant_exitance(_PLOTTED_RADII_MM)
    highest = float((r[:, None] * values).max())
    if not begin_plot("profile", ("r [mm]", "r R(r) [1/mm]"), (r[0], r[-1]), max(highest, 1e-9)):
        return
    implot.setup_axis_scale(int(implot.ImAxis_.x1), int(implot.Scale_.log10))
    for k, (name, colour) in enumerate(zip(("red", "green", "blue"), _CHANNEL_COLOURS, strict=True)):
        spec = implot.Spec()
        spec.line_color, spec.line_weight = imgui.ImVec4(*colour, 1.0), 1.5
        implot.plot_line(name, r, np.ascontiguousarray(r * values[:, k]), spec)
    implot.end_plot()


@lru_cache(maxsize=16)
def _profile_layers(profile_name: str) -> tuple[TissueLayer, ...]:
    """Return the tissue layers of a named profile, or () if the profile is a sum of Gaussians."""
    try:
        return tissue_layers(Skin(profile=profile_name))
    except (
        DermisError
    ):  # a table of Gaussians, or an invalid file, which the message over the picture reports
        return ()


def _draw_layers(session: Session, tissue_layers: Layers) -> None:
    """Draw controls for the coefficients of all tissue layers, starting with the topmost layer."""
    for index, layer in enumerate(tissue_layers):
        depth = "semi-infinite" if layer.thickness_mm is None else f"{layer.thickness_mm:.3g} mm"
        is_open = imgui.tree_node_ex(f"layer{index}", 0, f"{index + 1} {layer.name}, {depth}")
        record_position(session, f"layer {index + 1}")
        if is_open:
            _draw_layer(session, tissue_layers, index)
            imgui.tree_pop()


def _draw_layer(session: Session, tissue_layers: Layers, layer_index: int) -> None:
    layer, label_suffix = tissue_layers[layer_index], f"##{layer_index + 1}"

    def state_with_fields(**fields: object) -> ViewerState:
        return _replace_layer(session, tissue_layers, layer_index, validated_copy(layer, **fields))

    draw_fields(session, layer, state_with_fields, LAYER_STYLES, label_suffix=label_suffix)
    imgui.text_disabled("red, green, blue [1/mm]")
    if len(tissue_layers) < MAX_LAYERS and draw_button(session, f"add above{label_suffix}"):
        copy = validated_copy(layer, thickness_mm=layer.thickness_mm or _NEW_LAYER_THICKNESS_MM)
        run_action(
            session, lambda: session.change(_replace_layer(session, tissue_layers, layer_index, copy, layer))
        )
    imgui.same_line()
    if len(tissue_layers) > 1 and draw_button(session, f"remove{label_suffix}"):
        run_action(session, lambda: session.change(_replace_layer(session, tissue_layers, layer_index)))


def _replace_layer(
    session: Session, tissue_layers: Layers, layer_index: int, *new_layers: TissueLayer
) -> ViewerState:
    """Return the state in which one tissue layer is replaced by zero or more new layers."""
    all_layers = (*tissue_layers[:layer_index], *new_layers, *tissue_layers[layer_index + 1 :])
    return session.state.with_skin(layers=[layer.model_dump() for layer in all_layers])
