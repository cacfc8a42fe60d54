"""Atomic writes of files and folders, also when several processes write the same one at once."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
from collections.abc import Callable
from pathlib import Path

from dermis.base.atomic_write import refuse_output

_MAX_RENAME_ATTEMPTS = 5
_UNFINISHED_NAME_PATTERN = re.compile(r"\.(.+)-[0-9a-f]{12}\.unfinished")


def temporary_path(final_path: Path) -> Path:
    """Return an unused hidden path beside `final_path`, for a file or folder to be renamed when complete."""
    return final_path.with_name(f".{final_path.name}-{secrets.token_hex(6)}.unfinished")


def atomic_write(final_path: Path, write_content: Callable[[Path], object]) -> None:
    """Write a file completely or not at all, by writing a temporary file and then renaming it.

    If another process removes the temporary file during a cleanup, the file is written again.

    write_content : function that writes the content to the path passed to it

    Raises DermisError if the file cannot be written.
    """
    for attempts_left in reversed(range(_MAX_RENAME_ATTEMPTS)):
        temporary = temporary_path(final_path)
        try:
            write_content(temporary)
            flush_to_disk(temporary)
            temporary.replace(final_path)
            flush_to_disk(final_path.parent)
        except FileNotFoundError as fault:
            if not attempts_left or not final_path.parent.is_dir():
                refuse_output(final_path, fault)
            continue
        except OSError as fault:
            refuse_output(final_path, fault)
        finally:
            remove_path(temporary)
        return


def move_into_place(unfinished_path: Path, final_path: Path, replaces_folder: bool = True) -> None:
    """Rename a temporary file or folder to its final path, and replace any file or folder there.

    replaces_folder : whether to replace a non-empty folder; if False, the folder is kept and OSError is
        raised

    Raises OSError if the file or folder cannot be renamed.
    """
    if replaces_folder and final_path.is_dir() and not final_path.is_symlink():
        replaced = temporary_path(final_path)
        final_path.rename(replaced)
        try:
            unfinished_path.rename(final_path)
        except OSError:
            with contextlib.suppress(OSError):  # another process has moved a folder there
                replaced.rename(final_path)
            raise
        finally:
            remove_path(replaced)
    else:
        unfinished_path.replace(final_path)
    flush_to_disk(final_path.parent)


def flush_to_disk(path: Path) -> None:
    """Wait until the content of a file, or the entries of a folder, are stored on the disk."""
    if os.name != "posix":
        return  # folders cannot be opened there
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def remove_path(path: Path) -> None:
    """Remove a file, or a folder and its content; do nothing if the path does not exist."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
        return
    with contextlib.suppress(OSError):
        path.unlink()


def unfinished_files(folder: Path) -> dict[Path, str]:
    """Return the temporary paths that interrupted writes left in a folder, each with its final file name."""
    with contextlib.suppress(OSError):
        found = {path: _UNFINISHED_NAME_PATTERN.fullmatch(path.name) for path in sorted(folder.iterdir())}
        return {path: match[1] for path, match in found.items() if match}
    return {}
