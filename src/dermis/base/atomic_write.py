"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from dermis.base.errors import DermisError, refuse, shown_value


def check_output(path: str | Path, suffixes: Sequence[str], advice: str = "Choose one of them") -> Path:
    """The path, after a trial that a file can be written there: call it before long work.

    suffixes : what the name may end in, such as ".png"

    Raises DermisError when the name ends otherwise, or when the folder is missing or not writable.
    """
    if not isinstance(path, str | os.PathLike):
        refuse("output", "the name of a file", f"{shown_value(path)} came", "Write its name")
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        came = f"its suffix is {target.suffix!r}" if target.suffix else "it has no suffix"
        refuse(path, f"a name that ends in {' or '.join(suffixes)}", came, advice)
    trial = _temporary_name(target)
    try:
        if not target.parent.is_dir():
            refuse(path, "a folder that exists", f"there is no folder {target.parent}", "Make it first")
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
def replacing(path: str | Path) -> Iterator[Path]:
    """A name in the same folder, moved to `path` when all went well and removed when not."""
    try:
        target = Path(os.path.realpath(path))
    except ValueError as fault:  # a NUL in the name
        refuse_output(path, fault)
    temporary = _temporary_name(target)
    try:
        yield temporary
        temporary.replace(target)
    except BaseException as fault:
        with suppress(OSError):  # it was never made
            temporary.unlink()
        if isinstance(fault, OSError | RuntimeError):  # OpenEXR reports a full disk as a RuntimeError
            refuse_output(path, fault)
        raise


@contextmanager
def replacing_folder(path: str | Path, kept: str) -> Iterator[Path]:
    """A new empty folder beside, moved to `path` when all went well and removed when not.

    kept : a file that a folder of this name has to hold if it is to be replaced; an empty one is anyway

    Raises DermisError for another folder there, and for what cannot be written.
    """
    try:
        target = Path(os.path.realpath(path))
        if target.exists() and not (target.is_dir() and (_is_empty(target) or (target / kept).is_file())):
            expected, came = (
                f"a free name, or a folder of before that holds {kept}",
                "something else is there",
            )
            refuse(path, expected, came, "Choose another name")
    except (OSError, ValueError) as fault:
        refuse_output(path, fault)
    with folder_beside(target) as temporary:
        yield temporary
        _move_folder(temporary, target)


@contextmanager
def folder_beside(target: Path) -> Iterator[Path]:
    """A new empty folder for parts of what is to be written; whatever is left in it goes with it.

    Raises DermisError when the folder cannot be made, or what is done inside cannot be written.
    """
    temporary = _temporary_name(target).with_suffix("")
    try:
        temporary.mkdir()
        yield temporary
    except (OSError, ValueError) as fault:
        refuse_output(target, fault)
    finally:
        with suppress(OSError):
            shutil.rmtree(temporary, ignore_errors=True)


def _is_empty(folder: Path) -> bool:
    return next(folder.iterdir(), None) is None


def _move_folder(made: Path, target: Path) -> None:
    """In place of a folder that is there, which goes only when the new one is in its place."""
    if not target.exists():
        made.replace(target)
        return
    old = _temporary_name(target)
    target.replace(old)
    try:
        made.replace(target)
    except OSError:
        old.replace(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def refuse_output(path: str | Path, fault: Exception) -> NoReturn:
    """Raise the `DermisError` of a file that cannot be written."""
    raise DermisError(
        f"{path}: expected a place to write a file to, but it cannot be written ({reason(fault)}). "
        "Choose a writable folder with space left."
    ) from fault


def reason(fault: Exception) -> str:
    """A fault in one line, without the path that an OSError repeats."""
    text = getattr(fault, "strerror", None) or str(fault) or type(fault).__name__
    return text.splitlines()[0].rstrip(".")


def _temporary_name(target: Path) -> Path:
    return target.with_name(f".dermis-{secrets.token_hex(6)}{target.suffix}")


def check_folder(folder: Path, summary: str) -> None:
    """Make a folder, after a trial that something can be written there: call it before long work.

    summary : name of the .json that will stand in it

    Raises DermisError when it cannot be.
    """
    if folder.exists() and not folder.is_dir():
        refuse(folder, "a folder or a free name", "a file has this name", "Choose another name")
    try:
        folder.mkdir(exist_ok=True)
    except FileNotFoundError:
        refuse(folder, "a folder inside one that exists", f"there is no {folder.parent}", "Make it first")
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse_output(folder, fault)
    check_output(folder / summary, (".json",))
