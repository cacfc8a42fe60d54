"""Programs that skin is exported to, and the parameters that are typed into them."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.export.subject import Subject
from dermis.base.errors import refuse, shown_value
from dermis.optics.curve import Curve

Value = bool | int | float | str | tuple[float, ...]
T = TypeVar("T", bound="Target")


@dataclass(frozen=True)
class Row:
    """A parameter as it is typed into a target.

    name : in the target
    value : number, numbers of red, green and blue, switch or word
    unit : "mm", "m", "cm", "-" ...
    meaning : what the target takes it for, in a few words
    """

    name: str
    value: Value
    unit: str
    meaning: str


Rows = tuple[Row, ...]


def value_of(rows: Rows, name: str) -> Value:
    """Return the value of the row of a name."""
    return next(row.value for row in rows if row.name == name)


def numbers_of(rows: Rows, name: str) -> tuple[float, ...]:
    """Return the value of the row of a name as numbers; one number is a tuple of one."""
    value = value_of(rows, name)
    return value if isinstance(value, tuple) else (float(value),)


def with_values(rows: Rows, values: Mapping[str, Value]) -> Rows:
    """Return the rows with other values by name."""
    return tuple(replace(row, value=values.get(row.name, row.value)) for row in rows)


def floats(values: ArrayLike) -> tuple[float, ...]:
    """Return numbers as a tuple of plain floats."""
    return tuple(np.ravel(np.asarray(values, np.float64)).tolist())


def write_files(folder: Path, contents: Iterable[tuple[str, bytes]]) -> list[Path]:
    """Write files into a folder, by their names in it; return their paths."""
    written = []
    for name, content in contents:
        written.append(folder / name)
        written[-1].parent.mkdir(exist_ok=True)
        written[-1].write_bytes(content)
    return written


@dataclass(frozen=True)
class Target(ABC):
    """A program that skin is exported to; what differs within one version is its variant.

    variant : one of `variants`, "" where there are none
    side : of maps that are made [texel]
    adapter : that makes them
    """

    variant: str = ""
    side: int = 2048
    adapter: str = "auto"

    name: ClassVar[str]
    title: ClassVar[str]
    """The program's name as it is written."""
    suffixes: ClassVar[tuple[str, ...]]
    """What the output's name may end in, the usual first; "" is a folder."""
    versions: ClassVar[tuple[str, ...]]
    """Known versions, oldest first; the newest is the default."""
    variants: ClassVar[tuple[str, ...]] = ()
    """Methods of scattering, say; the first is the default."""
    needs_maps: ClassVar[bool] = False
    """Whether the maps of a head have to be arrays before `write`: they are then painted."""
    wrong: ClassVar[str]
    """What stays wrong there, in one or two sentences."""
    not_run: ClassVar[bool] = False
    """Whether nobody has run the program with what is written."""

    def with_variant(self: T, variant: str | None) -> T:
        """Return this target in one of its variants, the first where None.

        DermisError : it has no such variant
        """
        if variant is None:
            return replace(self, variant=self.variants[0] if self.variants else "")
        if variant not in self.variants:
            expected = f"one of {', '.join(self.variants)}" if self.variants else f"none for {self.name}"
            refuse("variant", expected, f"{shown_value(variant)} came", "Correct it")
        return replace(self, variant=variant)

    def with_library(self, folder: str | Path) -> Target:
        """Return this target with the library that it draws with, to be written into its page.

        DermisError : it draws with none
        """
        refuse("library", f"none for {self.name}", f"{shown_value(str(folder))} came", "Leave it out")

    def known_version(self, version: str | None) -> str:
        """Return the requested version, the newest where None.

        DermisError : it is not known
        """
        if version is None:
            return self.versions[-1]
        if version not in self.versions:
            expected = f"a version of {self.title} that is known: {', '.join(self.versions)}"
            refuse("version", expected, f"{shown_value(version)} came", "Choose the nearest, and check it")
        return version

    def file_in(self, place: Path, subject: Subject, suffix: str = "") -> Path:
        """Return the main file: the place itself, or one in it where it is a folder.

        suffix : of the file in a folder, the usual one by default
        """
        suffix = suffix or next(filter(None, self.suffixes))
        return place if place.suffix else place / f"{subject.identifier}{suffix}"

    @abstractmethod
    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the parameters that show the subject best."""

    @abstractmethod
    def naive(self, subject: Subject, version: str) -> Rows:
        """Return what a user would type who does not know what the numbers mean in this program."""

    @abstractmethod
    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve that the target shows with parameters, by its own formulas."""

    @abstractmethod
    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the files that the target reads; return their paths.

        place : a folder that is empty, where the output's name has no suffix; else a file of that name in
            such a folder, beside which others may be put. It is moved to where it belongs afterwards
        """


class ParameterTable(Target):
    """A program that nobody has run with the parameters: a JSON file of them with units and meanings."""

    suffixes = (".json", "")
    not_run = True

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the parameters, marked as not run."""
        file = self.file_in(place, subject)
        told = {
            "for": f"{self.title} {version}",
            "status": "not run: by the published meanings",
            "skin": subject.name,
            "profile": subject.model,
            "parameters": {
                row.name: {"value": row.value, "unit": row.unit, "meaning": row.meaning} for row in rows
            },
            "remains_wrong": self.wrong,
        }
        file.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
        return [file]
