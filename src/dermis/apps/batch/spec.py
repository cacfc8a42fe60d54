"""What a data set draws: people, faces, light and cameras, from stated distributions by one seed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, Field, PrivateAttr

from dermis.apps.batch.distributions import Distribution, Files
from dermis.apps.batch.output_encoding import Encoding
from dermis.apps.batch.sampling import Parameters, Sampler
from dermis.apps.batch.spec_checks import check_spec
from dermis.apps.batch.spec_tables import (
    BackgroundTable,
    CameraTable,
    Correlated,
    DistributionField,
    EnvironmentTable,
    ExpressionTable,
    GazeTable,
    LightTable,
    PersonTable,
    TurnTable,
)
from dermis.base.errors import about, refuse, shown_value
from dermis.base.quantities import whole_number
from dermis.base.reading import is_file, named_path, read_file, read_toml
from dermis.human.expressions import EXPRESSIONS, targets_of
from dermis.human.landmarks.sets import SETS
from dermis.scene.field_errors import Because, ImpossibleError
from dermis.scene.plain import Plain
from dermis.scene.settings import Settings
from dermis.scene.toml_text import key_text, table_text

MOST_IMAGES = 10**9
RENDER: Mapping[str, Any] = {"atlas": 1024, "exposure": "auto"}
"""Settings that a data set has where its spec says nothing."""
ELSEWHERE = {
    "size": "size, above all tables",
    "background": "[background]",
    "background_blur": "[background]",
}
"""Settings that [render] does not hold, and where a spec has them."""
_Weight = Annotated[float, Field(ge=0, le=1)]


_FILES = "person.head", "environment.name", "skin.profile"
"""Parameters that may name files."""
P = TypeVar("P", bound=Plain)


def _settings() -> Settings:
    return Settings(size=(512, 512), **RENDER)


class Spec(Plain):
    """A data set before it is drawn."""

    count: Annotated[int, Field(ge=1, le=MOST_IMAGES), Because("a billion images")] = 1000
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
    render: Settings = Field(default_factory=_settings)
    """How pictures are computed; `size` and the background stand elsewhere."""
    person: PersonTable = PersonTable()
    """Who is seen."""
    expression: ExpressionTable = ExpressionTable()
    """What the face does."""
    expressions: dict[str, dict[str, _Weight]] = Field(default_factory=dict)
    """Expressions of the spec's own: weights of targets, or of pairs without Left and Right."""
    pose: dict[str, Annotated[Distribution, DistributionField()]] = Field(default_factory=dict)
    """Weights of morph targets, or of pairs, in place of those that the expression gives."""
    head: TurnTable = TurnTable()
    """How the head is turned."""
    gaze: GazeTable = GazeTable()
    """Where the eyes look."""
    camera: CameraTable = CameraTable()
    """From where the face is seen."""
    skin: dict[str, Annotated[Distribution, DistributionField()]] = Field(default_factory=dict)
    """Dials of the skin, as of scenes: roughness, oiliness, ..."""
    light: LightTable = LightTable()
    """Lamps."""
    environment: EnvironmentTable = EnvironmentTable()
    """Light from all around."""
    background: BackgroundTable = BackgroundTable()
    """What is behind the head."""
    correlated: tuple[Correlated, ...] = ()
    """Parameters that go together."""
    files: dict[str, str] = Field(default_factory=dict)
    """SHA-256 of each file that the spec names; found when it is read, and checked where it is stated."""
    folder: Path = Field(default=Path(), exclude=True)
    """Where those files lie; no part of a spec's text."""

    _drawing: Sampler = PrivateAttr()

    def model_post_init(self, context: Any) -> None:
        drawn = _drawn("", self)
        expressions = {**EXPRESSIONS, **self.expressions}
        check_spec(self, drawn, expressions)
        rows = {name: row for group in self.correlated for name, row in group.rows().items()}
        drawing = Sampler(self.seed, self.images_per_person, drawn, rows, expressions)
        BaseModel.__setattr__(self, "_drawing", drawing)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures [pixel]."""
        return self.render.size

    @property
    def distributions(self) -> Mapping[str, Distribution]:
        """By name of the parameter that is drawn from each."""
        return self._drawing.drawn

    @property
    def landmark_tables(self) -> Mapping[str, str]:
        """By name as the spec has it: a set's own, or the path of its table."""
        return {name: name if name in SETS else str(self.folder / name) for name in self.landmarks}

    @property
    def own_targets(self) -> frozenset[str]:
        """Morph targets that [pose] names, alone or as one of a pair."""
        return frozenset(targets_of(self.pose))

    def parameters(self, k: int) -> Parameters:
        """All that is drawn for image k, by name: numbers of six digits, and texts.

        The same on every machine and in any order; another distribution, or one more, changes no other
        parameter. An image lacks those that it does not use, such as of lamps that are not lit.

        Raises DermisError for an image that the data set does not have.
        """
        return self._drawing.parameters(whole_number("image", k, 0, self.count - 1))

    def text(self) -> str:
        """The spec in its canonical form: TOML of every value, which reads as the same spec."""
        values = plain_values(self)
        values = {"count": values.pop("count"), "seed": values.pop("seed"), "size": self.size} | values
        values["render"] = self.render.model_dump(exclude=set(ELSEWHERE), exclude_none=True)
        return tables_text({name: one for name, one in values.items() if name != "folder"})

    def digest(self) -> str:
        """SHA-256 of the text, by which a data set is known."""
        return hashlib.sha256(self.text().encode()).hexdigest()


def _drawn(name: str, value: Any) -> dict[str, Distribution]:
    """Distributions by the dotted names of their keys."""
    if isinstance(value, Distribution):
        return {name: value}
    parts = plain_values(value) if isinstance(value, Plain) else value
    if not isinstance(parts, Mapping):
        return {}
    start = f"{name}." if name else ""
    return {key: one for part, below in parts.items() for key, one in _drawn(f"{start}{part}", below).items()}


def load_spec(path: str | Path, **values: Any) -> Spec:
    """The spec of a TOML file; files that it names lie relative to its folder.

    values : `count`, `seed` or `size` in place of the file's

    Raises DermisError, naming table and key, for what cannot be drawn and for files that are not there.
    """
    path = named_path(path, "a spec of a data set in TOML")
    tables = read_toml(path, "a spec of a data set in TOML")
    with about(path):
        return spec_of({**tables, **values}, path.parent)


def spec_of(tables: Mapping[str, Any], folder: Path = Path()) -> Spec:
    """The spec of tables as TOML has them.

    folder : where the files lie that it names

    Raises DermisError as `load_spec` does.
    """
    if "folder" in tables:
        refuse("folder", "no such key", "it came", "Files lie relative to the spec's own folder")
    given = {
        name: table if name == "files" else matched(table, folder, name) for name, table in tables.items()
    }
    given["render"] = _render(given.pop("size", (512, 512)), given.get("render", {}))
    if isinstance(groups := given.get("correlated", ()), list | tuple):
        given["correlated"] = tuple(_made(Correlated, "correlated", group) for group in groups)
    spec = _made(Spec, "", given | {"folder": folder})
    ends = [end for name in _FILES if name in spec.distributions for end in spec.distributions[name].ends]
    tables_named = (name for name in spec.landmarks if name not in SETS)
    found = hashes([*map(str, ends), *tables_named], folder)
    if spec.files:
        check_hashes(spec.files, found)
    return spec.replace(files=found) if found else spec


def example_text() -> str:
    """A spec with comments that can be drawn as it is."""
    return resources.files(__package__).joinpath("example.toml").read_text("utf-8")


def _render(size: Any, table: Any) -> Settings:
    if isinstance(table, Mapping):
        for key in ELSEWHERE.keys() & table.keys():
            refuse(
                f"render: {key}", "it elsewhere in a spec", "it came here", f"Write it as {ELSEWHERE[key]}"
            )
    return _made(
        Settings, "render", {**RENDER, **table, "size": size} if isinstance(table, Mapping) else table
    )


def _made(kind: type[P], where: str, table: Any) -> P:
    """A model of a table and of those below it, which are named when they cannot be."""
    if isinstance(table, kind):
        return table
    if not isinstance(table, Mapping):
        refuse(
            where, f"a table with {', '.join(kind.model_fields)}", f"{shown_value(table)} came", "Correct it"
        )
    values = dict(table)
    for name, info in kind.model_fields.items():
        if name in values and isinstance(info.annotation, type) and issubclass(info.annotation, Plain):
            values[name] = _made(info.annotation, f"{where}.{name}" if where else name, values[name])
    try:
        return kind(**values)
    except ImpossibleError as error:
        raise ImpossibleError(where or "spec", error.findings) from None


HEADER = "# A data set of dermis: lengths in mm, colours linear Rec. 709."


def tables_text(values: Mapping[str, Any]) -> str:
    """The TOML of values, distributions, tables and lists of tables, by name."""
    return "\n".join([HEADER, *_tables("", values)])


def plain_values(table: Plain) -> dict[str, Any]:
    """Fields by name, those left out that have no value."""
    return {
        name: getattr(table, name) for name in type(table).model_fields if getattr(table, name) is not None
    }


def _tables(title: str, values: Mapping[str, Any]) -> list[str]:
    own, below = dict[str, Any](), list[str]()
    for name, value in values.items():
        whole = f"{title}.{key_text(name)}" if title else key_text(name)
        if isinstance(value, Plain):
            below += _tables(whole, plain_values(value))
        elif isinstance(value, Mapping):
            below += _tables(whole, value)
        elif isinstance(value, tuple) and value and isinstance(value[0], Plain):
            below += [table_text(f"[[{whole}]]", plain_values(one)) for one in value]
        else:
            own[name] = value.told() if isinstance(value, Distribution) else value
    return [table_text(f"[{title}]" if title else "", own), *below] if own or not below else below


_MOST_FILES = 100_000
_MOST_BYTES = 4 << 30


def matched(value: Any, folder: Path, key: str) -> Any:
    """A value of a spec with the files of each {files = PATTERN} in it found, in the order of their names.

    key : of the value

    Raises DermisError for patterns that no file matches.
    """
    if isinstance(value, Mapping):
        if value.keys() == {"files"} and isinstance(value["files"], str):
            return _files(value["files"], folder, key)
        return {name: matched(one, folder, f"{key}.{name}") for name, one in value.items()}
    return value


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


def hashes(names: Iterable[str], folder: Path) -> dict[str, str]:
    """SHA-256 of those names that are files, sorted."""
    found = {}
    for name in sorted(set(names)):
        if is_file(folder / name):
            data = read_file(folder / name, "a file that the spec names", _MOST_BYTES)
            found[name] = hashlib.sha256(data).hexdigest()
    return found


def check_hashes(stated: Mapping[str, str], found: Mapping[str, str]) -> None:
    """Refuse files that are not those that a spec was made with."""
    for name in sorted(stated.keys() | found.keys()):
        if stated.get(name) != found.get(name):
            expected = f"the file of hash {stated[name][:16]}..." if name in stated else "no such file"
            came = f"it has {found[name][:16]}..." if name in found else "there is none"
            refuse(f"files: {name}", expected, came, "Put it back, or take [files] out for another data set")
