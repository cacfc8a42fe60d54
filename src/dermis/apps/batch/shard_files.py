"""The files in a shard, by image; nothing of them is trusted."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import BinaryIO

from dermis.apps.batch.stamps import NAME
from dermis.apps.batch.tar_files import TarMember, tar_members
from dermis.base.errors import refuse
from dermis.base.reading import opened, read_file, understood
from dermis.images.sizes import MOST_BYTES

EXPECTED = "a shard of a data set"
Files = dict[str, Callable[[], bytes]]
"""Of an image: what reads each, by suffix."""
_FILE_NAME = re.compile(r"(\d{9})\.([a-z0-9_]{1,40}(?:\.[a-z0-9]{1,10})?)")


@contextmanager
def shard_files(path: Path) -> Iterator[dict[str, Files]]:
    """The files of each image of a shard by its key, in the order of the keys, to be read inside the context.

    Raises DermisError for what is no shard, or was cut off.
    """
    if path.is_dir():
        names = sorted(one.name for one in path.iterdir())
        yield _by_key(path, {name: partial(_from_folder, path / name) for name in names})
        return
    with opened(path, EXPECTED) as file:
        with understood(path, EXPECTED):
            members = {one.name: one for one in _all_members(file)}
        yield _by_key(path, {name: partial(_from_tar, path, file, one) for name, one in members.items()})


def _all_members(file: BinaryIO) -> list[TarMember]:
    members = list(tar_members(file))
    if len({one.name for one in members}) != len(members):
        raise ValueError("two files in it have one name")
    return members


def _by_key(path: Path, files: Files) -> dict[str, Files]:
    if NAME not in files:
        refuse(path, EXPECTED, "its end is missing", "Fetch it again, or have it drawn again")
    found: dict[str, Files] = {}
    for name, read in files.items():
        match = _FILE_NAME.fullmatch(name)
        if match:
            found.setdefault(match[1], {})[match[2]] = read
        elif name != NAME:
            came = f"it holds {name[:60]!r}"
            refuse(path, f"{EXPECTED} with files such as 000000012.png", came, "Take it out")
    return dict(sorted(found.items()))


def _from_folder(path: Path) -> bytes:
    return read_file(path, "a file of a shard", MOST_BYTES)


def _from_tar(path: Path, file: BinaryIO, member: TarMember) -> bytes:
    if member.size > MOST_BYTES:
        came = f"{member.name} has {member.size:,} bytes"
        refuse(path, f"files of at most {MOST_BYTES:,} bytes", came, "Have it drawn again")
    file.seek(member.place)
    data = file.read(member.size)
    if len(data) != member.size:
        refuse(path, EXPECTED, "it is cut off", "Fetch it again, or have it drawn again")
    return data
