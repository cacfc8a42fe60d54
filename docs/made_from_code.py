"""Pages that Sphinx makes from the code: gallery, settings of a scene, public names, bibliography."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import dermis
from dermis import cite
from dermis.cli.options import is_option, option_name
from dermis.cli.scene_options import AROUND, HEAD
from dermis.gallery.script import Script, find_scripts
from dermis.scene import Camera, Environment, Settings, Skin
from dermis.scene.head_table import HeadTable
from dermis.scene.lights import LIGHTS
from dermis.scene.plain import Plain, help_of, shown, values_of
from dermis.scene.pose_table import PoseTable
from dermis.scene.skin import Pigments, TissueLayer

HERE = Path(__file__).parent
TABLES: dict[str, tuple[type[Plain], dict[str, str] | None]] = {
    "[head]": (HeadTable, {"name": ""} | HEAD),
    "[pose]": (PoseTable, None),
    "[skin]": (Skin, {}),
    "[skin.pigments]": (Pigments, None),
    "[[skin.layers]]": (TissueLayer, None),
    **{f"[[lights]], {name}": (kind, None) for name, kind in LIGHTS.items()},
    "[environment]": (Environment, AROUND),
    "[camera]": (Camera, None),
    "[render]": (Settings, {}),
}
"""The tables of a scene's file: their models, and options by field where these are called otherwise."""
_FIELD = re.compile(r"^(?P<names>\w+(?:, \w+)*) : (?P<meaning>.*)$")
_KEY = re.compile(r"\[([A-Za-z]{2,}\d{4}[a-z]?)\]")


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("builder-inited", lambda app: write_pages(HERE / "generated"))
    app.connect("autodoc-process-docstring", _as_fields)
    return {"parallel_read_safe": True}


def write_pages(folder: Path) -> None:
    """Write the pages."""
    folder.mkdir(exist_ok=True)
    pages = {"gallery": gallery(), "settings": settings()}
    pages |= {"reference": reference(), "bibliography": bibliography()}
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


def settings() -> str:
    """The tables of a scene's file, key by key."""
    intro = "The tables of a scene's file, and the options of `dermis render` and `dermis view` for each key."
    parts = [f"## {title}\n\n{table_of(model, names)}" for title, (model, names) in TABLES.items()]
    return "\n".join(["# Settings", "", intro, "", *parts])


def table_of(model: type[Plain], names: dict[str, str] | None) -> str:
    """A model's fields as a table.

    names : options by field where they are called otherwise; None for a model without options
    """
    rows = ["| key | option | values | default | meaning |", "|---|---|---|---|---|"]
    for field, info in model.model_fields.items():
        known = names is not None and names.get(field) != "" and is_option(model, field)
        option = f"`{option_name(field, names)}`" if known else ""
        values, default = values_of(model, field), shown(info.get_default())
        rows.append(f"| `{field}` | {option} | {values} | {default} | {help_of(model, field)} |")
    return "\n".join([*rows, ""])


def reference() -> str:
    """The public names, each with its docstring."""
    entries = []
    for name in dermis.__all__:
        thing = getattr(dermis, name)
        kind = "autofunction" if not isinstance(thing, type) else "autoclass"
        kind = "autoexception" if isinstance(thing, type) and issubclass(thing, Exception) else kind
        members = "\n:members:" if kind == "autoclass" and name in ("Renderer", "Tissue") else ""
        home = f"dermis.{dermis._HOME[name]}.{name}"
        entry = f"## {name}\n\n```{{eval-rst}}\n.. {kind}:: {home}{_indented(members)}\n```\n"
        told = isinstance(thing, type) and issubclass(thing, Plain)
        entries.append(f"{entry}\n{table_of(thing, None)}" if told else entry)
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
