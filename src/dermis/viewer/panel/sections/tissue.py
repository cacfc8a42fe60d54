"""What the skin below the surface is made of: pigments by layer, or the layers' own coefficients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import get_args

from imgui_bundle import imgui

from dermis.errors import DermisError
from dermis.optics.pigments.skin import EXAMPLES, SkinParameters
from dermis.optics.tissue import SPECTRAL
from dermis.scene.skin import MOST_LAYERS, Skin, StructureName, TissueLayer
from dermis.scene.tissue import layers_of
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import attempt, button, choice, note_place, remark, slider, triple
from dermis.viewer.state import ViewerState, changed

_FIRST_STRUCTURE = "dj2006"
_EPIDERMIS = (
    ("melanin", "melanin", 0.0005, 0.6, True),
    ("eumelanin", "eumelanin", 0.0, 1.0, False),
    ("epidermis_mm", "thickness", 0.02, 0.5, False),
)
_EPIDERMAL_BLOOD = ("epidermal_blood", "blood##epidermis", 0.0, 0.1, False)
_DERMIS = (("blood", "blood", 0.0005, 0.2, True), ("oxygen", "oxygen", 0.0, 1.0, False))
_NEW_MM = 0.2
_THICKNESS_MM, _COEFFICIENT = (0.01, 5.0), (1e-4, 50.0)
_NOTHING = "a table of Gaussians, without layers"


def draw_tissue(desk: Desk) -> None:
    """Sliders for what the profile is made of, if it is."""
    skin = desk.state.scene.skin
    if skin.profile in (SPECTRAL, *EXAMPLES):
        _pigments(desk, skin)
    elif layers := _layers(skin):
        _stack(desk, layers)
    else:
        remark(_NOTHING)
    if skin.has_own_tissue and button(desk, "reset"):
        desk.change(desk.state.with_skin(pigments=None, layers=()))


def _pigments(desk: Desk, skin: Skin) -> None:
    structure = (skin.pigments and skin.pigments.structure) or _FIRST_STRUCTURE
    names = get_args(StructureName)
    choice(desk, "layers", structure, names, lambda name: desk.state.with_pigments(structure=name))
    imgui.separator_text("epidermis")
    for one in (*_EPIDERMIS, *((_EPIDERMAL_BLOOD,) if structure == "donner2008" else ())):
        _pigment(desk, skin, *one)
    imgui.separator_text("dermis")
    for one in _DERMIS:
        _pigment(desk, skin, *one)


def _pigment(desk: Desk, skin: Skin, name: str, label: str, low: float, high: float, log: bool) -> None:
    own = EXAMPLES.get(skin.profile, SkinParameters())
    given = skin.pigments.given() if skin.pigments else {}
    if name.endswith("_mm"):
        value, scale, form = float(given.get(name, getattr(own, name))), 1.0, "%.3f mm"
    else:
        value, scale, form = float(given.get(name, getattr(own, name))), 0.01, "%.2f %%"

    def apply(found: float) -> ViewerState:
        return desk.state.with_pigments(**{name: scale * found})

    slider(desk, label, value / scale, apply, low / scale, high / scale, log=log, form=form)


def _layers(skin: Skin) -> tuple[TissueLayer, ...]:
    try:
        return skin.layers or _named_layers(skin.profile)
    except DermisError:  # of a table, or of a file that the picture's own message is about
        return ()


@lru_cache(maxsize=16)
def _named_layers(profile: str) -> tuple[TissueLayer, ...]:
    """Of a profile without layers of the skin's own; files are read once, not for each frame."""
    return layers_of(Skin(profile=profile))


def _stack(desk: Desk, layers: Sequence[TissueLayer]) -> None:
    """Topmost first; each layer opens to its numbers."""
    for index, layer in enumerate(layers):
        depth = "endless" if layer.thickness_mm is None else f"{layer.thickness_mm:.3g} mm"
        is_open = imgui.tree_node_ex(f"layer{index}", 0, f"{index + 1} {layer.name}, {depth}")
        note_place(desk, f"layer {index + 1}")
        if is_open:
            _layer(desk, layers, index)
            imgui.tree_pop()


def _layer(desk: Desk, layers: Sequence[TissueLayer], index: int) -> None:
    layer, number = layers[index], index + 1

    def field(name: str) -> Callable[[object], ViewerState]:
        return lambda found: _with(desk, layers, index, changed(layer, **{name: found}))

    if layer.thickness_mm is not None:
        label, apply = f"thickness##{number}", field("thickness_mm")
        slider(desk, label, layer.thickness_mm, apply, *_THICKNESS_MM, log=True, form="%.3f mm")
    for label, name in (("absorption", "absorption_per_mm"), ("scattering", "scattering_per_mm")):
        triple(desk, f"{label}##{number}", getattr(layer, name), field(name), *_COEFFICIENT)
    imgui.text_disabled("red, green, blue [1/mm]")
    if len(layers) < MOST_LAYERS and button(desk, f"add above##{number}"):
        copy = changed(layer, thickness_mm=layer.thickness_mm or _NEW_MM)
        attempt(desk, lambda: desk.change(_with(desk, layers, index, copy, layer)))
    imgui.same_line()
    if len(layers) > 1 and button(desk, f"remove##{number}"):
        attempt(desk, lambda: desk.change(_with(desk, layers, index)))


def _with(desk: Desk, layers: Sequence[TissueLayer], index: int, *instead: TissueLayer) -> ViewerState:
    """The state with some layers in place of one."""
    stack = (*layers[:index], *instead, *layers[index + 1 :])
    return desk.state.with_skin(layers=[layer.model_dump() for layer in stack])
