"""The script that the editor of Unreal Engine runs."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from typing import TYPE_CHECKING

from dermis.apps.export.naming import python_text

if TYPE_CHECKING:
    from dermis.apps.export.subject import Subject
    from dermis.apps.export.target import Rows, Value

_TEMPLATE = "data/unreal_script.txt"


def script(subject: Subject, rows: Rows, maps: Mapping[str, str], version: str) -> str:
    """A Python script that makes the profile and imports maps that lie beside it.

    maps : names of files by role
    """
    settings = "".join(f"    {python_text(row.name)}: {_value(row.value)},  # {row.unit}\n" for row in rows)
    files = "".join(f"    {python_text(role)}: {python_text(name)},\n" for role, name in maps.items())
    text = resources.files("dermis.apps.export").joinpath(_TEMPLATE).read_text("utf-8")
    known = {"NAME": python_text(subject.identifier), "SETTINGS": settings, "MAPS": files, "VERSION": version}
    for key, words in known.items():
        text = text.replace(f"@{key}@", words)
    return text


def _value(value: Value) -> str:
    if isinstance(value, tuple):
        return f"unreal.LinearColor({', '.join(f'{x:.6g}' for x in value)}, 1.0)"
    return f"{value:.6g}" if isinstance(value, float) else repr(value)
