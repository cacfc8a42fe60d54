"""Preprocessor for WGSL files, with compile errors that name file and line.

Each directive is a line of its own:

- `//#include "name.wgsl"`: inserts another file, once;
- `//#include <list>`: inserts the file of each member of a list;
- `//#each list: text`: inserts the text for each member with its {name}, {NAME}, {number} and words;
- `//#fill text`: inserts the text with a number from Python for each {word};
- `//#if NAME`, `//#else`, `//#end`: keep lines for programs with that option, or without it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import NamedTuple

from dermis.base.errors import DermisError

_DIRECTIVE = re.compile(
    r'^(?P<indent>\s*)//#(?:include "(?P<file>[\w./]+)"|include <(?P<files>\w+)>'
    r"|each (?P<list>\w+): (?P<text>.*)|fill (?P<filled>.*)|if (?P<option>\w+)|(?P<turn>else|end))\s*$"
)
_WORD = re.compile(r"\{(\w+)\}")
_ERROR_LINE = re.compile(r"(?:wgsl|shader[^:\n]*|source):(\d+):(\d+)")

Words = tuple[tuple[str, str], ...]


class Member(NamedTuple):
    """Member of a list of shaders, such as one model of a registry.

    name : name in scene files; in shaders, {name} has underscores for hyphens and {NAME} is in capitals
    file : shader file; None if the member has none
    words : replacements for other {words} in `//#each` lines
    """

    name: str
    file: Path | None
    words: Words = ()


@dataclass(frozen=True, eq=False)
class ShaderFolder(os.PathLike[str]):
    """A folder of shaders with the lists, numbers and options of its directives.

    lists : functions that return the members of each list, called whenever a shader is composed
    numbers : function that returns the constants that shaders share with Python, called likewise
    options : names for which `//#if` is true, in shaders of all folders
    """

    path: Path
    lists: Mapping[str, Callable[[], Sequence[Member]]] = field(default_factory=dict)
    numbers: Callable[[], Mapping[str, float]] = dict
    options: frozenset[str] = frozenset()

    def __fspath__(self) -> str:
        """Return the path as a string."""
        return str(self.path)


Folder = os.PathLike[str]


@dataclass(frozen=True)
class Source:
    """A composed shader: its text, and the file and line number that each of its lines comes from."""

    text: str
    origin: tuple[tuple[str, int], ...]

    def locate(self, message: str) -> str:
        """Return a message of the compiler with its line numbers replaced by file:line."""

        def replacement(match: re.Match[str]) -> str:
            line = int(match[1])
            if not 0 < line <= len(self.origin):
                return match[0]
            file, number = self.origin[line - 1]
            return f"{file}:{number}:{match[2]}"

        return _ERROR_LINE.sub(replacement, message)


def compose(path: Path, folders: Sequence[Folder]) -> Source:
    """Return the shader at `path` with its directives expanded.

    folders : folders in which includes are looked up that are not beside the including file

    Raises DermisError for a missing file, list, {word} or `//#end`.
    """
    shared = [folder for folder in folders if isinstance(folder, ShaderFolder)]
    lists = {name: tuple(members()) for folder in shared for name, members in folder.lists.items()}
    numbers = {name: repr(value) for folder in shared for name, value in folder.numbers().items()}
    options = frozenset[str]().union(*(folder.options for folder in shared))
    definitions = _Definitions(
        tuple(map(Path, folders)), tuple(lists.items()), tuple(numbers.items()), options
    )
    return _compose(path, definitions)


class _Definitions(NamedTuple):
    """Folders, lists, numbers and options that directives refer to."""

    folders: tuple[Path, ...]
    lists: tuple[tuple[str, tuple[Member, ...]], ...]
    numbers: Words
    options: frozenset[str]


@cache
def _compose(path: Path, definitions: _Definitions) -> Source:
    composer = _Composer(definitions)
    composer.insert(path)
    text, origin = zip(*composer.lines, strict=True) if composer.lines else ((), ())
    return Source("\n".join(text), origin)


class _Composer:
    """Expansion of one shader's directives.

    lines : lines so far, each with the file and line number that it comes from
    """

    def __init__(self, definitions: _Definitions) -> None:
        self._folders, self._options = definitions.folders, definitions.options
        self._lists, self._numbers = dict(definitions.lists), dict(definitions.numbers)
        self._included: set[Path] = set()
        self.lines: list[tuple[str, tuple[str, int]]] = []

    def insert(self, path: Path) -> None:
        if path in self._included:
            return
        self._included.add(path)
        conditions: list[bool] = []  # of each open `//#if`
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            directive = _DIRECTIVE.match(line)
            if directive and (directive["option"] or directive["turn"]):
                self._update_conditions(conditions, directive, path)
            elif not all(conditions):
                continue
            elif directive is None:
                self.lines.append((line, (path.name, number)))
            elif name := directive["file"]:
                self.insert(self._find(name, path))
            elif name := directive["files"]:
                for member in self._members(name, path):
                    if member.file is not None:
                        self.insert(member.file)
            else:
                self.lines += [(text, (path.name, number)) for text in self._expanded(directive, path)]

        if conditions:
            raise DermisError(f"{path.name}: expected //#end after //#if, but the file ends.")

    def _update_conditions(self, conditions: list[bool], directive: re.Match[str], file: Path) -> None:
        """Apply an `//#if`, `//#else` or `//#end`."""
        if option := directive["option"]:
            conditions.append(option in self._options)
        elif not conditions:
            raise DermisError(f"{file.name}: expected //#if before //#{directive['turn']}, but got none.")
        elif directive["turn"] == "else":
            conditions[-1] = not conditions[-1]
        else:
            conditions.pop()

    def _expanded(self, directive: re.Match[str], file: Path) -> list[str]:
        """Return the lines that `//#each` or `//#fill` expands to."""
        if text := directive["filled"]:
            return [directive["indent"] + _fill(text, self._numbers, file)]
        members = enumerate(self._members(directive["list"], file))
        each = [_words(member, number) for number, member in members]
        return [directive["indent"] + _fill(directive["text"], words, file) for words in each]

    def _find(self, name: str, file: Path) -> Path:
        for folder in (file.parent, *self._folders):
            if (folder / name).is_file():
                return folder / name
        raise DermisError(f'{file.name}: expected to find the include "{name}", but no shader folder has it.')

    def _members(self, name: str, file: Path) -> Sequence[Member]:
        if name not in self._lists:
            raise DermisError(
                f"{file.name}: expected to find the list <{name}>, but no shader folder has it."
            )
        return self._lists[name]


def _words(member: Member, number: int) -> dict[str, str]:
    name = member.name.replace("-", "_")
    return {"name": name, "NAME": name.upper(), "number": f"{number}u", **dict(member.words)}


def _fill(text: str, words: Mapping[str, str], file: Path) -> str:
    def replacement(match: re.Match[str]) -> str:
        if match[1] not in words:
            raise DermisError(f"{file.name}: expected a word of {', '.join(words)}, but got {match[0]}.")
        return words[match[1]]

    return _WORD.sub(replacement, text)
