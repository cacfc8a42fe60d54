"""Files that a spec names: patterns of file names, and hashes of the files' content."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from dermis.apps.batch.distributions import FileChoice
from dermis.base.errors import refuse
from dermis.base.reading import is_file, read_file

_MAX_MATCHING_FILES = 100_000
_MAX_HASHED_BYTES = 4 << 30


def expand_patterns(spec_value: object, folder: Path, dotted_name: str) -> object:
    """Return a spec value with each {files = PATTERN} replaced by a `FileChoice` of the matching files.

    folder : folder of the spec, to which patterns are relative
    dotted_name : dotted name of the value in error messages

    Raises DermisError for a pattern that matches no file.
    """
    if not isinstance(spec_value, Mapping):
        return spec_value
    if spec_value.keys() == {"files"} and isinstance(spec_value["files"], str):
        return _match_files(spec_value["files"], folder, dotted_name)
    return {name: expand_patterns(one, folder, f"{dotted_name}.{name}") for name, one in spec_value.items()}


def _match_files(pattern: str, folder: Path, dotted_name: str) -> FileChoice:
    names = []
    try:
        for path in folder.glob(pattern):
            if is_file(path):
                names.append(Path(os.path.relpath(path, folder)).as_posix())
            if len(names) > _MAX_MATCHING_FILES:
                break
    except (ValueError, NotImplementedError, OSError, RecursionError) as fault:
        actual = f"got {pattern!r} ({fault or type(fault).__name__})"
        refuse(
            dotted_name,
            "a pattern of files below the spec's folder, such as heads/*.json",
            actual,
            "Correct it",
        )
    if not 0 < len(names) <= _MAX_MATCHING_FILES:
        actual = f"more than {_MAX_MATCHING_FILES:,} match" if names else "none matches"
        refuse(
            dotted_name, f"files that match {pattern!r} in the spec's folder", actual, "Correct the pattern"
        )
    return FileChoice(pattern, tuple(sorted(names)))


def file_hashes(file_names: Iterable[str], folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each named file that exists in the spec's folder, sorted by name."""
    found = {}
    for name in sorted(set(file_names)):
        if is_file(folder / name):
            data = read_file(folder / name, "a file that the spec names", _MAX_HASHED_BYTES)
            found[name] = hashlib.sha256(data).hexdigest()
    return found


def check_hashes(expected_hashes: Mapping[str, str], actual_hashes: Mapping[str, str]) -> None:
    """Raise DermisError if files have changed since the spec was written.

    expected_hashes : SHA-256 by file name, as stored in the spec
    actual_hashes : SHA-256 of the present files, by file name
    """
    for name in sorted(expected_hashes.keys() | actual_hashes.keys()):
        if expected_hashes.get(name) != actual_hashes.get(name):
            refuse(
                f"files: {name}",
                f"a file with SHA-256 {expected_hashes[name][:16]}..."
                if name in expected_hashes
                else "no such file",
                f"it has {actual_hashes[name][:16]}..." if name in actual_hashes else "there is none",
                "Restore the file, or remove [files] to start another data set",
            )
