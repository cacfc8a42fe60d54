"""Write docs/formats.md from its template and the file properties that the readers declare."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from dermis.apps.validation.pages import template_path, write_page
from dermis.base.command_line import run_script
from dermis.base.file_properties import FileProperty
from dermis.formats.mesh_formats import MESH_FORMATS
from dermis.images.hdr import EXR_PROPERTIES, RADIANCE_PROPERTIES
from dermis.images.io import INVALID_PIXEL_PROPERTIES, UNSUPPORTED_PICTURE_PROPERTIES
from dermis.images.opening import PICTURE_PROPERTIES

PAGE = Path(__file__).resolve().parents[1] / "docs" / "formats.md"
_PICTURES = {
    "pictures": (*PICTURE_PROPERTIES, *UNSUPPORTED_PICTURE_PROPERTIES),
    "exr": EXR_PROPERTIES,
    "radiance": RADIANCE_PROPERTIES,
    "odd_pixels": INVALID_PIXEL_PROPERTIES,
}


def main() -> None:
    """Write the page."""
    write_page(PAGE, page_text())


def page_text() -> str:
    """Return the text of the page with the current tables."""
    tables = {name: _table(rows) for name, rows in _PICTURES.items()}
    for name, mesh_format in MESH_FORMATS.items():
        tables[name] = _table(mesh_format.properties)
        tables[f"{name}_materials"] = _table(mesh_format.materials, ("skin", "other parts"))
    return template_path(PAGE).read_text(encoding="utf-8").format(**tables)


def _table(rows: Iterable[FileProperty], treatments: tuple[str, ...] = ("treatment",)) -> str:
    head = ["property", *treatments, "details"]
    cells = [head, ["---"] * len(head), *(row.documentation_cells(len(treatments) > 1) for row in rows)]
    return "\n".join(f"| {' | '.join(row)} |" for row in cells)


if __name__ == "__main__":
    run_script(main)
