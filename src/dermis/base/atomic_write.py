"""Atomic writes: files and folders that are written completely or not at all."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from dermis.base.errors import DermisError, error_text, format_value, refuse


def check_output(path: str | Path, suffixes: Sequence[str], advice: str = "Choose one of them") -> Path:
    """Check before a long computation that a file can be written to a path, and return the path.

    suffixes : allowed suffixes of the name, such as ".png"
    advice : what to do about a suffix that is not allowed; the last sentence of the error

    Raises DermisError for a suffix that is not allowed, and when the folder is missing or not writable.
    """
    if not isinstance(path, str | os.PathLike):
        refuse("output", "the name of a file", f"got {format_value(path)}", "Pass its name")
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        actual = f"its suffix is {target.suffix!r}" if target.suffix else "it has no suffix"
        refuse(path, f"a name that ends in {' or '.join(suffixes)}", actual, advice)
    trial = _temporary_name(target)
    try:
        if not target.parent.is_dir():
            refuse(path, "a folder that exists", f"there is no folder {target.parent}", "Create it first")
        if target.exists() and not target.is_file():
            refuse(path, "a file or a free name", "something else has this name", "Choose another name")
        trial.touch()
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse_output(path, fault)
    finally:  # also when interrupted in between
        with suppress(OSError):
            trial.unlink()
    return target


@contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path; a file written there replaces `path` on success and is deleted after errors."""
    try:
        target = Path(os.path.realpath(path))
    except ValueError as fault:  # a NUL in the name
        refuse_output(path, fault)
    temporary = _temporary_name(target)
    try:
        yield temporary
        temporary.replace(target)
    except BaseException as fault:
        with suppress(OSError):  # not created
            temporary.unlink()
        if isinstance(fault, OSError | RuntimeError):  # OpenEXR reports a full disk as a RuntimeError
            refuse_output(path, fault)
        raise


@contextmanager
def atomic_folder(path: str | Path, marker_name: str) -> Iterator[Path]:
    """Yield a new empty folder, which replaces `path` on success and is deleted after an error.

    marker_name : name of a file that marks a folder as output of this package; an existing folder is replaced
        only if it contains this file or is empty

    Raises DermisError for any other existing folder, and for paths that cannot be written.
    """
    target = _replaceable_folder(path, marker_name)
    with temporary_folder(target) as temporary:
        yield temporary
        _move_folder(temporary, target)


def check_output_folder(path: str | Path, marker_name: str) -> None:
    """Check before a long computation that `atomic_folder` can write a folder.

    Raises DermisError as `atomic_folder` does.
    """
    with temporary_folder(_replaceable_folder(path, marker_name)):
        pass


def _replaceable_folder(path: str | Path, marker_name: str) -> Path:
    """Return the real path of a folder that `atomic_folder` may replace or create."""
    try:
        target = Path(os.path.realpath(path))
        if target.exists() and not (
            target.is_dir() and (_is_empty(target) or (target / marker_name).is_file())
        ):
            expected = f"a free name, or a folder that holds {marker_name}"
            refuse(path, expected, "something else is there", "Choose another name")
    except (OSError, ValueError) as fault:
        refuse_output(path, fault)
    return target


@contextmanager
def temporary_folder(target_path: Path) -> Iterator[Path]:
    """Yield a new empty folder next to `target_path`; the folder is deleted at the end of the with block.

    Raises DermisError when the folder cannot be created, or when writing into it fails.
    """
    temporary = _temporary_name(target_path).with_suffix("")
    try:
        temporary.mkdir()
        yield temporary
    except (OSError, ValueError) as fault:
        refuse_output(target_path, fault)
    finally:
        with suppress(OSError):
            shutil.rmtree(temporary, ignore_errors=True)


def _is_empty(folder: Path) -> bool:
    return next(folder.iterdir(), None) is None


def _move_folder(source_folder: Path, target_path: Path) -> None:
    """Move a folder to a path; an existing folder at the path is deleted once the move has succeeded."""
    if not target_path.exists():
        source_folder.replace(target_path)
        return
    old = _temporary_name(target_path)
    target_path.replace(old)
    try:
        source_folder.replace(target_path)
    except OSError:
        old.replace(target_path)
        raise
    shutil.rmtree(old, ignore_errors=True)


def refuse_output(path: str | Path, fault: Exception) -> NoReturn:
    """Raise the `DermisError` for a file or folder that cannot be written.

    fault : error of the operating system
    """
    raise DermisError(
        f"{path}: expected a writable path, but it cannot be written ({error_text(fault)}). "
        "Choose a writable folder with space left."
    ) from fault


def _temporary_name(target_path: Path) -> Path:
    return target_path.with_name(f".dermis-{secrets.token_hex(6)}{target_path.suffix}")


def check_folder(folder: Path, json_name: str) -> None:
    """Create a folder before a long computation, and check that the folder is writable.

    json_name : name of the .json file that will be written into the folder

    Raises DermisError when the folder cannot be created or is not writable.
    """
    if folder.exists() and not folder.is_dir():
        refuse(folder, "a folder or a free name", "a file has this name", "Choose another name")
    try:
        folder.mkdir(exist_ok=True)
    except FileNotFoundError:
        refuse(folder, "a folder inside one that exists", f"there is no {folder.parent}", "Create it first")
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse_output(folder, fault)
    check_output(folder / json_name, (".json",))
