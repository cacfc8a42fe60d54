"""A gallery script, described by its own docstring."""

from __future__ import annotations

import ast
import re
import runpy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.gallery.studio import Studio
from dermis.base.errors import refuse
from dermis.base.extras import needed

Image = NDArray[np.uint8] | NDArray[np.float32]
Panel = Image | list[Image]
"""A picture, or a film as a list of frames."""
Panels = Mapping[str, Panel]

_FACT = re.compile(r"^(Deck|Equation|Sources|Slider|Columns): *(.+)$", re.MULTILINE)


@dataclass(frozen=True)
class Script:
    """What a script's docstring says of its picture.

    title, caption : the first line, and what to see
    deck : rows of the talk that it shows, such as "S11"
    equation : the equation behind it, or ""
    sources : author-year keys
    slider : two panels to be compared with a slider
    columns : panels in a row; 0 for the page's choice
    """

    path: Path
    title: str
    caption: str
    deck: tuple[str, ...]
    equation: str
    sources: tuple[str, ...]
    slider: tuple[str, str] | None
    columns: int

    @property
    def name(self) -> str:
        """The file's name without its suffix."""
        return self.path.stem

    def draw(self, studio: Studio) -> Panels:
        """Run the script: panels by their captions.

        Raises DermisError when the script lacks something that it needs.
        """
        with needed("matplotlib.style", "the gallery").context("dark_background"):
            panels: Panels = runpy.run_path(str(self.path))["draw"](studio)
        return panels


def read_script(path: Path) -> Script:
    """The description in a script's docstring; the script is not run."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    facts: dict[str, str] = dict(_FACT.findall(text))
    title, _, caption = _FACT.sub("", text).partition("\n")
    before, _, after = (part.strip() for part in facts.get("Slider", "").partition("|"))
    return Script(
        path=path,
        title=title.rstrip("."),
        caption=" ".join(caption.split()),
        deck=_listed(facts.get("Deck", "")),
        equation=facts.get("Equation", ""),
        sources=_listed(facts.get("Sources", "")),
        slider=(before, after) if after else None,
        columns=int(facts.get("Columns", 0)),
    )


def find_scripts(only: Sequence[str] = ()) -> list[Script]:
    """The scripts in order; `only` selects some by number, by name or by part of a name.

    Raises DermisError for a name that matches no script.
    """
    scripts = [read_script(path) for path in sorted(scripts_folder().glob("[0-9]*.py"))]
    for wanted in only:
        if not any(_named(script, wanted) for script in scripts):
            names = ", ".join(script.name for script in scripts)
            refuse("--only", "names of pictures", f"{wanted!r} came", f"Choose from: {names}")
    return [script for script in scripts if not only or any(_named(script, name) for name in only)]


def _named(script: Script, wanted: str) -> bool:
    """Whether a number or part of a name matches the script."""
    if wanted.isdecimal():
        return int(wanted) == int(script.name.partition("_")[0])
    return wanted != "" and wanted in script.name


def scripts_folder() -> Path:
    """Where the scripts are: beside the package's sources, or inside the installed package."""
    installed = Path(__file__).parent / "scripts"
    return installed if installed.is_dir() else Path(__file__).parents[4] / "gallery"


def _listed(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())
