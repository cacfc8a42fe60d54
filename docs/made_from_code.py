"""Pages that Sphinx makes from the code: gallery, settings of a scene, public names, bibliography."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import dermis
from dermis.apps.batch.distributions import Distribution
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import (
    BackgroundTable,
    CameraTable,
    CorrelationGroup,
    EnvironmentTable,
    ExpressionTable,
    GazeTable,
    HeadRotationTable,
    LampTable,
    LightTable,
    PersonTable,
)
from dermis.apps.gallery.script import Script, find_scripts
from dermis.base import citations as cite
from dermis.cli.head_options import HEAD_OPTION_NAMES
from dermis.cli.options import is_option, option_name
from dermis.cli.scene_options import ENVIRONMENT_OPTION_NAMES
from dermis.scene import Camera, Environment, Settings, Skin
from dermis.scene.files import PoseTable
from dermis.scene.frozen_model import FrozenModel, accepted_values, field_heading, field_help, format_default
from dermis.scene.head_table import EyeTable, HeadTable
from dermis.scene.lights import LIGHTS
from dermis.scene.skin import Pigments, TissueLayer
from dermis.scene.toml_text import value_text

HERE = Path(__file__).parent
TABLES: dict[str, tuple[type[FrozenModel], dict[str, str] | None]] = {
    "[head]": (HeadTable, {"name": ""} | HEAD_OPTION_NAMES),
    "[head.eye]": (EyeTable, None),
    "[pose]": (PoseTable, None),
    "[skin]": (Skin, {}),
    "[skin.pigments]": (Pigments, None),
    "[[skin.layers]]": (TissueLayer, None),
    **{f"[[lights]], {name}": (kind, None) for name, kind in LIGHTS.items()},
    "[environment]": (Environment, ENVIRONMENT_OPTION_NAMES),
    "[camera]": (Camera, None),
    "[render]": (Settings, {}),
}
"""The tables of a scene's file: their models, and options by field where these are called otherwise."""
SPEC_TABLES: dict[str, type[FrozenModel]] = {
    "Above all tables": Spec,
    "[person]": PersonTable,
    "[expression]": ExpressionTable,
    "[head]": HeadRotationTable,
    "[gaze]": GazeTable,
    "[camera]": CameraTable,
    "[light]": LightTable,
    "[light.key], [light.fill], [light.rim]": LampTable,
    "[environment]": EnvironmentTable,
    "[background]": BackgroundTable,
    "[[correlated]]": CorrelationGroup,
}
_KEYWORDS = re.compile(r"^\*\*(\w+)$")
_FIELD = re.compile(r"^(?P<names>\w+(?:, \w+)*) : (?P<meaning>.*)$")
_PARTS = re.compile(
    r"_(?P<index>[A-Za-z]{2,})|\^(?:\((?P<power>[^()]*)\)|(?P<name>[A-Za-z]{2,}))"
    r"|(?P<word>[A-Za-z]{3,}(?:[ -][A-Za-z]+)*)"
)
"""What is more than a letter in the equation of a script."""
_SIGNS = {"Σ": "sum", "ρ": "rho", "σ": "sigma", "π": "pi", "∂": "partial", "·": "cdot", "≈": "approx"}
_TEX = {sign: rf"\{name} " for sign, name in _SIGNS.items()}
_TEX |= {"∗": "*", "−": "-", "′": "'", "₀": "_0", "²": "^2", "⁵": "^5"}
_KEY = re.compile(r"\[([A-Za-z]{2,}\d{4}[a-z]?)\]")


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("builder-inited", lambda app: write_pages(HERE / "generated"))
    app.connect("autodoc-process-docstring", _as_fields)
    app.connect("autodoc-process-signature", _signature)
    return {"parallel_read_safe": True}


def write_pages(folder: Path) -> None:
    """Write the pages."""
    folder.mkdir(exist_ok=True)
    pages = {"gallery": gallery(), "settings": settings(), "spec": spec()}
    pages |= {"reference": reference(), "bibliography": bibliography()}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def gallery() -> str:
    """Each picture with what its script says of it."""
    intro = "# Gallery\n\n`dermis gallery -o out` draws all of it, as a page with sliders.\n"
    return "\n".join([intro, *map(_picture, find_scripts())])


def _picture(script: Script) -> str:
    lines = [f"## {script.title}", "", script.caption, ""]
    lines += [f"$${_drawn(script.equation)}$$", ""] if script.equation else []
    lines += [f"![{script.title}](../images/{script.name}.webp)", ""]
    told = [f"`dermis gallery --only {script.name}`", *(f"[{key}](#{key.lower()})" for key in script.sources)]
    return "\n".join([*lines, " · ".join(told), ""])


def _drawn(equation: str) -> str:
    """Return the equation of a script in TeX."""

    def part(found: re.Match[str]) -> str:
        index, power, name, word = found["index"], found["power"], found["name"], found["word"]
        if index or name:
            return rf"{'_' if index else '^'}{{\text{{{index or name}}}}}"
        if power:
            return f"^{{{_PARTS.sub(part, power)}}}"
        return rf"\{word} " if word in ("exp", "max") else rf"\,\text{{{word}}}"

    return _PARTS.sub(part, equation).translate(str.maketrans(_TEX))


def settings() -> str:
    """Return the tables of a scene's file, key by key."""
    intro = "The tables of a scene's file, and the options of `dermis render` and `dermis view` for each key."
    parts = [f"## {title}\n\n{table_of(model, names)}" for title, (model, names) in TABLES.items()]
    return "\n".join(["# Settings", "", intro, "", *parts])


def spec() -> str:
    """Return the tables of a data set's spec, key by key."""
    intro = (
        "The tables of a spec, from which `dermis batch` draws [data sets](../batch.md). `size`, width and"
    )
    intro += (
        " height, stands above all tables too; keys of tables below `[person]` are names of what is drawn."
    )
    parts = [f"## {title}\n\n{table_of(model, None)}" for title, model in SPEC_TABLES.items()]
    return "\n".join(["# Keys of a spec", "", intro, "", *parts])


def table_of(model: type[FrozenModel], names: dict[str, str] | None) -> str:
    """Return a model's fields as a table.

    names : options by field where they are called otherwise; None for a model without options
    """
    columns = ["key", *(["option"] if names is not None else []), "values", "default", "meaning"]
    rows = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for field in sorted(model.model_fields, key=lambda field: field_heading(model, field)):
        info, heading = model.model_fields[field], field_heading(model, field)
        if info.exclude:
            continue
        cells = [f"`{field}`"]
        if names is not None:
            known = names.get(field) != "" and is_option(model, field)
            cells.append(f"`{option_name(field, names)}`" if known else "")
        default = "needed" if info.is_required() else _default(info.get_default())
        meaning = f"*{heading}.* {field_help(model, field)}" if heading else field_help(model, field)
        cells += [accepted_values(model, field), default, meaning]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join([*rows, ""])


def _default(value: Any) -> str:
    """Return the default as a user would type it, or an empty text for tables."""
    if isinstance(value, Distribution):
        told = value.spec_value()
        return format_default(told) if isinstance(told, str | float) else f"`{value_text(told)}`"
    return "" if isinstance(value, FrozenModel) else format_default(value)


def reference() -> str:
    """Return the public names, each with its docstring."""
    entries = []
    for name in dermis.__all__:
        thing = getattr(dermis, name)
        kind = "autofunction" if not isinstance(thing, type) else "autoclass"
        kind = "autoexception" if isinstance(thing, type) and issubclass(thing, Exception) else kind
        members = ", ".join(_methods(thing)) if kind == "autoclass" else ""
        listed = f"\n   :members: {members}" if members else ""
        entry = f"## {name}\n\n```{{eval-rst}}\n.. {kind}:: dermis.{name}{listed}\n```\n"
        told = isinstance(thing, type) and issubclass(thing, FrozenModel)
        entries.append(f"{entry}\n{table_of(thing, None)}" if told else entry)
    intro = "All of these are names of `dermis`. Lights, cameras, skins, environments and settings do not "
    intro += "change: `replace(...)` of each gives a checked copy with other values."
    return f"# Reference\n\n{intro}\n\n" + "\n".join(entries)


def _methods(kind: type) -> list[str]:
    """Return the names of the methods and class attributes of a class."""
    fields = getattr(kind, "model_fields", getattr(kind, "__dataclass_fields__", {}))
    return [
        name
        for name, thing in vars(kind).items()
        if not name.startswith(("_", "model_")) and name not in fields and name != "synonyms" and _told(thing)
    ]


def _told(thing: Any) -> bool:
    """Whether it is a method or a property with a docstring."""
    thing = getattr(thing, "__func__", thing)
    return bool(callable(thing) or hasattr(thing, "func") or isinstance(thing, property)) and bool(
        thing.__doc__
    )


def bibliography() -> str:
    """Return the page of all works, by their keys."""
    works = [
        f"({key.lower()})=\n## {key}\n\n```bibtex\n{cite.bibtex([key])}\n```\n"
        for key in sorted(cite.citation_keys())
    ]
    return "# Bibliography\n\n" + "\n".join(works)


def _as_fields(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Turn the lines "name : meaning" of docstrings into fields of Sphinx, and citation keys into links."""
    if isinstance(thing, type) and issubclass(thing, FrozenModel) and "Parameters" in lines:
        del lines[lines.index("Parameters") :]  # the table that follows has them
    made: list[str] = []
    entry: list[str] = []  # of the fields of a line, with what goes on below it
    for line in [*(_KEYWORDS.sub(r"\1 : keyword arguments", line) for line in lines), ""]:
        found = _FIELD.match(line)
        if entry and (found or not line.startswith(" ")):
            made += _fields_of(entry)
            entry = []
        if found or entry:
            entry.append(line)
        else:
            made.append(line)
    lines[:] = [_KEY.sub(lambda key: f":ref:`{key[1]} <{key[1].lower()}>`", line) for line in made]


def _fields_of(entry: list[str]) -> list[str]:
    """Return the fields of "position, target : meaning", one for each name."""
    found = _FIELD.match(entry[0])
    assert found is not None
    made: list[str] = []
    for name in found["names"].split(", "):
        kind = "raises" if name.endswith("Error") else "param"
        made += [f":{kind} {name}: {found['meaning']}", *entry[1:]]
    return made


def _signature(
    app: Any, what: str, name: str, thing: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Return the signature with dots in place of defaults that are created for each object."""
    return signature and signature.replace("<factory>", "..."), returned
