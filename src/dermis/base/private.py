"""Private folders and files, which only this user and root can change."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import stat
from collections.abc import Iterator
from pathlib import Path

_OPEN_FOR_READING_FLAGS = os.O_RDONLY | sum(
    getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY")
)
_MAX_SYMBOLIC_LINKS = 40  # symbolic links in the resolution of one path, as in Linux
_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path:
    """Return the folder of the disk cache: the environment variable DERMIS_CACHE, or a default for the user.

    For a user without a home folder, the returned path is the null device, where nothing can be stored.
    """
    import platformdirs

    try:
        return Path(os.environ.get("DERMIS_CACHE") or platformdirs.user_cache_dir("dermis")).absolute()
    except RuntimeError:
        return Path(os.devnull)


def make_private_folder(folder: Path) -> None:
    """Create a folder and its missing parents, accessible to this user only.

    Raises OSError if the folder cannot be created or made private.
    """
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir(0o700, exist_ok=True)
    if not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))


def describe_other_writers(folder: Path) -> str:
    """Return a clause that says how other users can write to a folder; empty if no other user can.

    Folders above the user's home count as safe, and so do folders that only root can write to.
    """
    if os.name != "posix":
        return ""  # Windows profiles are private
    above_home: set[Path] = set()
    with contextlib.suppress(RuntimeError):  # no home
        above_home = set(Path.home().parents)
    components = [path for path in _path_components(folder) if path not in above_home]
    for path in components:
        try:
            status = path.lstat()
        except FileNotFoundError:
            return ""
        if not stat.S_ISDIR(status.st_mode) and not stat.S_ISLNK(status.st_mode):
            return ""  # a file, below which nothing can be stored
        if status.st_uid not in (0, os.geteuid()):
            return f"{path} belongs to another user"
        sticky = status.st_mode & stat.S_ISVTX and path != components[-1]  # only owners rename and remove
        if not stat.S_ISLNK(status.st_mode) and not sticky and _is_shared(status):
            return f"other users can write to {path}"
    return ""


def open_private_file(path: Path) -> io.FileIO:
    """Open a regular file for unbuffered reading; links, pipes and devices are refused.

    Raises OSError when the file cannot be opened, and ValueError when the file is not regular or other users
    may have written to it.
    """
    descriptor = os.open(path, _OPEN_FOR_READING_FLAGS)
    status = os.fstat(descriptor)
    shared = status.st_mode & _WRITABLE_BY_OTHERS
    private = os.name != "posix" or (status.st_uid in (0, os.geteuid()) and not shared)
    if not stat.S_ISREG(status.st_mode) or not private:
        os.close(descriptor)
        raise ValueError(f"{path} is not a private file of this user")
    return io.FileIO(descriptor)


def _path_components(path: Path) -> Iterator[Path]:
    """Yield a path, and every folder and symbolic link that is followed to resolve it."""
    absolute = path.absolute()
    names, current, links = list(reversed(absolute.parts[1:])), Path(absolute.anchor), 0
    yield current
    while names:
        name = names.pop()
        if name == "..":
            current = current.parent
            continue
        yield (current := current / name)
        if current.is_symlink():
            links += 1
            if links > _MAX_SYMBOLIC_LINKS:
                raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
            target = current.readlink()
            names += reversed(target.parts[1:] if target.anchor else target.parts)
            current = Path(target.anchor) if target.anchor else current.parent


def _is_shared(file_status: os.stat_result) -> bool:
    """Return whether users other than this one have write access to a file or folder.

    Access for a group does not count if this user is the only member of the group.
    """
    import grp
    import pwd

    if file_status.st_mode & stat.S_IWOTH:
        return True
    if not file_status.st_mode & stat.S_IWGRP:
        return False
    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(file_status.st_gid)
    except KeyError:
        return True
    is_own = group.gr_gid == user.pw_gid and group.gr_name == user.pw_name
    return not is_own or bool({*group.gr_mem} - {user.pw_name})
