"""WGSL files with directives, and compile errors that name file and line.

A directive takes a whole line:

- `//#include "name.wgsl"`: another file, inserted once;
- `//#include <list>`: the file of each member of a list;
- `//#each list: text`: the text once for each member, with its {name}, {NAME}, {number} and words filled in;
- `//#fill text`: the text with a number from Python for each {word};
- `//#if NAME`, `//#else`, `//#end`: lines for programs with that option, and for those without it.
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
    """One of a list of shaders to which others may be added.

    name : as in scene files; in shaders {name} has underscores for hyphens, and {NAME} is in capitals
    file : of its shader; None where it has none of its own
    words : replacements for other {words} in repeated lines
    """

    name: str
    file: Path | None
    words: Words = ()


@dataclass(frozen=True, eq=False)
class ShaderFolder(os.PathLike[str]):
    """A folder of shaders with the lists, numbers and options that directives use.

    lists : members of each list, called for whenever a shader is composed
    numbers : constants that Python uses too, called for likewise
    options : names for which `//#if` holds, in shaders of all folders
    """

    path: Path
    lists: Mapping[str, Callable[[], Sequence[Member]]] = field(default_factory=dict)
    numbers: Callable[[], Mapping[str, float]] = dict
    options: frozenset[str] = frozenset()

    def __fspath__(self) -> str:
        return str(self.path)


Folder = os.PathLike[str]


@dataclass(frozen=True)
class Source:
    """A composed shader: its text and, line by line, the file and line it came from."""

    text: str
    origin: tuple[tuple[str, int], ...]

    def locate(self, message: str) -> str:
        """The compiler's message with its line numbers turned into file:line."""

        def named(match: re.Match[str]) -> str:
            line = int(match[1])
            if not 0 < line <= len(self.origin):
                return match[0]
            file, number = self.origin[line - 1]
            return f"{file}:{number}:{match[2]}"

        return _ERROR_LINE.sub(named, message)


def compose(path: Path, folders: Sequence[Folder]) -> Source:
    """The shader at `path` with its directives carried out.

    folders : where includes are looked up that are not beside the including file

    Raises DermisError for a missing file, list, {word} or `//#end`.
    """
    shared = [folder for folder in folders if isinstance(folder, ShaderFolder)]
    lists = {name: tuple(members()) for folder in shared for name, members in folder.lists.items()}
    numbers = {name: repr(value) for folder in shared for name, value in folder.numbers().items()}
    options = frozenset[str]().union(*(folder.options for folder in shared))
    meant = _Meaning(tuple(map(Path, folders)), tuple(lists.items()), tuple(numbers.items()), options)
    return _compose(path, meant)


class _Meaning(NamedTuple):
    """What directives find in folders."""

    folders: tuple[Path, ...]
    lists: tuple[tuple[str, tuple[Member, ...]], ...]
    numbers: Words
    options: frozenset[str]


@cache
def _compose(path: Path, meant: _Meaning) -> Source:
    composed = _Composed(meant)
    composed.insert(path)
    text, origin = zip(*composed.lines, strict=True) if composed.lines else ((), ())
    return Source("\n".join(text), origin)


class _Composed:
    """lines : each with the file and line that it came from"""

    def __init__(self, meant: _Meaning) -> None:
        self._folders, self._options = meant.folders, meant.options
        self._lists, self._numbers = dict(meant.lists), dict(meant.numbers)
        self._seen: set[Path] = set()
        self.lines: list[tuple[str, tuple[str, int]]] = []

    def insert(self, path: Path) -> None:
        if path in self._seen:
            return
        self._seen.add(path)
        holds: list[bool] = []  # of each `//#if` that is open
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            directive = _DIRECTIVE.match(line)
            if directive and (directive["option"] or directive["turn"]):
                self._choose(holds, directive, path)
            elif not all(holds):
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
                self.lines += [(text, (path.name, number)) for text in self._filled(directive, path)]

        if holds:
            raise DermisError(f"{path.name}: expected //#end after //#if, but the file ends.")

    def _choose(self, holds: list[bool], directive: re.Match[str], asker: Path) -> None:
        """Begin, turn or end the lines of an option."""
        if option := directive["option"]:
            holds.append(option in self._options)
        elif not holds:
            raise DermisError(f"{asker.name}: expected //#if before //#{directive['turn']}, but none came.")
        elif directive["turn"] == "else":
            holds[-1] = not holds[-1]
        else:
            holds.pop()

    def _filled(self, directive: re.Match[str], asker: Path) -> list[str]:
        """The lines that a directive expands to."""
        if text := directive["filled"]:
            return [directive["indent"] + _fill(text, self._numbers, asker)]
        members = enumerate(self._members(directive["list"], asker))
        each = [_naming(member, number) for number, member in members]
        return [directive["indent"] + _fill(directive["text"], words, asker) for words in each]

    def _find(self, name: str, asker: Path) -> Path:
        for folder in (asker.parent, *self._folders):
            if (folder / name).is_file():
                return folder / name
        came = f'expected to find the include "{name}", but no shader folder has it.'
        raise DermisError(f"{asker.name}: {came}")

    def _members(self, name: str, asker: Path) -> Sequence[Member]:
        if name not in self._lists:
            raise DermisError(
                f"{asker.name}: expected to find the list <{name}>, but no shader folder has it."
            )
        return self._lists[name]


def _naming(member: Member, number: int) -> dict[str, str]:
    name = member.name.replace("-", "_")
    return {"name": name, "NAME": name.upper(), "number": f"{number}u", **dict(member.words)}


def _fill(text: str, words: Mapping[str, str], asker: Path) -> str:
    def meant(match: re.Match[str]) -> str:
        if match[1] not in words:
            raise DermisError(f"{asker.name}: expected a word of {', '.join(words)}, but {match[0]} came.")
        return words[match[1]]

    return _WORD.sub(meant, text)
