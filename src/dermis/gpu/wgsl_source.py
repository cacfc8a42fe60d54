"""Preprocessor for WGSL files, which maps lines of compile errors back to the files.

Each directive is a line of its own:

- `//#include "name.wgsl"`: inserts another file, once;
- `//#include <list>`: inserts the file of each member of a list;
- `//#each list: text`: inserts the text for each member, with {name}, {NAME}, {number} and {words} replaced;
- `//#fill text`: inserts the text, with each {word} replaced by a number from Python;
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

_DIRECTIVE_PATTERN = re.compile(
    r'^(?P<indent>\s*)//#(?:include "(?P<file>[\w./]+)"|include <(?P<files>\w+)>'
    r"|each (?P<list>\w+): (?P<text>.*)|fill (?P<filled>.*)|if (?P<option>\w+)|(?P<turn>else|end))\s*$"
)
_WORD_PATTERN = re.compile(r"\{(\w+)\}")
_ERROR_LINE_PATTERN = re.compile(r"(?:wgsl|shader[^:\n]*|source):(\d+):(\d+)")

WordReplacements = tuple[tuple[str, str], ...]


class ShaderListMember(NamedTuple):
    """Member of a list that `//#include <list>` and `//#each list` expand, such as one light type.

    name : name in scene files; in shaders, {name} has underscores for hyphens and {NAME} is in capitals
    file : shader file to include; None for a member without a file
    words : pairs (word, replacement) for other {word}s in `//#each` lines
    """

    name: str
    file: Path | None
    words: WordReplacements = ()


@dataclass(frozen=True, eq=False)
class ShaderFolder(os.PathLike[str]):
    """Folder of shaders, with the definitions that their directives refer to.

    path : path of the folder
    lists : dictionary from list name to a function that returns the members of the list; called whenever a
        shader is composed
    numbers : function that returns a dictionary of constants that shaders and Python share; called whenever a
        shader is composed
    options : names for which `//#if` is true in the shaders of all folders
    """

    path: Path
    lists: Mapping[str, Callable[[], Sequence[ShaderListMember]]] = field(default_factory=dict)
    numbers: Callable[[], Mapping[str, float]] = dict
    options: frozenset[str] = frozenset()

    def __fspath__(self) -> str:
        """Return the path of the folder, so that it can be used as a path."""
        return str(self.path)


Folder = os.PathLike[str]


@dataclass(frozen=True)
class ShaderSource:
    """Composed shader: its text, and the original file and line number of each line."""

    text: str
    origin: tuple[tuple[str, int], ...]

    def locate(self, compiler_message: str) -> str:
        """Return a compiler message with original file:line instead of line numbers of the composed text."""

        def file_and_line(match: re.Match[str]) -> str:
            line = int(match[1])
            if not 0 < line <= len(self.origin):
                return match[0]
            file, number = self.origin[line - 1]
            return f"{file}:{number}:{match[2]}"

        return _ERROR_LINE_PATTERN.sub(file_and_line, compiler_message)


def compose_shader(path: Path, folders: Sequence[Folder]) -> ShaderSource:
    """Return a shader with its directives expanded.

    path : file of the shader
    folders : folders that are searched for an included file if it is not next to the including file

    Raises DermisError if an included file or a list does not exist, if a {word} has no replacement, or if
    `//#if`, `//#else` and `//#end` do not match.
    """
    shared = [folder for folder in folders if isinstance(folder, ShaderFolder)]
    lists = {name: tuple(members()) for folder in shared for name, members in folder.lists.items()}
    numbers = {name: repr(value) for folder in shared for name, value in folder.numbers().items()}
    options = frozenset[str]().union(*(folder.options for folder in shared))
    definitions = _Definitions(
        tuple(map(Path, folders)), tuple(lists.items()), tuple(numbers.items()), options
    )
    return _compose_with_definitions(path, definitions)


class _Definitions(NamedTuple):
    """Definitions that the directives of shaders refer to; they are hashable, to be part of a cache key.

    folders : folders that are searched for included files
    lists : pairs of the name and the members of each list for `//#include <list>` and `//#each`
    numbers : pairs of a {word} of `//#fill` and the number, as text, that replaces it
    options : names for which `//#if` is true
    """

    folders: tuple[Path, ...]
    lists: tuple[tuple[str, tuple[ShaderListMember, ...]], ...]
    numbers: WordReplacements
    options: frozenset[str]


@cache
def _compose_with_definitions(path: Path, definitions: _Definitions) -> ShaderSource:
    composer = _Composer(definitions)
    composer.insert_file(path)
    text, origin = zip(*composer.lines, strict=True) if composer.lines else ((), ())
    return ShaderSource("\n".join(text), origin)


class _Composer:
    """Composer that expands the directives of one shader.

    lines : composed lines so far, each with its original file and line number
    """

    def __init__(self, definitions: _Definitions) -> None:
        self._folders, self._options = definitions.folders, definitions.options
        self._lists, self._numbers = dict(definitions.lists), dict(definitions.numbers)
        self._included: set[Path] = set()
        self.lines: list[tuple[str, tuple[str, int]]] = []

    def insert_file(self, path: Path) -> None:
        if path in self._included:
            return
        self._included.add(path)
        conditions: list[bool] = []  # whether each open `//#if` holds
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            directive = _DIRECTIVE_PATTERN.match(line)
            if directive and (directive["option"] or directive["turn"]):
                self._update_conditions(conditions, directive, path)
            elif not all(conditions):
                continue
            elif directive is None:
                self.lines.append((line, (path.name, number)))
            elif name := directive["file"]:
                self.insert_file(self._find_file(name, path))
            elif name := directive["files"]:
                for member in self._list_members(name, path):
                    if member.file is not None:
                        self.insert_file(member.file)
            else:
                self.lines += [(text, (path.name, number)) for text in self._expand_lines(directive, path)]

        if conditions:
            raise DermisError(f"{path.name}: expected //#end after //#if, but the file ends.")

    def _update_conditions(self, conditions: list[bool], directive: re.Match[str], shader_file: Path) -> None:
        """Apply a directive `//#if`, `//#else` or `//#end` to the stack of open conditions."""
        if option := directive["option"]:
            conditions.append(option in self._options)
        elif not conditions:
            raise DermisError(
                f"{shader_file.name}: expected //#if before //#{directive['turn']}, but got none."
            )
        elif directive["turn"] == "else":
            conditions[-1] = not conditions[-1]
        else:
            conditions.pop()

    def _expand_lines(self, directive: re.Match[str], shader_file: Path) -> list[str]:
        """Return the lines that replace a directive `//#each` or `//#fill`."""
        if text := directive["filled"]:
            return [directive["indent"] + _substitute_words(text, self._numbers, shader_file)]
        members = enumerate(self._list_members(directive["list"], shader_file))
        each = [_member_substitutions(member, number) for number, member in members]
        return [
            directive["indent"] + _substitute_words(directive["text"], words, shader_file) for words in each
        ]

    def _find_file(self, included_name: str, source_file: Path) -> Path:
        for folder in (source_file.parent, *self._folders):
            if (folder / included_name).is_file():
                return folder / included_name
        raise DermisError(
            f'{source_file.name}: expected to find the include "{included_name}", but no shader folder has '
            "it."
        )

    def _list_members(self, list_name: str, source_file: Path) -> Sequence[ShaderListMember]:
        if list_name not in self._lists:
            raise DermisError(
                f"{source_file.name}: expected to find the list <{list_name}>, but no shader folder has it."
            )
        return self._lists[list_name]


def _member_substitutions(member: ShaderListMember, member_number: int) -> dict[str, str]:
    name = member.name.replace("-", "_")
    return {"name": name, "NAME": name.upper(), "number": f"{member_number}u", **dict(member.words)}


def _substitute_words(text: str, words: Mapping[str, str], shader_file: Path) -> str:
    def replacement_of_word(match: re.Match[str]) -> str:
        if match[1] not in words:
            raise DermisError(
                f"{shader_file.name}: expected a word of {', '.join(words)}, but got {match[0]}."
            )
        return words[match[1]]

    return _WORD_PATTERN.sub(replacement_of_word, text)
