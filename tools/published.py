"""Rewrite the lines with "pip install" in README and documentation for a package on PyPI, or for a checkout.

Run `python tools/published.py index` in the commit of the first release on PyPI.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

from dermis.base.command_line import run_script
from dermis.base.errors import refuse

Source = Literal["checkout", "index"]
ROOT = Path(__file__).resolve().parents[1]
PACKAGES: dict[Source, str] = {"checkout": ".", "index": "dermis"}
"""Name of the package after "pip install"."""
SENTENCES: dict[Source, str] = {
    "checkout": "dermis is not on PyPI yet: `.` after `pip install` is the folder of a checkout.",
    "index": "dermis is on PyPI; in a checkout, write `.` instead of `dermis` after `pip install`.",
}
"""Sentence that explains these lines, in README.md and docs/install.md."""
INSTALL = re.compile(
    r'(?P<command>pip install )(?:"(?:\.|dermis)(?P<extras>\[[\w,]+\])"|(?:\.|dermis)(?=[\s`]|$))',
    re.MULTILINE,
)
"""Command that installs dermis; `pip install -e .` and a path to a wheel mean the same in both forms."""


def main(source: Source, *, check: bool = False) -> None:
    """Rewrite the pages.

    Parameters
    ----------
    source:
        Where pip finds the package: index (PyPI) or checkout.
    check:
        Change no file; fail if a page has the other form.
    """
    for path in pages():
        text = path.read_text("utf-8")
        if (changed := rewrite(text, source)) == text:
            continue
        if check:
            expected, advice = f"lines with {source!r} as source", f"Run python tools/published.py {source}"
            refuse(path.relative_to(ROOT), expected, "it has others", advice)
        path.write_text(changed, "utf-8")


def pages() -> list[Path]:
    """Return the pages with install lines, and the templates of written pages."""
    return [ROOT / "README.md", ROOT / "benchmarks" / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def rewrite(text: str, source: Source) -> str:
    """Return a page whose install lines and explanation are those for a source."""
    for sentence in SENTENCES.values():
        text = text.replace(sentence, SENTENCES[source])
    return INSTALL.sub(lambda line: _install_line(line, PACKAGES[source]), text)


def _install_line(line: re.Match[str], package: str) -> str:
    extras = line["extras"]
    return line["command"] + (f'"{package}{extras}"' if extras else package)


if __name__ == "__main__":
    run_script(main)
