"""WGSL files with `//#include "name.wgsl"`, and compile errors that name file and line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from dermis.errors import DermisError

_INCLUDE = re.compile(r'^//#include "([\w./]+)"\s*$')
_ERROR_LINE = re.compile(r"(?:wgsl|shader[^:\n]*|source):(\d+):(\d+)")


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


@cache
def compose(path: Path, folders: tuple[Path, ...]) -> Source:
    """The shader at `path` with its includes, each inserted once, looked up in `folders`."""
    lines: list[str] = []
    origin: list[tuple[str, int]] = []
    _insert(path, folders, set(), lines, origin)
    return Source("\n".join(lines), tuple(origin))


def _insert(
    path: Path, folders: tuple[Path, ...], seen: set[Path], lines: list[str], origin: list[tuple[str, int]]
) -> None:
    if path in seen:
        return
    seen.add(path)
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if include := _INCLUDE.match(line):
            _insert(_find(include[1], path, folders), folders, seen, lines, origin)
        else:
            lines.append(line)
            origin.append((path.name, number))


def _find(name: str, asker: Path, folders: tuple[Path, ...]) -> Path:
    for folder in (asker.parent, *folders):
        if (folder / name).is_file():
            return folder / name
    raise DermisError(f'{asker.name}: expected to find the include "{name}", but no shader folder has it.')
