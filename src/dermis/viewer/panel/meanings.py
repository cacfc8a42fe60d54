"""What a control means, in the words of the settings' own documentation."""

from __future__ import annotations

import inspect
import re
from functools import cache

from imgui_bundle import imgui

from dermis.scene.plain import Plain, help_of

_WIDTH = 260.0
_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : (.*(?:\n    .*)*)", re.MULTILINE)


def explain(kind: type[Plain], field: str) -> None:
    """Say under the pointer what a field means, while the control drawn last is pointed at."""
    text = meanings(kind).get(field)
    if not text or not imgui.is_item_hovered() or imgui.is_any_mouse_down():
        return
    imgui.begin_tooltip()
    imgui.push_text_wrap_pos(_WIDTH)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()


@cache
def meanings(kind: type[Plain]) -> dict[str, str]:
    """What the docstrings of a class and of those that it extends say about its fields."""
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        for names, text in _ENTRY.findall(inspect.cleandoc(one.__doc__ or "")):
            found |= dict.fromkeys(names.split(", "), re.sub(r"\s+", " ", text))
    return found | {field: text for field in kind.model_fields if (text := help_of(kind, field))}
