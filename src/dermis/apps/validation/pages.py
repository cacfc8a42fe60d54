"""Pages of the documentation with measured tables, and the browser that opens exported pages."""

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
"""A JSON object: numbers, words, lists and further objects."""
CHECKOUT = Path(str(files("dermis"))).resolve().parents[1]
DOCS, RESULTS = CHECKOUT / "docs", CHECKOUT / "benchmarks" / "results"
_CHECKOUT_HINT = "Install the package from a clone of the project (make setup) and run this there"
SOFTWARE_WEBGL = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def require_in_checkout(path: Path) -> Path:
    """Return a path of the checkout that has to exist.

    Raises DermisError where the package was installed without the rest of the project.
    """
    if not path.exists():
        refuse(path.name, "a checkout of the project", f"there is no {path}", _CHECKOUT_HINT)
    return path


def add_tests_to_path() -> None:
    """Make the modules of the tests importable: some measurements use their surfaces.

    Raises DermisError where the tests are missing.
    """
    folder = str(require_in_checkout(CHECKOUT / "tests"))
    if folder not in sys.path:
        sys.path.append(folder)


def data_file(name: str) -> Path:
    """Return a file of the folder that DERMIS_DATA names.

    Raises DermisError when it is not there.
    """
    path = Path(os.environ.get("DERMIS_DATA", "../shared")) / name
    if not path.is_file():
        refuse(str(path), "a file of the published data", "there is none", "Name its folder by DERMIS_DATA")
    return path


def write_page(page: Path, text: str) -> None:
    """Write a page of the documentation, whole or not at all."""
    require_in_checkout(page.parent)
    with atomic_file(page) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def template_path(page: Path) -> Path:
    """Return the template of a page of the documentation."""
    return page.parent / "templates" / page.name


def fill_page(page: Path, **parts: object) -> None:
    """Write docs/NAME.md from docs/templates/NAME.md with its parts filled in."""
    write_page(page, require_in_checkout(template_path(page)).read_text(encoding="utf-8").format(**parts))


def print_tables(tables: Mapping[str, str]) -> None:
    """Print the tables of a page by their names in its template."""
    print_lines(*(f"{name}\n{text}\n" for name, text in tables.items()))


def write_results(path: Path, figures: Mapping[str, Any], digits: int | None = None) -> None:
    """Write raw figures as JSON, whole or not at all.

    figures : what JSON can have
    digits : significant digits of floats; all of them when left out
    """
    values = figures if digits is None else _rounded(figures, digits)
    with atomic_file(path) as unfinished:
        unfinished.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def read_results(path: Path) -> Any:
    """Return the figures that were written last."""
    return json.loads(require_in_checkout(path).read_text(encoding="utf-8"))


def _rounded(value: object, digits: int) -> object:
    if isinstance(value, float):
        return float(f"{value:.{digits}g}")
    if isinstance(value, Mapping):
        return {str(key): _rounded(one, digits) for key, one in value.items()}
    return [_rounded(one, digits) for one in value] if isinstance(value, list | tuple) else value


if TYPE_CHECKING:
    from playwright.sync_api import Page


@contextmanager
def chromium_page(side: int, flags: Sequence[str] = SOFTWARE_WEBGL) -> Iterator[Page]:
    """Open an empty page without a network, `side` pixels wide and high.

    Raises DermisError when the package playwright is not installed.
    """
    with import_extra("playwright.sync_api", "a page in Chromium").sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=list(flags))
        yield browser.new_page(viewport={"width": side, "height": side}, offline=True)
        browser.close()
