"""Folders and files that nobody but their user, and root, can have written to."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import stat
from collections.abc import Iterator
from pathlib import Path

_READING = os.O_RDONLY | sum(
    getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY")
)
_MOST_LINKS = 40  # as Linux follows
_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path:
    """Where files lie that can all be had again: DERMIS_CACHE, else the user's cache folder.

    For a user without a home it is a place that can hold nothing.
    """
    import platformdirs

    try:
        return Path(os.environ.get("DERMIS_CACHE") or platformdirs.user_cache_dir("dermis")).absolute()
    except RuntimeError:
        return Path(os.devnull)


def make_private(folder: Path) -> None:
    """Make a folder, and those above it, for this user alone.

    Raises OSError where that is not possible.
    """
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    for one in reversed(missing):
        one.mkdir(0o700, exist_ok=True)
    if not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))


def stranger(folder: Path) -> str:
    """What lets another user write to a folder, in words; empty if nothing does.

    Folders above the user's home count as safe, and those that root alone writes to.
    """
    if os.name != "posix":
        return ""  # profiles are their user's there
    above_home: set[Path] = set()
    with contextlib.suppress(RuntimeError):  # there is none
        above_home = set(Path.home().parents)
    steps = [one for one in _steps(folder) if one not in above_home]
    for one in steps:
        try:
            told = one.lstat()
        except FileNotFoundError:
            return ""
        if not stat.S_ISDIR(told.st_mode) and not stat.S_ISLNK(told.st_mode):
            return ""  # nothing lies below it
        if told.st_uid not in (0, os.geteuid()):
            return f"{one} belongs to another user"
        sticky = told.st_mode & stat.S_ISVTX and one != steps[-1]  # there only the owner renames and removes
        if not stat.S_ISLNK(told.st_mode) and not sticky and _is_shared(told):
            return f"other users can write to {one}"
    return ""


def open_private(path: Path) -> io.FileIO:
    """A file opened for reading, without a buffer; never a link, a pipe or a device.

    Raises OSError when it cannot be read, ValueError when others may have written it.
    """
    descriptor = os.open(path, _READING)
    told = os.fstat(descriptor)
    mine = os.name != "posix" or (told.st_uid in (0, os.geteuid()) and not told.st_mode & _OTHERS)
    if not stat.S_ISREG(told.st_mode) or not mine:
        os.close(descriptor)
        raise ValueError(f"{path} is no file of this user alone")
    return io.FileIO(descriptor)


def _steps(path: Path) -> Iterator[Path]:
    """Each folder and link on the way to a path, and itself."""
    whole = path.absolute()
    todo, at, links = list(reversed(whole.parts[1:])), Path(whole.anchor), 0
    yield at
    while todo:
        name = todo.pop()
        if name == "..":
            at = at.parent
            continue
        yield (at := at / name)
        if at.is_symlink():
            links += 1
            if links > _MOST_LINKS:
                raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
            target = at.readlink()
            todo += reversed(target.parts[1:] if target.anchor else target.parts)
            at = Path(target.anchor) if target.anchor else at.parent


def _is_shared(told: os.stat_result) -> bool:
    """Whether somebody else can write there; a group that holds its user alone is nobody else."""
    import grp
    import pwd

    if told.st_mode & stat.S_IWOTH:
        return True
    if not told.st_mode & stat.S_IWGRP:
        return False
    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(told.st_gid)
    except KeyError:
        return True
    return (
        group.gr_gid != user.pw_gid or group.gr_name != user.pw_name or bool({*group.gr_mem} - {user.pw_name})
    )
