"""Sphinx extension that generates pages from the code: gallery, settings, reference and bibliography.

Docstrings have numpydoc sections, which `sphinx.ext.napoleon` converts, or lines "name : meaning", which this
extension converts to the same fields.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import dermis
from dermis.apps.batch.blur.table import BlurTable
from dermis.apps.batch.clips.table import ClipTable
from dermis.apps.batch.distributions import Distribution
from dermis.apps.batch.rigs.table import RigTable
from dermis.apps.batch.sensor.lens import Lens
from dermis.apps.batch.sensor.model import Sensor
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
    StateTable,
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
"""Tables of a scene file: their models, and option names by field where they differ from the field's name."""
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
    "[state]": StateTable,
    "[clip]": ClipTable,
    "[rig]": RigTable,
    "[blur]": BlurTable,
    "[lens]": Lens,
    "[sensor]": Sensor,
    "[[correlated]]": CorrelationGroup,
}
_FIELD = re.compile(r"^(?P<names>\w+(?:, \w+)*) : (?P<meaning>.*)$")
_TEX_GROUPS = re.compile(
    r"_(?P<index>[A-Za-z]{2,})|\^(?:\((?P<power>[^()]*)\)|(?P<name>[A-Za-z]{2,}))"
    r"|(?P<word>[A-Za-z]{3,}(?:[ -][A-Za-z]+)*)"
)
"""Words, indices and powers of several letters in the equation of a gallery script."""
_SIGNS = {"Σ": "sum", "ρ": "rho", "σ": "sigma", "π": "pi", "∂": "partial", "·": "cdot", "≈": "approx"}
_TEX = {sign: rf"\{name} " for sign, name in _SIGNS.items()}
_TEX |= {"∗": "*", "−": "-", "′": "'", "₀": "_0", "²": "^2", "⁵": "^5"}
_KEY = re.compile(r"\[([A-Za-z]{2,}\d{4}[a-z]?)\]")


def setup(app: Any) -> dict[str, bool]:
    """Register the extension; Sphinx calls this function."""
    app.connect("builder-inited", lambda app: write_pages(HERE / "generated"))
    app.connect("autodoc-process-docstring", _drop_model_parameters, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", _convert_short_fields, priority=600)  # after napoleon
    app.connect("autodoc-process-signature", _signature)
    return {"parallel_read_safe": True}


def write_pages(folder: Path) -> None:
    """Write all generated pages into a folder."""
    folder.mkdir(exist_ok=True)
    pages = {"gallery": gallery(), "settings": settings(), "spec": spec()}
    pages |= {"reference": reference(), "bibliography": bibliography()}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def gallery() -> str:
    """Return the gallery page: each picture with the description in its script."""
    intro = "# Gallery\n\n`dermis gallery -o out` renders all pictures and a page with sliders.\n"
    return "\n".join([intro, *map(_picture, find_scripts())])


def _picture(script: Script) -> str:
    lines = [f"## {script.title}", "", script.caption, ""]
    lines += [f"$${_tex(script.equation)}$$", ""] if script.equation else []
    lines += [f"![{script.title}](../images/{script.name}.webp)", ""]
    links = [
        f"`dermis gallery --only {script.name}`",
        *(f"[{key}](#{key.lower()})" for key in script.sources),
    ]
    return "\n".join([*lines, " · ".join(links), ""])


def _tex(equation: str) -> str:
    """Return the equation of a script in TeX."""

    def group(match: re.Match[str]) -> str:
        index, power, name, word = match["index"], match["power"], match["name"], match["word"]
        if index or name:
            return rf"{'_' if index else '^'}{{\text{{{index or name}}}}}"
        if power:
            return f"^{{{_TEX_GROUPS.sub(group, power)}}}"
        return rf"\{word} " if word in ("exp", "max") else rf"\,\text{{{word}}}"

    return _TEX_GROUPS.sub(group, equation).translate(str.maketrans(_TEX))


def settings() -> str:
    """Return the page of all settings: the tables of a scene file with their keys."""
    intro = (
        "Tables and keys of scene files, with the options of `dermis render` and `dermis view` for each key."
    )
    parts = [f"## {title}\n\n{table_of(model, names)}" for title, (model, names) in TABLES.items()]
    return "\n".join(["# Settings", "", intro, "", *parts])


def spec() -> str:
    """Return the page of all tables of a spec with their keys."""
    intro = "Tables and keys of a spec, from which `dermis batch` renders [data sets](../batch.md). The key "
    intro += "`size` (width and height) is above all tables too. In the tables below `[person]`, keys are "
    intro += "names of fields or morph targets."
    parts = [f"## {title}\n\n{table_of(model, None)}" for title, model in SPEC_TABLES.items()]
    return "\n".join(["# Keys of a spec", "", intro, "", *parts])


def table_of(model: type[FrozenModel], names: dict[str, str] | None) -> str:
    """Return the fields of a model as a Markdown table.

    names : option names by field where they differ from the field's name, "" for fields without an option;
        None for a model without options
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
        default = "required" if info.is_required() else _default(info.get_default())
        meaning = f"*{heading}.* {field_help(model, field)}" if heading else field_help(model, field)
        cells += [accepted_values(model, field), default, meaning]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join([*rows, ""])


def _default(value: Any) -> str:
    """Return a default value as users type it; an empty text for models."""
    if isinstance(value, Distribution):
        toml = value.spec_value()
        return format_default(toml) if isinstance(toml, str | float) else f"`{value_text(toml)}`"
    return "" if isinstance(value, FrozenModel) else format_default(value)


def reference() -> str:
    """Return the reference page: all public names with their docstrings."""
    entries = []
    for name in dermis.__all__:
        thing = getattr(dermis, name)
        kind = "autofunction" if not isinstance(thing, type) else "autoclass"
        kind = "autoexception" if isinstance(thing, type) and issubclass(thing, Exception) else kind
        members = ", ".join(_methods(thing)) if kind == "autoclass" else ""
        option = f"\n   :members: {members}" if members else ""
        entry = f"## {name}\n\n```{{eval-rst}}\n.. {kind}:: dermis.{name}{option}\n```\n"
        is_model = isinstance(thing, type) and issubclass(thing, FrozenModel)
        entries.append(f"{entry}\n{table_of(thing, None)}" if is_model else entry)
    intro = "All names on this page are imported from `dermis`. Lights, cameras, skins, environments and "
    intro += "settings are immutable; their method `replace(...)` returns a validated copy with other values."
    return f"# Reference\n\n{intro}\n\n" + "\n".join(entries)


def _methods(kind: type) -> list[str]:
    """Return the names of the public methods and properties of a class that have a docstring."""
    fields = getattr(kind, "model_fields", getattr(kind, "__dataclass_fields__", {}))
    return [
        name
        for name, thing in vars(kind).items()
        if not name.startswith(("_", "model_"))
        and name not in fields
        and name != "synonyms"
        and _is_documented(thing)
    ]


def _is_documented(thing: Any) -> bool:
    """Return whether an attribute of a class is a method or a property with a docstring."""
    thing = getattr(thing, "__func__", thing)
    return bool(callable(thing) or hasattr(thing, "func") or isinstance(thing, property)) and bool(
        thing.__doc__
    )


def bibliography() -> str:
    """Return the bibliography page, sorted by key."""
    works = [
        f"({key.lower()})=\n## {key}\n\n```bibtex\n{cite.bibtex([key])}\n```\n"
        for key in sorted(cite.citation_keys())
    ]
    return "# Bibliography\n\n" + "\n".join(works)


def _drop_model_parameters(
    app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Remove the sections of parameters from docstrings of models, whose fields are in a table below."""
    if isinstance(thing, type) and issubclass(thing, FrozenModel) and "Parameters" in lines:
        end = lines.index("Examples") if "Examples" in lines else len(lines)
        del lines[lines.index("Parameters") : end]


def _convert_short_fields(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Convert lines "name : meaning" of docstrings to fields of Sphinx, and citation keys to links."""
    converted: list[str] = []
    entry: list[str] = []  # line "name : meaning" with its continuation lines
    for line in [*lines, ""]:
        starts_entry = _FIELD.match(line) is not None
        if entry and (starts_entry or not line.startswith(" ")):
            converted += _fields_of(entry)
            entry = []
        if starts_entry or entry:
            entry.append(line)
        else:
            converted.append(line)
    lines[:] = [_KEY.sub(lambda key: f":ref:`{key[1]} <{key[1].lower()}>`", line) for line in converted]


def _fields_of(entry: list[str]) -> list[str]:
    """Return the fields of an entry "position, target : meaning", one for each name."""
    match = _FIELD.match(entry[0])
    assert match is not None
    fields: list[str] = []
    for name in match["names"].split(", "):
        kind = "raises" if name.endswith("Error") else "param"
        fields += [f":{kind} {name}: {match['meaning']}", *entry[1:]]
    return fields


def _signature(
    app: Any, what: str, name: str, thing: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Return a signature in which "..." replaces defaults that are created for each object."""
    return signature and signature.replace("<factory>", "..."), returned
