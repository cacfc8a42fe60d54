"""Controls of the panel, and the one that a field of a model gets: its range and help come from the model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from imgui_bundle import imgui

from dermis.errors import DermisError
from dermis.scene.plain import Colour, Plain, Range, choices_of, help_of, range_of
from dermis.viewer.session import Session
from dermis.viewer.state import ViewerState

Apply = Callable[..., ViewerState]
_LOG = int(imgui.SliderFlags_.logarithmic)
_FORMS = {"_per_mm": "%.3g", "_mm": "%.4g mm", "_degrees": "%.4g°"}  # by the unit that a name ends in
_ALL_NAMES = int(imgui.ComboFlags_.height_largest)
_TOOLTIP_WIDTH = 260.0


@dataclass(frozen=True)
class Style:
    """How a field is shown where the panel departs from the model.

    label : instead of the field's name
    span : range of the slider, instead of the model's
    unit : of the numbers shown, in units of the field
    form : printf format of the numbers shown
    options : the whole numbers to choose from
    """

    label: str = ""
    span: Range | None = None
    unit: float = 1.0
    form: str = ""
    options: tuple[int, ...] = ()


_PLAIN = Style()
_COLOUR: Any = Colour


def draw_fields(
    session: Session,
    values: Plain,
    apply: Apply,
    styles: Mapping[str, Style],
    names: Iterable[str] | None = None,
    suffix: str = "",
) -> None:
    """A control for each field of a model; fields whose type has none are skipped.

    apply : makes a state from a field's new value, given by name
    names : of the fields, all of them by default
    suffix : "##id" to tell controls with the same label apart
    """
    for name in type(values).model_fields if names is None else names:
        _draw_field(session, values, name, apply, styles.get(name, _PLAIN), suffix)


def _draw_field(session: Session, values: Plain, name: str, apply: Apply, style: Style, suffix: str) -> None:
    kind, value = type(values), getattr(values, name)
    label = (style.label or _label_of(name)) + suffix
    span = style.span or range_of(kind, name) or Range(0.0, 1.0)

    def put(found: Any) -> ViewerState:
        return apply(**{name: found})

    if isinstance(value, bool):
        checkbox(session, label, value, put)
    elif style.options:
        combo(session, label, str(value), map(str, style.options), lambda text: put(int(text)))
    elif isinstance(value, (int, float)):
        unit, exact = style.unit, round if isinstance(value, int) else float
        form = style.form or next((_FORMS[end] for end in _FORMS if name.endswith(end)), "%.3f")
        shown = Range(span.low / unit, span.high / unit, span.logarithmic)
        slider(session, label, value / unit, lambda found: put(exact(unit * found)), shown, form)
    elif kind.model_fields[name].annotation == _COLOUR:
        colour(session, label, value, put)
    elif isinstance(value, tuple) and span.logarithmic:
        rgb_sliders(session, label, value, put, span)
    elif len(words := choices_of(kind, name)) > 1:
        combo(session, label, str(value), words, put)
    else:
        return
    _explain(help_of(kind, name))


def _label_of(name: str) -> str:
    """The field's name without its unit."""
    for unit in _FORMS:
        name = name.removesuffix(unit)
    return name.replace("_", " ")


def _explain(text: str) -> None:
    """A tooltip for the control drawn last."""
    if not text or not imgui.is_item_hovered() or imgui.is_any_mouse_down():
        return
    imgui.begin_tooltip()
    imgui.push_text_wrap_pos(_TOOLTIP_WIDTH)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()


def slider(
    session: Session,
    label: str,
    value: float,
    apply: Callable[[float], ViewerState],
    span: Range,
    form: str = "%.3f",
) -> None:
    """A number on a scale; a drag is one step of the undo history."""
    low, high, logarithmic = span
    flags = _LOG if logarithmic else 0
    moved, found = imgui.slider_float(label, value, low, high, form, flags)
    _held(session, label, moved, lambda: apply(min(high, max(low, found))))


def rgb_sliders(
    session: Session, label: str, value: tuple[float, ...], apply: Callable[[Any], ViewerState], span: Range
) -> None:
    """Red, green and blue on scales; a drag is one step of the undo history."""
    low, high, logarithmic = span
    flags = _LOG if logarithmic else 0
    moved, found = imgui.slider_float3(label, list(value), low, high, "%.3g", flags)
    _held(session, label, moved, lambda: apply(tuple(min(high, max(low, one)) for one in found)))


def colour(
    session: Session, label: str, value: tuple[float, ...], apply: Callable[[Any], ViewerState]
) -> None:
    """Linear Rec. 709, above 1 for lights; a drag is one step of the undo history."""
    flags = int(imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.hdr)
    moved, found = imgui.color_edit3(label, list(value), flags)
    _held(session, label, moved, lambda: apply(tuple(max(0.0, c) for c in found)))


def _held(session: Session, label: str, moved: bool, make: Callable[[], ViewerState]) -> None:
    """Apply the change of a control that is held down, as one gesture."""
    record_position(session, label)
    if moved:
        attempt(session, lambda: session.change(make(), f"slide {label}"))
    if imgui.is_item_deactivated():
        session.history.end_gesture()


def combo(
    session: Session, label: str, current: str, names: Iterable[str], apply: Callable[[str], ViewerState]
) -> None:
    """One of some names."""
    if not imgui.begin_combo(label, current, _ALL_NAMES):
        record_position(session, label)
        return
    for name in names:
        clicked, _ = imgui.selectable(name, name == current)
        record_position(session, f"{label}/{name}")
        if clicked and name != current:
            attempt(session, lambda chosen=name: session.change(apply(chosen)))  # type: ignore[misc]
    imgui.end_combo()


def checkbox(session: Session, label: str, value: bool, apply: Callable[[bool], ViewerState]) -> None:
    """Yes or no."""
    moved, found = imgui.checkbox(label, value)
    record_position(session, label)
    if moved:
        attempt(session, lambda: session.change(apply(found)))


def button(session: Session, label: str) -> bool:
    """Whether it was pressed."""
    pressed = imgui.button(label)
    record_position(session, label)
    return bool(pressed)


def grey_text(text: str) -> None:
    """A grey line, wrapped at the panel's edge."""
    imgui.push_style_color(int(imgui.Col_.text), imgui.get_style_color_vec4(int(imgui.Col_.text_disabled)))
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def record_position(session: Session, label: str) -> None:
    """Record where the item drawn last is: a point in its left part, which is never its label."""
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    x = float(low.x) + min(20.0, 0.5 * float(high.x - low.x))
    session.positions[label] = x, 0.5 * float(low.y + high.y)


def attempt(session: Session, act: Callable[[], None]) -> None:
    """Run an action; an error becomes the message over the picture."""
    try:
        act()
    except DermisError as error:
        session.messages.said = str(error)
