"""Files that are renamed into place when complete, safe against other processes writing the same."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
from collections.abc import Callable
from pathlib import Path

from dermis.base.atomic_write import refuse_output

_TRIES = 5
_UNFINISHED = re.compile(r"\.(.+)-[0-9a-f]{12}\.unfinished")


def temporary_path(target: Path) -> Path:
    """A hidden name beside a file or folder, for while it is being written."""
    return target.with_name(f".{target.name}-{secrets.token_hex(6)}.unfinished")


def atomic_write(target: Path, write: Callable[[Path], object]) -> None:
    """Write a file whole or not at all; another process may remove what is unfinished, then it is done again.

    write : does so, to the name that it is given

    Raises DermisError where it cannot be written.
    """
    for tries_left in reversed(range(_TRIES)):
        unfinished = temporary_path(target)
        try:
            write(unfinished)
            sync(unfinished)
            unfinished.replace(target)
            sync(target.parent)
        except FileNotFoundError as fault:
            if not tries_left or not target.parent.is_dir():
                refuse_output(target, fault)
            continue
        except OSError as fault:
            refuse_output(target, fault)
        finally:
            remove(unfinished)
        return


def move_into_place(unfinished: Path, target: Path) -> None:
    """Give what is whole its name, in place of what has it: a file or a folder.

    Raises OSError where that fails.
    """
    if target.is_dir() and not target.is_symlink():
        aside = temporary_path(target)
        target.rename(aside)
        unfinished.rename(target)
        remove(aside)
    else:
        unfinished.replace(target)
    sync(target.parent)


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    if os.name != "posix":
        return  # folders cannot be opened there
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def remove(path: Path) -> None:
    """Remove a file, or a folder with all that it holds; it may not be there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
        return
    with contextlib.suppress(OSError):
        path.unlink()


def unfinished_files(folder: Path) -> dict[Path, str]:
    """What was left unfinished in a folder, with the name that it was to have."""
    with contextlib.suppress(OSError):
        found = {path: _UNFINISHED.fullmatch(path.name) for path in sorted(folder.iterdir())}
        return {path: match[1] for path, match in found.items() if match}
    return {}
