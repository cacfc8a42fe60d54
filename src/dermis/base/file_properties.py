"""Declarations of file properties and their treatment by the readers, from which docs/formats.md is built."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import Literal

Treatment = Literal["drawn", "drawn with a note", "noted", "refused", "no effect"]


@dataclass(frozen=True)
class FileProperty:
    """Property of a file and its treatment.

    treatment : "drawn" if it changes the scene as the file states; "noted" if it does not and a note names
        it; "no effect" if it does not and there is no note
    name : property as the documentation shows it, in Markdown
    detail : how it is drawn, or why it is not, in Markdown
    keys : words by which the reader recognises it, such as statements or extensions
    other_parts : treatment in materials of parts that are not skin, if it differs from that of skin
    """

    treatment: Treatment
    name: str
    detail: str = ""
    keys: tuple[str, ...] = ()
    other_parts: Treatment | None = None

    def cells(self, is_material: bool) -> list[str]:
        """Return the cells of its row in the documentation.

        is_material : whether there are two columns of treatments, that of skin and that of other parts
        """
        others = [self.other_parts or self.treatment] if is_material else []
        return [self.name, self.treatment, *others, self.detail]


def _property(
    treatment: Treatment, name: str, detail: str = "", *keys: str, other_parts: Treatment | None = None
) -> FileProperty:
    """Return a property; `drawn`, `noted` and so on call this function with their treatment."""
    return FileProperty(treatment, name, detail, keys, other_parts)


drawn = partial(_property, "drawn")
drawn_with_note = partial(_property, "drawn with a note")
noted = partial(_property, "noted")
refused = partial(_property, "refused")
no_effect = partial(_property, "no effect")


def keys_of(properties: Iterable[FileProperty], *treatments: Treatment) -> tuple[str, ...]:
    """Return the keys of the properties with one of the given treatments; by default of all properties."""
    chosen = (one for one in properties if not treatments or one.treatment in treatments)
    return tuple(dict.fromkeys(key for one in chosen for key in one.keys))


def in_code(keys: Iterable[str]) -> str:
    """Return words as code in Markdown, separated by commas."""
    return ", ".join(f"`{key}`" for key in keys)
