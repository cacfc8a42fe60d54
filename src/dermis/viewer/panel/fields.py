"""Sliders, choices and colours for the fields of plain settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from imgui_bundle import imgui

from dermis.errors import DermisError
from dermis.scene.plain import Plain, choices_of
from dermis.viewer.desk import Desk
from dermis.viewer.panel.meanings import explain
from dermis.viewer.state import ViewerState

Apply = Callable[..., ViewerState]
_LOG = imgui.SliderFlags_.logarithmic
_ALL_NAMES = int(imgui.ComboFlags_.height_largest)


def slider(
    desk: Desk,
    label: str,
    value: float,
    apply: Callable[[float], ViewerState],
    low: float,
    high: float,
    *,
    log: bool = False,
    form: str = "%.3f",
) -> None:
    """A number on a scale; the whole drag is one step of the history."""
    flags = int(_LOG) if log else 0
    moved, found = imgui.slider_float(label, value, low, high, form, flags)
    note_place(desk, label)
    if moved:
        attempt(desk, lambda: desk.change(apply(min(high, max(low, found))), f"slide {label}"))
    if imgui.is_item_deactivated():
        desk.history.end_gesture()


def choice(
    desk: Desk, label: str, current: str, names: Iterable[str], apply: Callable[[str], ViewerState]
) -> None:
    """One of some names."""
    is_open = imgui.begin_combo(label, current, _ALL_NAMES)
    if not is_open:
        note_place(desk, label)
        return
    for name in names:
        clicked, _ = imgui.selectable(name, name == current)
        note_place(desk, f"{label}/{name}")
        if clicked and name != current:
            attempt(desk, lambda chosen=name: desk.change(apply(chosen)))  # type: ignore[misc]
    imgui.end_combo()


def field_choice(desk: Desk, label: str, values: Plain, field: str, apply: Apply) -> None:
    """One of the words that a field may be."""
    names = words_of(type(values), field)
    choice(desk, label, str(getattr(values, field)), names, lambda name: apply(**{field: name}))
    explain(type(values), field)


def words_of(kind: type[Plain], field: str) -> tuple[str, ...]:
    """The words of a field that is a literal."""
    return choices_of(kind, field)


def field_slider(
    desk: Desk, label: str, values: Plain, field: str, apply: Apply, low: float, high: float, **options: Any
) -> None:
    """A number of some settings on a scale."""
    value = float(getattr(values, field))
    slider(desk, label, value, lambda found: apply(**{field: found}), low, high, **options)
    explain(type(values), field)


def triple(
    desk: Desk,
    label: str,
    value: tuple[float, float, float],
    apply: Callable[[tuple[float, ...]], ViewerState],
    low: float,
    high: float,
) -> None:
    """Red, green and blue on logarithmic scales; the whole drag is one step of the history."""
    moved, found = imgui.slider_float3(label, list(value), low, high, "%.3g", int(_LOG))
    note_place(desk, label)
    if moved:
        kept = tuple(min(high, max(low, one)) for one in found)
        attempt(desk, lambda: desk.change(apply(kept), f"slide {label}"))
    if imgui.is_item_deactivated():
        desk.history.end_gesture()


def whole(
    desk: Desk, label: str, value: int, options: Iterable[int], apply: Callable[[int], ViewerState]
) -> None:
    """One of some whole numbers."""
    choice(desk, label, str(value), map(str, options), lambda text: apply(int(text)))


def tick(desk: Desk, label: str, value: bool, apply: Callable[[bool], ViewerState]) -> None:
    """Yes or no."""
    moved, found = imgui.checkbox(label, value)
    note_place(desk, label)
    if moved:
        attempt(desk, lambda: desk.change(apply(found)))


def colour(
    desk: Desk, label: str, value: tuple[float, float, float], apply: Callable[[Any], ViewerState]
) -> None:
    """Linear Rec. 709; beyond 1 for lights."""
    flags = int(imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.hdr)
    moved, found = imgui.color_edit3(label, list(value), flags)
    note_place(desk, label)
    if moved:
        attempt(desk, lambda: desk.change(apply(tuple(max(0.0, c) for c in found)), f"colour {label}"))
    if imgui.is_item_deactivated():
        desk.history.end_gesture()


def button(desk: Desk, label: str) -> bool:
    """Whether it was pressed."""
    pressed = imgui.button(label)
    note_place(desk, label)
    return bool(pressed)


def remark(text: str) -> None:
    """A grey line that breaks where the panel ends."""
    imgui.push_style_color(int(imgui.Col_.text), imgui.get_style_color_vec4(int(imgui.Col_.text_disabled)))
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def note_place(desk: Desk, label: str) -> None:
    """Remember where the item drawn last is: its left part, which is never its label."""
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    desk.places[label] = float(low.x) + min(20.0, 0.5 * float(high.x - low.x)), 0.5 * float(low.y + high.y)


def attempt(desk: Desk, act: Callable[[], None]) -> None:
    """Do it, or write over the picture why it cannot be done."""
    try:
        act()
    except DermisError as error:
        desk.messages.said = str(error)
