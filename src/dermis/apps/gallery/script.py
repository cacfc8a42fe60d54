"""Gallery scripts: their descriptions, taken from docstrings, and the pictures they draw, as WebP files."""

from __future__ import annotations

import ast
import io
import re
import runpy
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dermis.apps.gallery.panels import Panel, Panels, first_frame, panel_sheet, to_srgb8
from dermis.apps.gallery.studio import Studio
from dermis.base.atomic_write import atomic_file
from dermis.base.errors import DermisError, refuse
from dermis.base.extras import import_extra

_METADATA_PATTERN = re.compile(r"^(Deck|Equation|Sources|Slider|Columns): *(.+)$", re.MULTILINE)


@dataclass(frozen=True)
class Script:
    """Gallery script, described by its docstring.

    path : file of the script
    title : first line of the docstring
    caption : explanation below the first line of the docstring
    deck : rows of deck.csv, such as "S11": slides of the talk "Advanced Skin Rendering" that the script shows
    equation : equation of the technique; "" for a script without an equation
    sources : keys of the bibliography
    slider : captions of two panels that the page compares with a slider; None without a slider
    columns : number of panels in a row; 0 lets the page choose
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
        """Return the name of the script: its file name without suffix."""
        return self.path.stem

    def draw(self, studio: Studio) -> Panels:
        """Run the script, and return a dictionary from caption to panel.

        Raises DermisError when a package or file that the script needs is missing.
        """
        with import_extra("matplotlib.style", "the gallery").context("dark_background"):
            panels: Panels = runpy.run_path(str(self.path))["draw"](studio)
        return panels


def read_script(path: Path) -> Script:
    """Read the description of a script from its docstring, without running the script."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    metadata: dict[str, str] = dict(_METADATA_PATTERN.findall(text))
    title, _, caption = _METADATA_PATTERN.sub("", text).partition("\n")
    before, _, after = (part.strip() for part in metadata.get("Slider", "").partition("|"))
    return Script(
        path=path,
        title=title.rstrip("."),
        caption=" ".join(caption.split()),
        deck=_split_list(metadata.get("Deck", "")),
        equation=metadata.get("Equation", ""),
        sources=_split_list(metadata.get("Sources", "")),
        slider=(before, after) if after else None,
        columns=int(metadata.get("Columns", 0)),
    )


def find_scripts(selection: Sequence[str] = ()) -> list[Script]:
    """Return the selected gallery scripts in the order of their numbers.

    selection : numbers, names or parts of names of scripts; empty for all scripts

    Raises DermisError if a number or name in the selection matches no script.
    """
    scripts = [read_script(path) for path in sorted(scripts_folder().glob("[0-9]*.py"))]
    for wanted in selection:
        if not any(_matches_selection(script, wanted) for script in scripts):
            names = ", ".join(script.name for script in scripts)
            refuse("--only", "names of pictures", f"got {wanted!r}", f"Choose from: {names}")
    return [
        script
        for script in scripts
        if not selection or any(_matches_selection(script, name) for name in selection)
    ]


def _matches_selection(script: Script, number_or_text: str) -> bool:
    """Return whether a script has the given number, or a name that contains the given text."""
    if number_or_text.isdecimal():
        return int(number_or_text) == int(script.name.partition("_")[0])
    return number_or_text != "" and number_or_text in script.name


def run_gallery_script(draw_panels: Callable[[Studio], Panels]) -> None:
    """Draw the picture of the gallery script that calls this function, and write it as PNG.

    The file and the head are read from the command line: python gallery/NN_name.py OUTPUT [HEAD].

    draw_panels : function of the script that returns its panels
    """
    from dermis.images.io import write_png

    output, head = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None
    with import_extra("matplotlib.style", "the gallery").context("dark_background"):
        panels = draw_panels(Studio(head))
    write_png(output, panel_sheet(panels, read_script(Path(sys.argv[0])).columns))


def scripts_folder() -> Path:
    """Return the folder of the gallery scripts, in the checkout or in the installed package."""
    installed = Path(__file__).parent / "scripts"
    return installed if installed.is_dir() else Path(__file__).parents[4] / "gallery"


def _split_list(comma_separated: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in comma_separated.split(",") if part.strip())


_WEBP_QUALITY, _ANIMATION_FRAME_MS = 86, 80


@dataclass(frozen=True)
class GalleryPicture:
    """Picture that a gallery script drew, as WebP files, or the reason why it drew none.

    script : gallery script
    panels : WebP file of each panel, by caption
    size : width and height of the first panel [pixel]
    seconds : run time of the script [s]
    frame_ms : median time of the frames that the script rendered; None if it rendered no frame [ms]
    fault : reason why there is no picture; "" if there is a picture
    """

    script: Script
    panels: dict[str, bytes]
    size: tuple[int, int]
    seconds: float
    frame_ms: float | None
    fault: str = ""


def draw_pictures(scripts: Sequence[Script], studio: Studio) -> Iterator[GalleryPicture]:
    """Run the scripts and yield their pictures; if a script fails, its picture holds only the reason."""
    for script in scripts:
        started, studio.frames_ms = time.perf_counter(), []
        try:
            drawn = script.draw(studio)
        except DermisError as fault:
            yield GalleryPicture(script, {}, (0, 0), time.perf_counter() - started, None, str(fault))
            continue
        height, width = first_frame(next(iter(drawn.values()))).shape[:2]
        panels = {caption: encode_webp(panel) for caption, panel in drawn.items()}
        frame_ms = float(np.median(studio.frames_ms)) if studio.frames_ms else None
        yield GalleryPicture(script, panels, (width, height), time.perf_counter() - started, frame_ms)


def encode_webp(panel: Panel, quality: int = _WEBP_QUALITY) -> bytes:
    """Encode a panel as a WebP file, animated if it has several frames.

    quality : WebP quality, 0 to 100
    """
    from PIL import Image as Pillow

    images = panel if isinstance(panel, list) else [panel]
    first, *others = (Pillow.fromarray(to_srgb8(image)) for image in images)
    file = io.BytesIO()
    animation: dict[str, Any] = {
        "save_all": True,
        "append_images": others,
        "duration": _ANIMATION_FRAME_MS,
        "loop": 0,
    }
    first.save(file, "webp", quality=quality, method=4, **(animation if others else {}))
    return file.getvalue()


def write_panels(folder: Path, picture: GalleryPicture) -> None:
    """Write the panels of a picture to separate WebP files in a folder.

    Raises DermisError when a file cannot be written.
    """
    for panel_number, data in enumerate(picture.panels.values(), 1):
        with atomic_file(folder / f"{picture.script.name}-{panel_number}.webp") as file:
            file.write_bytes(data)
