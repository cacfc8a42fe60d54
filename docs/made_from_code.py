"""Pages that Sphinx makes from the code: the gallery, the reference of public names, the bibliography."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import dermis
from dermis import cite
from dermis.gallery.script import Script, find_scripts

HERE = Path(__file__).parent
_FIELD = re.compile(r"^(?P<names>\w+(?:, \w+)*) : (?P<meaning>.*)$")
_KEY = re.compile(r"\[([A-Za-z]{2,}\d{4}[a-z]?)\]")


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("builder-inited", lambda app: write_pages(HERE / "generated"))
    app.connect("autodoc-process-docstring", _as_fields)
    return {"parallel_read_safe": True}


def write_pages(folder: Path) -> None:
    """Write the three pages."""
    folder.mkdir(exist_ok=True)
    pages = {"gallery": gallery(), "reference": reference(), "bibliography": bibliography()}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def gallery() -> str:
    """Each picture with what its script says of it."""
    intro = "# Gallery\n\n`dermis gallery -o out` draws all of it, as a page with sliders.\n"
    return "\n".join([intro, *map(_picture, find_scripts())])


def _picture(script: Script) -> str:
    lines = [f"## {script.title}", "", script.caption, ""]
    lines += [f"*{script.equation}*", ""] if script.equation else []
    lines += [f"![{script.title}](../images/{script.name}.webp)", ""]
    told = [f"`dermis gallery --only {script.name}`", *(f"[{key}](#{key.lower()})" for key in script.sources)]
    return "\n".join([*lines, " · ".join(told), ""])


def reference() -> str:
    """The public names, each with its docstring."""
    entries = []
    for name in dermis.__all__:
        thing = getattr(dermis, name)
        kind = "autofunction" if not isinstance(thing, type) else "autoclass"
        kind = "autoexception" if isinstance(thing, type) and issubclass(thing, Exception) else kind
        members = "\n:members:" if kind == "autoclass" and name in ("Renderer", "Tissue") else ""
        home = f"dermis.{dermis._HOME[name]}.{name}"
        entries.append(f"## {name}\n\n```{{eval-rst}}\n.. {kind}:: {home}{_indented(members)}\n```\n")
    return "# Reference\n\nAll of these are names of `dermis`.\n\n" + "\n".join(entries)


def _indented(text: str) -> str:
    return text.replace("\n", "\n   ")


def bibliography() -> str:
    """Every work, by its key."""
    works = [
        f"({key.lower()})=\n## {key}\n\n```bibtex\n{cite.bibtex([key])}\n```\n" for key in sorted(cite.keys())
    ]
    return "# Bibliography\n\n" + "\n".join(works)


def _as_fields(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Lines "name : meaning" of the house's docstrings as Sphinx's fields, and keys as links."""
    for number, line in enumerate(lines):
        found = _FIELD.match(line)
        said = f":param {found['names']}: {found['meaning']}" if found else line
        lines[number] = _KEY.sub(lambda key: f":ref:`{key[1]} <{key[1].lower()}>`", said)
