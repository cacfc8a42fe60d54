"""Base classes of export targets, and the named parameters that they write."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.export.subject import Subject
from dermis.base.errors import format_value, refuse
from dermis.optics.cumulative_profile import CumulativeProfile

EXPORT_JSON_MEANING = "parameters, predicted errors and files as JSON"
ParameterValue = bool | int | float | str | tuple[float, ...]
T = TypeVar("T", bound="Target")


@dataclass(frozen=True)
class Parameter:
    """Named parameter of a program's skin material.

    name : name in the program
    value : number, tuple of red, green and blue, Boolean, or text
    unit : "mm", "m", "cm", "-" ...
    meaning : short description of what the parameter does in the program
    """

    name: str
    value: ParameterValue
    unit: str
    meaning: str


Parameters = tuple[Parameter, ...]


def get_value(parameters: Parameters, parameter_name: str) -> ParameterValue:
    """Return the value of the parameter with a given name."""
    return next(one.value for one in parameters if one.name == parameter_name)


def get_numbers(parameters: Parameters, parameter_name: str) -> tuple[float, ...]:
    """Return the value of a named parameter as a tuple of floats: one for a scalar, three for a colour."""
    value = get_value(parameters, parameter_name)
    return value if isinstance(value, tuple) else (float(value),)


def replace_values(parameters: Parameters, new_values: Mapping[str, ParameterValue]) -> Parameters:
    """Return a copy of `parameters` with the values in `new_values`, which maps parameter names to values."""
    return tuple(replace(one, value=new_values.get(one.name, one.value)) for one in parameters)


def flat_tuple(numbers: ArrayLike) -> tuple[float, ...]:
    """Return an array as a flat tuple of Python floats, for parameters and text files."""
    return tuple(np.ravel(np.asarray(numbers, np.float64)).tolist())


def write_files(output_folder: Path, names_and_contents: Iterable[tuple[str, bytes]]) -> list[Path]:
    """Write files, given as pairs of name and content, into a folder, and return their paths."""
    written = []
    for name, content in names_and_contents:
        written.append(output_folder / name)
        written[-1].parent.mkdir(parents=True, exist_ok=True)
        written[-1].write_bytes(content)
    return written


@dataclass(frozen=True)
class Target(ABC):
    """Export target: another program, and the conversion of skins and heads to files for this program.

    Subclasses are registered in `dermis.apps.export.registry.TARGETS`. A subclass converts a skin to
    parameters of the program, predicts the profile that the program renders with these parameters, and writes
    the files.

    Parameters
    ----------
    variant : str
        One of `variants`, or "" if the target has no variants.
    side : int
        Side of generated maps [texel].
    adapter : str
        Adapter on which maps are generated.

    Examples
    --------
    >>> from dermis.apps.export.registry import TARGETS
    >>> unity = TARGETS["unity"]
    >>> unity.title, unity.resolve_version(None)
    ('Unity HDRP', '17')
    >>> from dermis.apps.export.subject import load_subject
    >>> parameters = unity.parameters(load_subject("skin1"), "17")
    >>> [parameter.name for parameter in parameters][:2]
    ['scatteringDistance', 'scatteringDistanceMultiplier']
    """

    variant: str = ""
    side: int = 2048
    adapter: str = "auto"

    name: ClassVar[str]
    title: ClassVar[str]
    """Name of the program as its maker spells it."""
    suffixes: ClassVar[tuple[str, ...]]
    """Suffixes of output files, the default first; "" means a folder."""
    versions: ClassVar[tuple[str, ...]]
    """Supported versions, oldest first; the newest is the default."""
    variants: ClassVar[tuple[str, ...]] = ()
    """Names of alternative scattering methods or extensions; the first is the default."""
    needs_maps: ClassVar[bool] = False
    """Whether `write` needs the maps of a head as arrays, so that procedural maps are painted first."""
    shows_states: ClassVar[bool] = True
    """Whether the files contain the skin of a head, in which states such as a blush are visible."""
    limitations: ClassVar[str]
    """Differences from the reference that no parameters can remove, in one or two sentences."""
    part_limitations: ClassVar[str] = (
        "Only skin is exported; an export to gltf contains the other parts with their pictures."
    )
    """Limitations of eyes and other parts that are not skin; reported if these parts have texture images."""
    untested: ClassVar[bool] = False
    """Whether the exported files have not been tested in the program."""
    import_steps: ClassVar[tuple[str, ...]] = ()
    """Three steps that import the files into the program, for the README; see `steps`."""
    file_meanings: ClassVar[Mapping[str, str]] = {}
    """Contents of the target's files by the patterns of their names; see `guide.file_meaning` for others."""
    licence: ClassVar[str] = ""
    """Licence of the program's code that the files contain or load."""

    def with_variant(self: T, variant: str | None) -> T:
        """Return a copy of this target with a selected variant; None selects the first of `variants`.

        Parameters
        ----------
        variant : str or None
            Name of the variant.

        Returns
        -------
        Target
            A copy of the target.

        Raises
        ------
        DermisError
            If the target has no such variant.
        """
        if variant is None:
            return replace(self, variant=self.variants[0] if self.variants else "")
        if variant not in self.variants:
            expected = f"one of {', '.join(self.variants)}" if self.variants else f"none for {self.name}"
            refuse("variant", expected, f"got {format_value(variant)}", "Correct it")
        return replace(self, variant=variant)

    def with_embedded_library(self, node_modules_folder: str | Path) -> Target:
        """Return a copy of the target that embeds an installed JavaScript library in the web page.

        Parameters
        ----------
        node_modules_folder : str or Path
            npm folder node_modules that contains the library.

        Returns
        -------
        Target
            A copy of the target.

        Raises
        ------
        DermisError
            If the target uses no library.
        """
        refuse(
            "library",
            f"none for {self.name}",
            f"got {format_value(str(node_modules_folder))}",
            "Omit this option",
        )

    def resolve_version(self, version: str | None) -> str:
        """Return the requested version if it is supported; None selects the newest.

        Parameters
        ----------
        version : str or None
            Requested version.

        Returns
        -------
        str
            Supported version of the program.

        Raises
        ------
        DermisError
            If the version is not supported.
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
        """Return the path of the main file, which is the file that the user opens in the program.

        If `output` is a folder, the main file is inside this folder; otherwise, `output` is the main file.

        Parameters
        ----------
        output : Path
            Path that `write` receives.
        subject : Subject
            Skin or head to export; if `output` is a folder, the file is named after it.
        suffix : str
            Suffix of the file if `output` is a folder; by default the first of `suffixes`.

        Returns
        -------
        Path
            Path of the main file.
        """
        suffix = suffix or next(filter(None, self.suffixes))
        return output if output.suffix else output / f"{subject.identifier}{suffix}"

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return three steps that import the written files of a subject into the program, for the README.

        Parameters
        ----------
        subject : Subject
            Exported skin or head.
        files : sequence of PurePath
            Paths of the written files, relative to the folder of the README; the main file is first.

        Returns
        -------
        tuple of str
            `import_steps`, unless the steps depend on the subject or the files.
        """
        return self.import_steps

    @abstractmethod
    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters for which the program's profile is closest to the reference profile.

        Parameters
        ----------
        subject : Subject
            Skin to export.
        version : str
            Version of the program.

        Returns
        -------
        tuple of Parameter
            The parameters.
        """

    @abstractmethod
    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters that a user might choose without knowing their meaning in the program.

        The report shows the errors with these parameters beside the errors with the fitted parameters.

        Parameters
        ----------
        subject : Subject
            Skin to export.
        version : str
            Version of the program.

        Returns
        -------
        tuple of Parameter
            Naive parameters, with the same names as the fitted parameters.
        """

    @abstractmethod
    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile that the program renders, predicted by the formulas of the program.

        Parameters
        ----------
        parameters : tuple of Parameter
            Result of the method `parameters` or `naive_parameters`.
        subject : Subject
            Skin to export.
        version : str
            Version of the program.

        Returns
        -------
        CumulativeProfile
            Fraction of the emerging light that leaves within each radius, in each channel.
        """

    @abstractmethod
    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the files that the program reads, and return their paths.

        Parameters
        ----------
        subject : Subject
            Skin to export.
        parameters : tuple of Parameter
            Result of the method `parameters`.
        output : Path
            If the name has no suffix, an empty folder for all files. Otherwise, a new file in an empty
            folder, where further files may be written too. The caller moves all files to the final output.
        version : str
            Version of the program.

        Returns
        -------
        list of Path
            All written files.
        """


class JsonTarget(Target):
    """Base class of targets that only write a JSON file of parameters.

    The files have not been tested in the target programs.
    """

    suffixes = (".json", "")
    shows_states = False
    untested = True
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.json.json": EXPORT_JSON_MEANING,
        "export.json": EXPORT_JSON_MEANING,
        "*.json": "parameters of the material",
    }

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write a JSON file of the parameters with their units and meanings.

        The file also states that the parameters follow the target program's documentation, and have not been
        tested in that program.
        """
        file = self.main_file(output, subject)
        rows = {p.name: {"value": p.value, "unit": p.unit, "meaning": p.meaning} for p in parameters}
        content = {
            "for": f"{self.title} {version}",
            "status": "not run: by published documentation",
            "skin": subject.name,
            "profile": subject.model,
            "parameters": rows,
            "remains_wrong": self.limitations,
        }
        file.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        return [file]
