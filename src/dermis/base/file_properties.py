"""Records of how file readers treat each property of a file; docs/formats.md is built from these records."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import Literal

Treatment = Literal["drawn", "drawn with a note", "noted", "refused", "no effect"]


@dataclass(frozen=True)
class FileProperty:
    """Property of a file, and what the reader does with this property.

    treatment : "drawn" if the property affects the picture; "drawn with a note" if a note is also printed;
        "noted" if the property is ignored and a note says so; "no effect" if it is ignored without a note;
        "refused" if the reader raises an error
    name : property as the documentation shows it, in Markdown
    detail : how the property affects the picture, or why it does not, in Markdown
    keys : words by which the reader recognises the property, such as statements or extensions
    other_parts : treatment in the materials of other parts of a model, such as clothes; None if it is the
        same as in materials of skin
    """

    treatment: Treatment
    name: str
    detail: str = ""
    keys: tuple[str, ...] = ()
    other_parts: Treatment | None = None

    def documentation_cells(self, has_parts_column: bool) -> list[str]:
        """Return the cells of this property's row in a table of the documentation.

        has_parts_column : whether the table has two columns for what the file reader does with the property:
            one for materials of skin, and one for all other materials
        """
        others = [self.other_parts or self.treatment] if has_parts_column else []
        return [self.name, self.treatment, *others, self.detail]


def _file_property(
    treatment: Treatment,
    property_name: str,
    detail_text: str = "",
    *keys: str,
    other_parts: Treatment | None = None,
) -> FileProperty:
    """Return a `FileProperty`; `drawn_property` and similar functions call this one with their treatment.

    keys : words by which the reader recognises the property
    other_parts : treatment in the materials of parts that are not skin; None if it is the same
    """
    return FileProperty(treatment, property_name, detail_text, keys, other_parts)


drawn_property = partial(_file_property, "drawn")
drawn_property_with_note = partial(_file_property, "drawn with a note")
noted_property = partial(_file_property, "noted")
refused_property = partial(_file_property, "refused")
property_without_effect = partial(_file_property, "no effect")


def keys_of(properties: Iterable[FileProperty], *treatments: Treatment) -> tuple[str, ...]:
    """Return the `FileProperty.keys` of all properties, or only of those with one of the given treatments."""
    chosen = (item for item in properties if not treatments or item.treatment in treatments)
    return tuple(dict.fromkeys(key for item in chosen for key in item.keys))


def markdown_code(words: Iterable[str]) -> str:
    """Return words formatted as code in Markdown, separated by commas."""
    return ", ".join(f"`{key}`" for key in words)
