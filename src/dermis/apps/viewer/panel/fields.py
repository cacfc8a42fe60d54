"""Controls of the panel for fields of pydantic models, with the range, help and label of each field."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from imgui_bundle import imgui, implot

from dermis.apps.viewer.session import Session
from dermis.apps.viewer.state import ViewerState
from dermis.base.errors import DermisError
from dermis.scene.field_errors import field_keywords
from dermis.scene.frozen_model import (
    Colour,
    FrozenModel,
    SliderRange,
    field_choices,
    field_help,
    field_slider_range,
)

StateWithFields = Callable[..., ViewerState]
StateWithValue = Callable[[Any], ViewerState]
_LOG_SLIDER_FLAG = int(imgui.SliderFlags_.logarithmic)
_HDR_COLOUR_FLAGS = int(imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.hdr)
_UNIT_FORMATS = {"_per_mm": "%.3g", "_mm": "%.4g mm", "_degrees": "%.4g°"}  # by unit suffix of the field name
_TALL_LIST_FLAG = int(imgui.ComboFlags_.height_largest)
_TOOLTIP_WIDTH_PX = 260.0
_EMPTY_DISPLAY_NAMES: Mapping[str, str] = MappingProxyType({})
_CUSTOM_VALUE_CHOICE = "own"  # choice of a number or colour instead of a keyword
_PLOT_HEIGHT_PX = 130.0
_PLOT_BASE_FLAGS = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
_PLOT_FLAGS = int(_PLOT_BASE_FLAGS | implot.Flags_.no_inputs | implot.Flags_.no_legend)
_MAX_VISIBLE_LIST_ROWS = 14


@dataclass(frozen=True)
class FieldStyle:
    """Presentation of a field in the panel, where it differs from the defaults derived from the model.

    label : label to show; in "text###key", only the text is shown, and the key identifies the control in
        `Session.positions` and in the undo history
    value_range : range of the slider; None for the range that the model declares for the field
    unit : number by which the value of the field is divided for display; 0.01 displays a fraction in percent
    number_format : printf format of the number
    options : integers to choose from in a drop-down list
    names : text to show for each keyword that the field accepts
    custom_value : function that returns the initial value when the user replaces a keyword by a custom value;
        None if the control offers only keywords
    """

    label: str = ""
    value_range: SliderRange | None = None
    unit: float = 1.0
    number_format: str = ""
    options: tuple[int, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    custom_value: Callable[[Session], object] | None = None


_DEFAULT_STYLE = FieldStyle()
_COLOUR_TYPE: Any = Colour


def draw_fields(
    session: Session,
    pydantic_model: FrozenModel,
    state_with_fields: StateWithFields,
    field_styles: Mapping[str, FieldStyle],
    field_names: Iterable[str] | None = None,
    label_suffix: str = "",
) -> None:
    """Draw a control for each field of a model; fields without a suitable control are skipped.

    state_with_fields : function that returns a state, given the new value of a field as keyword argument
    field_styles : presentation of each field that differs from the defaults, by field name
    field_names : names of the fields to draw; None for all fields
    label_suffix : suffix "##id" that is not shown and distinguishes controls with equal labels
    """
    for name in type(pydantic_model).model_fields if field_names is None else field_names:
        _draw_field(
            session,
            pydantic_model,
            name,
            state_with_fields,
            field_styles.get(name, _DEFAULT_STYLE),
            label_suffix,
        )


def _draw_field(
    session: Session,
    pydantic_model: FrozenModel,
    field_name: str,
    state_with_fields: StateWithFields,
    field_style: FieldStyle,
    label_suffix: str,
) -> None:
    kind, value = type(pydantic_model), getattr(pydantic_model, field_name)
    label = (field_style.label or _field_label(field_name)) + label_suffix
    value_range = field_style.value_range or field_slider_range(kind, field_name) or SliderRange(0.0, 1.0)

    def state_with_value(new_value: object) -> ViewerState:
        return state_with_fields(**{field_name: new_value})

    if keywords := field_keywords(kind, field_name):
        _draw_keywords(session, label, value, keywords, state_with_value, field_style)
        draw_tooltip(field_help(kind, field_name))
        if isinstance(value, str):
            return
    if isinstance(value, bool):
        apply_edited_value(session, label, imgui.checkbox(label, value), state_with_value)
    elif field_style.options:
        draw_combo(
            session,
            label,
            str(value),
            map(str, field_style.options),
            lambda text: state_with_value(int(text)),
        )
    elif isinstance(value, (int, float)):
        unit, convert = field_style.unit, round if isinstance(value, int) else float
        formats = (_UNIT_FORMATS[end] for end in _UNIT_FORMATS if field_name.endswith(end))
        number = field_style.number_format or next(formats, "%.3f")
        displayed = SliderRange(value_range.low / unit, value_range.high / unit, value_range.logarithmic)
        draw_slider(
            session, label, value / unit, lambda new: state_with_value(convert(unit * new)), displayed, number
        )
    elif kind.model_fields[field_name].annotation == _COLOUR_TYPE:
        result = imgui.color_edit3(label, list(value), _HDR_COLOUR_FLAGS)
        apply_edited_value(
            session, label, result, lambda new: state_with_value(tuple(max(0.0, c) for c in new))
        )
    elif isinstance(value, tuple) and value_range.logarithmic:
        result = imgui.slider_float3(
            label, list(value), value_range.low, value_range.high, "%.3g", _LOG_SLIDER_FLAG
        )
        apply_edited_value(
            session,
            label,
            result,
            lambda new: state_with_value(tuple(clamp_to_range(c, value_range) for c in new)),
        )
    elif len(keywords := field_choices(kind, field_name)) > 1:
        draw_combo(session, label, str(value), keywords, state_with_value, field_style.names)
    else:
        return
    draw_tooltip(field_help(kind, field_name))


def _draw_keywords(
    session: Session,
    label: str,
    current_value: object,
    keywords: tuple[str, ...],
    state_with_value: StateWithValue,
    field_style: FieldStyle,
) -> None:
    """Draw a drop-down list of the keywords that a field accepts instead of a number or colour.

    label : label of the field
    current_value : current value of the field: a keyword, a number or a colour
    keywords : keywords to choose from
    state_with_value : function that returns a state, given the new value
    field_style : presentation of the field
    """
    custom_value = field_style.custom_value

    def state_with_keyword(keyword: str) -> ViewerState:
        return state_with_value(
            custom_value(session) if custom_value and keyword == _CUSTOM_VALUE_CHOICE else keyword
        )

    chosen = current_value if isinstance(current_value, str) else _CUSTOM_VALUE_CHOICE
    draw_combo(
        session,
        f"{label} from",
        chosen,
        (*keywords, _CUSTOM_VALUE_CHOICE) if custom_value else keywords,
        state_with_keyword,
    )


def _field_label(field_name: str) -> str:
    """Return the label of a field: its name with spaces, and without a suffix for the unit."""
    for unit in _UNIT_FORMATS:
        field_name = field_name.removesuffix(unit)
    return field_name.replace("_", " ")


def draw_tooltip(tooltip_text: str) -> None:
    """Draw a tooltip for the control drawn last, while the pointer rests on it."""
    if not tooltip_text or not imgui.is_item_hovered() or imgui.is_any_mouse_down():
        return
    imgui.begin_tooltip()
    imgui.push_text_wrap_pos(_TOOLTIP_WIDTH_PX)
    imgui.text_unformatted(tooltip_text)
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()


def draw_rows(label: str, row_count: int, draw_row: Callable[[int], None]) -> None:
    """Draw many controls in a scrollable area; only the visible rows are drawn.

    row_count : number of rows
    draw_row : function that draws a row, given its index
    """
    width, line = imgui.calc_item_width(), imgui.get_frame_height_with_spacing()
    imgui.begin_child(label, imgui.ImVec2(0.0, min(row_count, _MAX_VISIBLE_LIST_ROWS) * line))
    imgui.push_item_width(width)
    clipper = imgui.ListClipper()
    clipper.begin(row_count, line)
    while clipper.step():
        for row in range(clipper.display_start, clipper.display_end):
            draw_row(row)
    imgui.pop_item_width()
    imgui.end_child()


def draw_slider(
    session: Session,
    label: str,
    current_value: float,
    state_with_value: StateWithValue,
    value_range: SliderRange,
    number_format: str,
) -> None:
    """Draw a slider that changes a number of the state.

    current_value : displayed number
    state_with_value : function that returns a state, given the new number
    value_range : range of the slider
    number_format : printf format of the number
    """
    flags = _LOG_SLIDER_FLAG if value_range.logarithmic else 0
    result = imgui.slider_float(label, current_value, value_range.low, value_range.high, number_format, flags)
    apply_edited_value(session, label, result, lambda new: state_with_value(clamp_to_range(new, value_range)))


def clamp_to_range(unclamped_value: float, value_range: SliderRange) -> float:
    """Clamp a value, such as one that the user has typed, to the range of a slider."""
    return min(value_range.high, max(value_range.low, unclamped_value))


def apply_edited_value(
    session: Session, label: str, change_and_value: tuple[bool, Any], state_with_value: StateWithValue
) -> None:
    """Apply the new value of a control to the state; all changes of one drag are undone together.

    label : label of the control; it identifies the changes that belong to one drag
    change_and_value : whether the control has changed, and its value
    state_with_value : function that returns a state, given the new value
    """
    record_position(session, label)
    is_changed, new_value = change_and_value
    if is_changed:
        run_action(session, lambda: session.change(state_with_value(new_value), f"hold {label}"))
    if imgui.is_item_deactivated():
        session.history.end_gesture()


def draw_combo(
    session: Session,
    label: str,
    current_name: str,
    names: Iterable[str],
    state_with_value: StateWithValue,
    display_names: Mapping[str, str] = _EMPTY_DISPLAY_NAMES,
) -> None:
    """Draw a drop-down list, and change the state when a name is chosen.

    current_name : name that is selected now
    names : names to choose from; "" draws a separator
    state_with_value : function that returns a state, given the chosen name
    display_names : text to show for each name whose text differs from the name
    """
    chosen = choose_name(session, label, current_name, names, display_names)
    if chosen is not None:
        run_action(session, lambda: session.change(state_with_value(chosen)))


def choose_name(
    session: Session, label: str, current_name: str, names: Iterable[str], display_names: Mapping[str, str]
) -> str | None:
    """Draw a drop-down list; return the name that was clicked, or None if no name was clicked.

    current_name : name that is selected now
    names : names to choose from; "" draws a separator
    display_names : text to show for each name whose text differs from the name
    """
    chosen = None
    if not imgui.begin_combo(label, display_names.get(current_name, current_name), _TALL_LIST_FLAG):
        record_position(session, label)
        return None
    for name in names:
        if not name:
            imgui.separator()
            continue
        clicked, _ = imgui.selectable(f"{display_names.get(name, name)}###{name}", name == current_name)
        record_position(session, f"{_label_key(label)}/{name}")
        if clicked and name != current_name:
            chosen = name
    imgui.end_combo()
    return chosen


def draw_button(session: Session, label: str) -> bool:
    """Draw a button; return whether it was pressed."""
    pressed = imgui.button(label)
    record_position(session, label)
    return bool(pressed)


def begin_plot(
    label: str, axis_labels: tuple[str, str], x_range: tuple[float, float], highest_value: float
) -> bool:
    """Begin a plot; return whether the plot is visible.

    axis_labels : labels of the horizontal and of the vertical axis
    x_range : ends of the horizontal axis
    highest_value : highest value to plot; the vertical axis ends slightly above it
    """
    if not implot.begin_plot(f"##{label}", imgui.ImVec2(-1.0, _PLOT_HEIGHT_PX), _PLOT_FLAGS):
        return False
    hidden = int(implot.AxisFlags_.no_tick_labels) if axis_labels[0] == "frames" else 0
    implot.setup_axes(*axis_labels, hidden, 0)
    implot.setup_axes_limits(*x_range, 0.0, 1.1 * highest_value, int(imgui.Cond_.always))
    return True


def record_position(session: Session, label: str) -> None:
    """Record the position of the control drawn last, so that scripts can click on the control.

    The position is near the left end of the control, because the label may take up its right part.

    label : label of the control; its part after "###", if any, is the key under which the position is stored
    """
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    x = float(low.x) + min(20.0, 0.5 * float(high.x - low.x))
    session.positions[_label_key(label)] = x, 0.5 * float(low.y + high.y)


def _label_key(control_label: str) -> str:
    return control_label.rpartition("###")[2]


def run_action(session: Session, action: Callable[[], None]) -> None:
    """Run an action and show errors as a message over the picture."""
    try:
        action()
    except DermisError as error:
        session.message = str(error)
    except Exception as error:
        session.report_error("This cannot be done", error)


SURFACE_STYLES = {
    "mix": FieldStyle("colour before blur###mix"),
    "roughness": FieldStyle("roughness m###roughness"),
    "rho_s": FieldStyle("specular strength ρ_s###rho_s"),
    "specular": FieldStyle(
        "specular BRDF###BRDF",
        names={
            "kelemen": "Kelemen, Szirmay-Kalos",
            "torrance-sparrow": "Torrance-Sparrow",
            "torrance-sparrow-smith": "Torrance-Sparrow, Smith's G",
            "blinn-phong": "Blinn-Phong",
            "blinn-phong-plain": "Blinn-Phong, not normalised",
            "phong": "Phong",
            "phong-plain": "Phong, not normalised",
            "two-lobe": "two lobes",
            "kelemen-direct": "Kelemen, without table",
        },
    ),
    "fresnel": FieldStyle("Fresnel###Fresnel", names={"schlick": "Schlick", "exact": "exact dielectric"}),
    "specular_colour": FieldStyle("reflection colour###reflection", names={"wrong": "albedo (wrong)"}),
    "energy": FieldStyle("energy conserved###energy", names={"none": "no", "published": "as published"}),
    "direction": FieldStyle("exit direction###direction", names={"lambertian": "Lambertian"}),
}
"""Presentation of the surface fields of `Skin`."""

ALBEDO_STYLES = {
    "albedo": FieldStyle("colour by###colour from", names={"map": "albedo map", "profile": "profile"})
}
"""Presentation of the field `albedo` of `Skin`."""

TECHNIQUE_STYLES = {
    "technique": FieldStyle(
        names={"none": "none (dry skin)", "one-blur": "one Gaussian", "gpu-gems-3": "GPU Gems 3"}
    ),
    "stretch": FieldStyle(
        "stretch correction###stretch", names={"full": "stretch and shear", "axes": "along u and v"}
    ),
    "seams": FieldStyle("uv seams###seams", names={"stitch": "stitched", "none": "left open"}),
    "transmission": FieldStyle("translucency###transmission", names={"thin": "thin parts"}),
    "occlusion": FieldStyle(
        "ambient occlusion###occlusion", names={"baked": "as posed", "rest": "of the rest pose"}
    ),
    "strands": FieldStyle("hairs###strands"),
    "tone": FieldStyle("tone curve###tone", names={"none": "none (linear)", "neutral": "Khronos neutral"}),
    "gamma": FieldStyle(names={"right": "gamma-correct", "wrong": "not gamma-correct"}),
}
"""Presentation of the fields of `Settings`."""

LAYER_STYLES = {
    "thickness_mm": FieldStyle("thickness###thickness"),
    "absorption_per_mm": FieldStyle("absorption σ_a###absorption"),
    "scattering_per_mm": FieldStyle("scattering σ_s'###scattering"),
}
"""Presentation of the fields of `TissueLayer`."""

LIGHT_STYLES = {
    "irradiance": FieldStyle("colour###irradiance"),
    "softness_mm": FieldStyle("shadow softness###softness"),
    "shadows": FieldStyle("casts shadows###shadows"),
    "angle_degrees": FieldStyle("angular size###angle"),
}
"""Presentation of the fields of lights."""

LIGHT_KIND_NAMES = {
    "point": "point light",
    "spot": "spotlight",
    "rectangle": "softbox (rectangle)",
    "sphere": "globe (sphere)",
    "directional": "sun (directional)",
    "stripe": "laser stripe",
}
"""Display names of the kinds of lights."""

PROFILE_NAMES = {
    "gpu-gems-3": "GPU Gems 3",
    "skin1": "skin 1 (measured)",
    "skin2": "skin 2 (measured)",
    "dj3": "three layers of skin",
    "spectral": "spectral skin",
    "light": "light skin",
    "medium": "medium skin",
    "dark": "dark skin",
    "skimmilk": "skim milk",
    "wholemilk": "whole milk",
    "chicken1": "chicken 1",
    "chicken2": "chicken 2",
}
"""Display names of profiles: first those of skin, then some of other media."""
