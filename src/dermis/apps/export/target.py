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
from dermis.base.errors import format_value, refuse
from dermis.optics.cumulative_profile import CumulativeProfile

Value = bool | int | float | str | tuple[float, ...]
T = TypeVar("T", bound="Target")


@dataclass(frozen=True)
class Parameter:
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


Parameters = tuple[Parameter, ...]


def get_value(parameters: Parameters, name: str) -> Value:
    """Return the value of the row of a name."""
    return next(one.value for one in parameters if one.name == name)


def get_numbers(parameters: Parameters, name: str) -> tuple[float, ...]:
    """Return the value of the row of a name as numbers; one number is a tuple of one."""
    value = get_value(parameters, name)
    return value if isinstance(value, tuple) else (float(value),)


def replace_values(parameters: Parameters, values: Mapping[str, Value]) -> Parameters:
    """Return the rows with other values by name."""
    return tuple(replace(one, value=values.get(one.name, one.value)) for one in parameters)


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
    limitations: ClassVar[str]
    """What stays wrong there, in one or two sentences."""
    untested: ClassVar[bool] = False
    """Whether nobody has run the program with what is written."""

    def with_variant(self: T, variant: str | None) -> T:
        """Return this target in one of its variants, the first where None.

        DermisError : it has no such variant
        """
        if variant is None:
            return replace(self, variant=self.variants[0] if self.variants else "")
        if variant not in self.variants:
            expected = f"one of {', '.join(self.variants)}" if self.variants else f"none for {self.name}"
            refuse("variant", expected, f"got {format_value(variant)}", "Correct it")
        return replace(self, variant=variant)

    def with_library(self, folder: str | Path) -> Target:
        """Return this target with the library that it draws with, to be written into its page.

        DermisError : it draws with none
        """
        refuse("library", f"none for {self.name}", f"got {format_value(str(folder))}", "Omit this option")

    def resolve_version(self, version: str | None) -> str:
        """Return the requested version, the newest where None.

        DermisError : it is not known
        """
        if version is None:
            return self.versions[-1]
        if version not in self.versions:
            expected = f"a supported version of {self.title}: {', '.join(self.versions)}"
            refuse(
                "version",
                expected,
                f"got {format_value(version)}",
                "Choose the nearest, and check the result",
            )
        return version

    def main_file(self, output: Path, subject: Subject, suffix: str = "") -> Path:
        """Return the main file: the place itself, or one in it where it is a folder.

        suffix : of the file in a folder, the usual one by default
        """
        suffix = suffix or next(filter(None, self.suffixes))
        return output if output.suffix else output / f"{subject.identifier}{suffix}"

    @abstractmethod
    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters that show the subject best."""

    @abstractmethod
    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return what a user would type who does not know what the numbers mean in this program."""

    @abstractmethod
    def predicted_curve(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the curve that the target shows with parameters, by its own formulas."""

    @abstractmethod
    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the files that the target reads; return their paths.

        place : a folder that is empty, where the output's name has no suffix; else a file of that name in
            such a folder, beside which others may be put. It is moved to where it belongs afterwards
        """


class JsonTarget(Target):
    """A program that nobody has run with the parameters: a JSON file of them with units and meanings."""

    suffixes = (".json", "")
    untested = True

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the parameters, marked as not run."""
        file = self.main_file(output, subject)
        content = {
            "for": f"{self.title} {version}",
            "status": "not run: by published documentation",
            "skin": subject.name,
            "profile": subject.model,
            "parameters": {
                one.name: {"value": one.value, "unit": one.unit, "meaning": one.meaning} for one in parameters
            },
            "remains_wrong": self.limitations,
        }
        file.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        return [file]
