"""Controls of the panel: a field of a model gets one, with the model's range and help and a plain label."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from imgui_bundle import imgui, implot

from dermis.apps.viewer.session import Session
from dermis.apps.viewer.state import ViewerState
from dermis.base.errors import DermisError
from dermis.scene.field_errors import words_of
from dermis.scene.plain import Colour, Plain, Range, choices_of, help_of, range_of

Apply = Callable[..., ViewerState]
Put = Callable[[Any], ViewerState]
_LOG = int(imgui.SliderFlags_.logarithmic)
_HDR = int(imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.hdr)
_FORMS = {"_per_mm": "%.3g", "_mm": "%.4g mm", "_degrees": "%.4g°"}  # by the unit that a name ends in
_ALL_NAMES = int(imgui.ComboFlags_.height_largest)
_TOOLTIP_WIDTH = 260.0
_AS_THEY_ARE: Mapping[str, str] = MappingProxyType({})
_OWN = "own"
_PLOT_HEIGHT = 130.0
_BARE = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
_PLOT = int(_BARE | implot.Flags_.no_inputs | implot.Flags_.no_legend)
_MOST_ROWS = 14  # that are seen of many like controls


@dataclass(frozen=True)
class Style:
    """How a field is shown where the panel departs from the model.

    label : instead of the field's name; in "shown###name" the name is what positions and undo know it by
    span : range of the slider, instead of the model's
    unit : of the numbers shown, in units of the field
    form : printf format of the numbers shown
    options : the whole numbers to choose from
    called : what people call the field's words
    own : makes the first value of one's own where a field may also be a word
    """

    label: str = ""
    span: Range | None = None
    unit: float = 1.0
    form: str = ""
    options: tuple[int, ...] = ()
    called: Mapping[str, str] = field(default_factory=dict)
    own: Callable[[Session], object] | None = None


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

    def put(found: object) -> ViewerState:
        return apply(**{name: found})

    if words := words_of(kind, name):
        _draw_words(session, label, value, words, put, style)
        explain(help_of(kind, name))
        if isinstance(value, str):
            return
    if isinstance(value, bool):
        hold(session, label, imgui.checkbox(label, value), put)
    elif style.options:
        combo(session, label, str(value), map(str, style.options), lambda text: put(int(text)))
    elif isinstance(value, (int, float)):
        unit, exact = style.unit, round if isinstance(value, int) else float
        form = style.form or next((_FORMS[end] for end in _FORMS if name.endswith(end)), "%.3f")
        shown = Range(span.low / unit, span.high / unit, span.logarithmic)
        slider(session, label, value / unit, lambda found: put(exact(unit * found)), shown, form)
    elif kind.model_fields[name].annotation == _COLOUR:
        result = imgui.color_edit3(label, list(value), _HDR)
        hold(session, label, result, lambda found: put(tuple(max(0.0, c) for c in found)))
    elif isinstance(value, tuple) and span.logarithmic:
        result = imgui.slider_float3(label, list(value), span.low, span.high, "%.3g", _LOG)
        hold(session, label, result, lambda found: put(tuple(clamped(one, span) for one in found)))
    elif len(words := choices_of(kind, name)) > 1:
        combo(session, label, str(value), words, put, called=style.called)
    else:
        return
    explain(help_of(kind, name))


def _draw_words(
    session: Session, label: str, value: object, words: tuple[str, ...], put: Put, style: Style
) -> None:
    """A list of the words that a number or a colour may be instead."""
    own = style.own

    def choose(word: str) -> ViewerState:
        return put(own(session) if own and word == _OWN else word)

    chosen = value if isinstance(value, str) else _OWN
    combo(session, f"{label} from", chosen, (*words, _OWN) if own else words, choose)


def _label_of(name: str) -> str:
    """The field's name without its unit."""
    for unit in _FORMS:
        name = name.removesuffix(unit)
    return name.replace("_", " ")


def explain(text: str) -> None:
    """A tooltip for the control drawn last."""
    if not text or not imgui.is_item_hovered() or imgui.is_any_mouse_down():
        return
    imgui.begin_tooltip()
    imgui.push_text_wrap_pos(_TOOLTIP_WIDTH)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()


def draw_rows(label: str, count: int, draw: Callable[[int], None]) -> None:
    """Many like controls one below the other, in a part that scrolls; only those that are seen are drawn."""
    width, line = imgui.calc_item_width(), imgui.get_frame_height_with_spacing()
    imgui.begin_child(label, imgui.ImVec2(0.0, min(count, _MOST_ROWS) * line))
    imgui.push_item_width(width)
    clipper = imgui.ListClipper()
    clipper.begin(count, line)
    while clipper.step():
        for row in range(clipper.display_start, clipper.display_end):
            draw(row)
    imgui.pop_item_width()
    imgui.end_child()


def slider(session: Session, label: str, value: float, put: Put, span: Range, form: str) -> None:
    """A number on a scale."""
    flags = _LOG if span.logarithmic else 0
    result = imgui.slider_float(label, value, span.low, span.high, form, flags)
    hold(session, label, result, lambda found: put(clamped(found, span)))


def clamped(value: float, span: Range) -> float:
    """Within the range, which typing and single precision can leave."""
    return min(span.high, max(span.low, value))


def hold(session: Session, label: str, result: tuple[bool, Any], put: Put) -> None:
    """Apply the new value of a control; all values while it is held are one step of the undo history."""
    record_position(session, label)
    moved, found = result
    if moved:
        attempt(session, lambda: session.change(put(found), f"hold {label}"))
    if imgui.is_item_deactivated():
        session.history.end_gesture()


def combo(
    session: Session,
    label: str,
    current: str,
    names: Iterable[str],
    put: Put,
    called: Mapping[str, str] = _AS_THEY_ARE,
) -> None:
    """One of some names.

    names : "" is a line between two groups
    called : what is shown instead of a name
    """
    chosen = choose(session, label, current, names, called)
    if chosen is not None:
        attempt(session, lambda: session.change(put(chosen)))


def choose(
    session: Session, label: str, current: str, names: Iterable[str], called: Mapping[str, str]
) -> str | None:
    """Draw a list as of `combo`; return the name that was clicked."""
    chosen = None
    if not imgui.begin_combo(label, called.get(current, current), _ALL_NAMES):
        record_position(session, label)
        return None
    for name in names:
        if not name:
            imgui.separator()
            continue
        clicked, _ = imgui.selectable(f"{called.get(name, name)}###{name}", name == current)
        record_position(session, f"{_key(label)}/{name}")
        if clicked and name != current:
            chosen = name
    imgui.end_combo()
    return chosen


def button(session: Session, label: str) -> bool:
    """Draw a button; return whether it was pressed."""
    pressed = imgui.button(label)
    record_position(session, label)
    return bool(pressed)


def begin_plot(label: str, axes: tuple[str, str], across: tuple[float, float], highest: float) -> bool:
    """Begin a plot from 0 to a little above the highest value; returns whether it is visible."""
    if not implot.begin_plot(f"##{label}", imgui.ImVec2(-1.0, _PLOT_HEIGHT), _PLOT):
        return False
    hidden = int(implot.AxisFlags_.no_tick_labels) if axes[0] == "frames" else 0
    implot.setup_axes(*axes, hidden, 0)
    implot.setup_axes_limits(*across, 0.0, 1.1 * highest, int(imgui.Cond_.always))
    return True


def record_position(session: Session, label: str) -> None:
    """Record where the item drawn last is: a point in its left part, which is never its label.

    label : of which the part after "###", if it has one, is the key
    """
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    x = float(low.x) + min(20.0, 0.5 * float(high.x - low.x))
    session.positions[_key(label)] = x, 0.5 * float(low.y + high.y)


def _key(label: str) -> str:
    return label.rpartition("###")[2]


def attempt(session: Session, act: Callable[[], None]) -> None:
    """Run an action; an error becomes the message over the picture."""
    try:
        act()
    except DermisError as error:
        session.message = str(error)
    except Exception as error:
        session.tell_fault("This cannot be done", error)


SURFACE = {
    "mix": Style("colour before blur###mix"),
    "roughness": Style("roughness m###roughness"),
    "rho_s": Style("specular strength ρ_s###rho_s"),
    "specular": Style(
        "specular BRDF###BRDF",
        called={
            "kelemen": "Kelemen, Szirmay-Kalos",
            "torrance-sparrow": "Torrance-Sparrow",
            "torrance-sparrow-smith": "Torrance-Sparrow, Smith's G",
            "blinn-phong": "Blinn-Phong",
            "blinn-phong-plain": "Blinn-Phong, not normalised",
            "phong": "Phong",
            "phong-plain": "Phong, not normalised",
            "two-lobe": "two lobes",
            "kelemen-direct": "Kelemen, without its table",
        },
    ),
    "fresnel": Style("Fresnel###Fresnel", called={"schlick": "Schlick", "exact": "exact dielectric"}),
    "specular_colour": Style("reflection colour###reflection", called={"wrong": "albedo (wrong)"}),
    "energy": Style("energy conserved###energy", called={"none": "no", "published": "as published"}),
    "direction": Style("exit direction###direction", called={"lambertian": "Lambertian"}),
}
"""Labels of `Skin`, for its surface."""

ALBEDO = {"albedo": Style("colour by###colour from", called={"map": "albedo map", "profile": "profile"})}
"""Labels of `Skin`, for its profile."""

TECHNIQUE = {
    "technique": Style(
        called={"none": "none (dry skin)", "one-blur": "one Gaussian", "gpu-gems-3": "GPU Gems 3"}
    ),
    "stretch": Style(
        "stretch correction###stretch", called={"full": "stretch and shear", "axes": "along u and v"}
    ),
    "seams": Style("uv seams###seams", called={"stitch": "stitched", "none": "left open"}),
    "transmission": Style("translucency###transmission", called={"thin": "thin parts"}),
    "occlusion": Style("ambient occlusion###occlusion", called={"baked": "as posed", "rest": "as at rest"}),
    "strands": Style("hairs###strands"),
    "tone": Style("tone curve###tone", called={"none": "none (linear)", "neutral": "Khronos neutral"}),
    "gamma": Style(called={"right": "gamma-correct", "wrong": "not gamma-correct"}),
}
"""Labels of `Settings`."""

LAYER = {
    "thickness_mm": Style("thickness###thickness"),
    "absorption_per_mm": Style("absorption σ_a###absorption"),
    "scattering_per_mm": Style("scattering σ_s'###scattering"),
}
"""Labels of `TissueLayer`."""

LIGHT = {
    "irradiance": Style("colour###irradiance"),
    "softness_mm": Style("shadow softness###softness"),
    "shadows": Style("casts shadows###shadows"),
    "angle_degrees": Style("angular size###angle"),
}
"""Labels of the lights."""

LIGHT_KINDS = {
    "point": "point light",
    "spot": "spotlight",
    "rectangle": "softbox (rectangle)",
    "sphere": "globe (sphere)",
    "directional": "sun (directional)",
    "stripe": "laser stripe",
}
"""Kinds of lights."""

PROFILES = {
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
"""Names of profiles: first those of skin, then some of other media."""
