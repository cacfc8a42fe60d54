"""Helpers for documentation pages with measured tables, files of results, and web pages in Chromium."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dermis.base.atomic_write import atomic_file
from dermis.base.console import print_lines
from dermis.base.errors import refuse
from dermis.base.extras import import_extra

JsonObject = dict[str, Any]
"""JSON object: numbers, strings, lists and nested objects."""
CHECKOUT = Path(str(files("dermis"))).resolve().parents[1]
DOCS, RESULTS = CHECKOUT / "docs", CHECKOUT / "benchmarks" / "results"
_CHECKOUT_HINT = "Install the package from a clone of the project (make setup) and run the command there"
SOFTWARE_WEBGL_FLAGS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


def require_in_checkout(path: Path) -> Path:
    """Check that a path exists in the checkout of the project, and return it.

    Raises DermisError if the package is installed without a checkout of the project.
    """
    if not path.exists():
        refuse(path.name, "a checkout of the project", f"there is no {path}", _CHECKOUT_HINT)
    return path


def add_tests_to_path() -> None:
    """Make the modules in the folder `tests` importable.

    Some measurements use meshes that these modules build.

    Raises DermisError if the tests are missing.
    """
    folder = str(require_in_checkout(CHECKOUT / "tests"))
    if folder not in sys.path:
        sys.path.append(folder)


def data_file(file_name: str) -> Path:
    """Return the path of a file of data that others have published, such as measured spectra or a head.

    The file is in the folder that the environment variable DERMIS_DATA names; the default is ../shared.

    Raises DermisError when the file is missing.
    """
    path = Path(os.environ.get("DERMIS_DATA", "../shared")) / file_name
    if not path.is_file():
        refuse(str(path), "a file of the published data", "there is none", "Name its folder by DERMIS_DATA")
    return path


def write_page(page: Path, page_text: str) -> None:
    """Write a page of the documentation atomically."""
    require_in_checkout(page.parent)
    with atomic_file(page) as file:
        file.write_text(page_text, encoding="utf-8")


def template_path(page: Path) -> Path:
    """Return the path of a page's template, docs/templates/NAME.md."""
    return page.parent / "templates" / page.name


def fill_page(page: Path, **placeholder_texts: object) -> None:
    """Write docs/NAME.md from docs/templates/NAME.md.

    placeholder_texts : text or number for each placeholder of the template
    """
    write_page(
        page, require_in_checkout(template_path(page)).read_text(encoding="utf-8").format(**placeholder_texts)
    )


def print_tables(tables: Mapping[str, str]) -> None:
    """Print the tables of a page, each below its placeholder in the template."""
    print_lines(*(f"{name}\n{text}\n" for name, text in tables.items()))


def write_results(path: Path, results: Mapping[str, Any], digits: int | None = None) -> None:
    """Write measured results to a JSON file, atomically.

    results : measured values, JSON-compatible
    digits : significant digits of floats; None for all digits
    """
    values = results if digits is None else _round_floats(results, digits)
    with atomic_file(path) as file:
        file.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def read_results(path: Path) -> Any:
    """Return the results of the last measurement from a JSON file of the checkout."""
    return json.loads(require_in_checkout(path).read_text(encoding="utf-8"))


def _round_floats(nested_value: object, digits: int) -> object:
    if isinstance(nested_value, float):
        return float(f"{nested_value:.{digits}g}")
    if isinstance(nested_value, Mapping):
        return {str(key): _round_floats(one, digits) for key, one in nested_value.items()}
    return (
        [_round_floats(one, digits) for one in nested_value]
        if isinstance(nested_value, list | tuple)
        else nested_value
    )


if TYPE_CHECKING:
    from playwright.sync_api import Page


@contextmanager
def chromium_page(page_side: int, flags: Sequence[str] = SOFTWARE_WEBGL_FLAGS) -> Iterator[Page]:
    """Open an empty web page in headless Chromium without a network, for the duration of a context.

    page_side : side of the square page [pixel]
    flags : command-line flags of Chromium

    Raises DermisError when the package playwright is not installed.
    """
    with import_extra("playwright.sync_api", "a page in Chromium").sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=list(flags))
        yield browser.new_page(viewport={"width": page_side, "height": page_side}, offline=True)
        browser.close()
