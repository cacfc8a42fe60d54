"""Files that a spec names: found by pattern, known by their contents."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from dermis.apps.batch.distributions import Files
from dermis.base.errors import refuse
from dermis.base.reading import is_file, read_file

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
