"""Specification of a data set: distributions of people, faces, light and cameras, and one seed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, Field, PrivateAttr

from dermis.apps.batch import spec_tables as tables
from dermis.apps.batch.distributions import Distribution, Files
from dermis.apps.batch.output_encoding import Encoding
from dermis.apps.batch.sampling import Parameters, Sampler
from dermis.apps.batch.spec_checks import check_landmarks, check_spec
from dermis.base.errors import about, refuse, shown_value
from dermis.base.quantities import whole_number
from dermis.base.reading import is_file, named_path, read_file, read_toml
from dermis.human.expressions import EXPRESSIONS, targets_of
from dermis.human.landmarks.sets import SETS
from dermis.scene.field_errors import Because, ImpossibleError
from dermis.scene.outputs import checked_outputs
from dermis.scene.plain import Plain
from dermis.scene.settings import Settings
from dermis.scene.toml_text import key_text, table_text

MAX_IMAGES = 10**9
RENDER_DEFAULTS: Mapping[str, Any] = {"atlas": 1024, "exposure": "auto"}
"""Settings that a data set has where its spec says nothing."""
_BACKGROUND = "[background]"
SETTINGS_OUTSIDE_RENDER = {"size": "size, above all tables", "background": _BACKGROUND, "background_blur": _BACKGROUND}
"""Settings that [render] does not hold, and where a spec has them."""
_Weight = Annotated[float, Field(ge=0, le=1)]
_HEADER = "# A data set of dermis: lengths in mm, colours linear Rec. 709."
_MOST_FILES = 100_000
_MOST_BYTES = 4 << 30
_FILES = "person.head", "environment.name", "skin.profile"
"""Parameters that may name files."""
P = TypeVar("P", bound=Plain)


class Spec(Plain):
    """Specification of a data set."""

    count: Annotated[int, Field(ge=1, le=MAX_IMAGES), Because("a billion images")] = 1000
    """How many images."""
    seed: Annotated[int, Field(ge=0, le=2**32 - 1), Because("32 bits")] = 0
    """By which all is drawn."""
    images_per_person: Annotated[int, Field(ge=1, le=10**6), Because("a million of each")] = 1
    """Images one after the other that show one person."""
    outputs: tuple[str, ...] = ()
    """What is written of each image besides its colour, as of `dermis render --outputs`."""
    landmarks: tuple[str, ...] = ("ibug-68",)
    """Sets of landmarks, or tables of name,vertex for meshes of your own (.csv, in the spec's folder)."""
    shard_size: Annotated[int, Field(ge=1, le=10**6), Because("a million in a file")] = 1000
    """Images in a shard."""
    format: Literal["webdataset", "folder"] = "webdataset"
    """Shards as tar files, or as folders."""
    encoding: Encoding = "png"
    """Files of the outputs: png (16 bits where they suffice), exr or npy (all bits)."""
    render: Settings = Field(default_factory=lambda: Settings(size=(512, 512), **RENDER_DEFAULTS))
    """How pictures are computed; `size` and the background stand elsewhere."""
    person: tables.PersonTable = tables.PersonTable()
    """Who is seen."""
    expression: tables.ExpressionTable = tables.ExpressionTable()
    """What the face does."""
    expressions: dict[str, dict[str, _Weight]] = Field(default_factory=dict)
    """Expressions of the spec's own: weights of targets, or of pairs without Left and Right."""
    pose: dict[str, Annotated[Distribution, tables.DistributionField()]] = Field(default_factory=dict)
    """Weights of morph targets, or of pairs, in place of those that the expression gives."""
    head: tables.TurnTable = tables.TurnTable()
    """How the head is turned."""
    gaze: tables.GazeTable = tables.GazeTable()
    """Where the eyes look."""
    camera: tables.CameraTable = tables.CameraTable()
    """From where the face is seen."""
    skin: dict[str, Annotated[Distribution, tables.DistributionField()]] = Field(default_factory=dict)
    """Dials of the skin, as of scenes: roughness, oiliness, ..."""
    light: tables.LightTable = tables.LightTable()
    """Lamps."""
    environment: tables.EnvironmentTable = tables.EnvironmentTable()
    """Light from all around."""
    background: tables.BackgroundTable = tables.BackgroundTable()
    """What is behind the head."""
    correlated: tuple[tables.Correlated, ...] = ()
    """Parameters that go together."""
    files: dict[str, str] = Field(default_factory=dict)
    """SHA-256 of each file that the spec names; found when it is read, and checked where it is stated."""
    folder: Path = Field(default=Path(), exclude=True)
    """Where those files lie; no part of a spec's text."""

    _sampler: Sampler = PrivateAttr()

    def model_post_init(self, context: object) -> None:
        sampled = _distributions("", self)
        expressions = {**EXPRESSIONS, **self.expressions}
        with about("outputs"):
            checked_outputs(self.outputs)
        check_landmarks(self.landmarks, self.folder)
        check_spec(sampled, expressions, self.correlated, self.folder)
        rows = {name: row for group in self.correlated for name, row in group.rows().items()}
        sampler = Sampler(self.seed, self.images_per_person, sampled, rows, expressions)
        BaseModel.__setattr__(self, "_sampler", sampler)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures [pixel]."""
        return self.render.size

    @property
    def distributions(self) -> Mapping[str, Distribution]:
        """Distributions by name of their parameter."""
        return self._sampler.distributions

    @property
    def landmark_tables(self) -> Mapping[str, str]:
        """Sets of landmarks by name in the spec: the same name, or the path of a table."""
        return {name: name if name in SETS else str(self.folder / name) for name in self.landmarks}

    @property
    def own_targets(self) -> frozenset[str]:
        """Morph targets that [pose] names, alone or as one of a pair."""
        return frozenset(targets_of(self.pose))

    def parameters(self, k: int) -> Parameters:
        """Return the sampled parameters of image k by name: numbers of six digits, and texts.

        They are equal on every machine and in any order, and changing or adding a distribution changes no
        other parameter. An image lacks those that it does not use, such as of lamps that are not lit.

        Raises DermisError for an image that the data set does not have.
        """
        return self._sampler.parameters(whole_number("image", k, 0, self.count - 1))

    def text(self) -> str:
        """Return the canonical form: TOML of every value, which reads as the same spec."""
        values = plain_values(self)
        values = {"count": values.pop("count"), "seed": values.pop("seed"), "size": self.size} | values
        values["render"] = self.render.model_dump(exclude=set(SETTINGS_OUTSIDE_RENDER), exclude_none=True)
        del values["folder"]
        return "\n".join([_HEADER, *_toml_lines("", values)])

    def digest(self) -> str:
        """Return the SHA-256 of the text, which identifies a data set."""
        return hashlib.sha256(self.text().encode()).hexdigest()


def _distributions(name: str, value: object) -> dict[str, Distribution]:
    """Return the distributions in a table and below, by dotted names."""
    if isinstance(value, Distribution):
        return {name: value}
    parts = plain_values(value) if isinstance(value, Plain) else value
    if not isinstance(parts, Mapping):
        return {}
    start = f"{name}." if name else ""
    return {key: one for part in parts for key, one in _distributions(f"{start}{part}", parts[part]).items()}


def load_spec(path: str | Path, **values: object) -> Spec:
    """Return the spec of a TOML file; files that it names are relative to its folder.

    values : `count`, `seed` or `size` in place of the file's

    Raises DermisError, naming table and key, for what cannot be rendered and for missing files.
    """
    path = named_path(path, "a spec of a data set in TOML")
    data = read_toml(path, "a spec of a data set in TOML")
    with about(path):
        return parse_spec({**data, **values}, path.parent)


def parse_spec(data: Mapping[str, object], folder: Path = Path()) -> Spec:
    """Return the spec of parsed TOML.

    folder : of the files that it names

    Raises DermisError as `load_spec` does.
    """
    if "folder" in data:
        refuse("folder", "no such key", "it came", "Files lie relative to the spec's own folder")
    given = {
        name: table if name == "files" else _with_files(table, folder, name) for name, table in data.items()
    }
    given["render"] = _render(given.pop("size", (512, 512)), given.get("render", {}))
    if isinstance(groups := given.get("correlated", ()), list | tuple):
        given["correlated"] = tuple(_model(tables.Correlated, "correlated", group) for group in groups)
    spec = _model(Spec, "", given | {"folder": folder})
    support = [end for name in _FILES if name in spec.distributions for end in spec.distributions[name].support]
    tables_named = (name for name in spec.landmarks if name not in SETS)
    found = _hashes([*map(str, support), *tables_named], folder)
    if spec.files:
        _check_hashes(spec.files, found)
    return spec.replace(files=found) if found else spec


def example_toml() -> str:
    """A spec with comments that can be drawn as it is."""
    return resources.files(__package__).joinpath("example.toml").read_text("utf-8")


def _render(size: object, table: object) -> Settings:
    if not isinstance(table, Mapping):
        return _model(Settings, "render", table)
    for key in SETTINGS_OUTSIDE_RENDER.keys() & table.keys():
        refuse(f"render: {key}", "it elsewhere in a spec", "it came here", f"Write it as {SETTINGS_OUTSIDE_RENDER[key]}")
    return _model(Settings, "render", {**RENDER_DEFAULTS, **table, "size": size})


def _model(kind: type[P], where: str, table: object) -> P:
    """Return a model of a table and of those below it, which are named in errors."""
    if isinstance(table, kind):
        return table
    if not isinstance(table, Mapping):
        expected = f"a table with {', '.join(kind.model_fields)}"
        refuse(where, expected, f"{shown_value(table)} came", "Correct it")
    values = dict(table)
    for name, info in kind.model_fields.items():
        if name in values and isinstance(info.annotation, type) and issubclass(info.annotation, Plain):
            values[name] = _model(info.annotation, f"{where}.{name}" if where else name, values[name])
    try:
        return kind(**values)
    except ImpossibleError as error:
        raise ImpossibleError(where or "spec", error.findings) from None


def plain_values(table: Plain) -> dict[str, object]:
    """Return the fields that have a value, by name."""
    values = {name: getattr(table, name) for name in type(table).model_fields}
    return {name: value for name, value in values.items() if value is not None}


def _toml_lines(title: str, values: Mapping[str, object]) -> list[str]:
    """Return the TOML of a table and of those below it."""
    own, below = dict[str, object](), list[str]()
    for name, value in values.items():
        path = f"{title}.{key_text(name)}" if title else key_text(name)
        if isinstance(value, Plain | Mapping):
            below += _toml_lines(path, plain_values(value) if isinstance(value, Plain) else value)
        elif isinstance(value, tuple) and value and isinstance(value[0], Plain):
            below += [table_text(f"[[{path}]]", plain_values(one)) for one in value]
        else:
            own[name] = value.spec_value() if isinstance(value, Distribution) else value
    return [table_text(f"[{title}]" if title else "", own), *below] if own or not below else below


def _with_files(value: object, folder: Path, key: str) -> object:
    """Return a value of a spec in which each {files = PATTERN} is replaced by its sorted files.

    Raises DermisError for patterns that no file matches.
    """
    if not isinstance(value, Mapping):
        return value
    if value.keys() == {"files"} and isinstance(value["files"], str):
        return _files(value["files"], folder, key)
    return {name: _with_files(one, folder, f"{key}.{name}") for name, one in value.items()}


def _files(pattern: str, folder: Path, key: str) -> Files:
    names = []
    try:
        for path in folder.glob(pattern):
            if is_file(path):
                names.append(Path(os.path.relpath(path, folder)).as_posix())
            if len(names) > _MOST_FILES:
                break
    except (ValueError, NotImplementedError, OSError, RecursionError) as fault:
        came = f"{pattern!r} is none ({fault or type(fault).__name__})"
        refuse(key, "a pattern of files below the spec's folder, such as heads/*.json", came, "Correct it")
    if not 0 < len(names) <= _MOST_FILES:
        came = f"more than {_MOST_FILES:,} match" if names else "none matches"
        refuse(key, f"files that match {pattern!r} in the spec's folder", came, "Correct the pattern")
    return Files(pattern, tuple(sorted(names)))


def _hashes(names: Iterable[str], folder: Path) -> dict[str, str]:
    """Return the SHA-256 of those names that are files, sorted by name."""
    found = {}
    for name in sorted(set(names)):
        if is_file(folder / name):
            data = read_file(folder / name, "a file that the spec names", _MOST_BYTES)
            found[name] = hashlib.sha256(data).hexdigest()
    return found


def _check_hashes(stated: Mapping[str, str], found: Mapping[str, str]) -> None:
    """Refuse files that differ from those that a spec was made with."""
    for name in sorted(stated.keys() | found.keys()):
        if stated.get(name) != found.get(name):
            expected = f"the file of hash {stated[name][:16]}..." if name in stated else "no such file"
            came = f"it has {found[name][:16]}..." if name in found else "there is none"
            refuse(f"files: {name}", expected, came, "Put it back, or take [files] out for another data set")
