"""The script that Blender runs: a text that stays the same, with the numbers of one export in it."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path
from pprint import pformat
from typing import Any

from dermis.apps.validation import truths as reference

_EMPTY = "DESCRIBED: dict[str, Any] = {}\n"
_IMPORT = (
    "from dermis.apps.validation.truths.cycles_script import add_light, add_object, set_camera, set_world\n"
)
_INSTEAD = "from mathutils import Matrix\n"
_END = 'if __name__ == "__main__":'
_BORROWED = (
    "set_camera",
    "set_world",
    "packed_image",
    "add_light",
    "paint_stripe",
    "connected",
    "add_object",
)
"""Functions of the script by which Cycles renders scenes for comparison, and those that they call."""


def script_text(described: Mapping[str, Any]) -> str:
    """The script for what is described: plain numbers, words, lists and tables of them.

    Words become literals as Python writes them, so that no name can be code.
    """
    text = _read(Path(__file__).with_name("blender_script.py"))
    borrowed = _functions(_read(Path(*reference.__path__) / "cycles_script.py"), _BORROWED)
    told = pformat(dict(described), width=110, sort_dicts=False)
    text = text.replace(_IMPORT, _INSTEAD).replace(_END, f"{borrowed}\n\n\n{_END}")
    return text.replace("  # type: ignore[import-not-found,unused-ignore]", "").replace(
        _EMPTY, f"DESCRIBED: dict[str, Any] = {told}\n"
    )


def _functions(source: str, names: tuple[str, ...]) -> str:
    """The text of some functions of a module, in that order."""
    found = {
        node.name: ast.get_source_segment(source, node)
        for node in ast.parse(source).body
        if isinstance(node, ast.FunctionDef)
    }
    return "\n\n\n".join(str(found[name]) for name in names)


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")
