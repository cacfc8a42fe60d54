"""Bytes of a shard: tar files and folders, ended by a stamp that is written last."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import tarfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from dermis.apps.batch.atomic_files import sync
from dermis.base.reading import parse_json, read_file, understood
from dermis.base.version import version
from dermis.images.sizes import MOST_BYTES

STAMP_NAME = "__whole__"
"""Of the file in a shard that says so: its last one, which the library webdataset passes over."""
MOST_STAMP_BYTES = 1 << 20


@dataclass(frozen=True)
class Stamp:
    """What a shard says of itself.

    spec : digest of the data set's
    first, stop : its images, from the first to before the last
    left_out : number and reason of images that could not be made
    sha256 : of all that is in it before this
    made_with : the adapter, and versions of what drew
    """

    spec: str
    index: int
    first: int
    stop: int
    left_out: tuple[tuple[int, str], ...] = ()
    sha256: str = ""
    made_with: dict[str, str] = field(default_factory=dict)

    def data(self) -> bytes:
        """Its bytes, the last of which are a hash of the others."""
        told = asdict(self)
        check = hashlib.sha256(json.dumps(told).encode()).hexdigest()
        return (json.dumps({**told, "check": check}, indent=1) + "\n").encode()


def read_stamp(data: bytes, culprit: object) -> Stamp:
    """The stamp of its bytes.

    Raises DermisError for what is none.
    """
    told = parse_json(data, culprit, "what a whole shard says of itself")
    with understood(culprit, "what a whole shard says of itself", KeyError, TypeError, AttributeError):
        index, first, stop = (told[name] for name in ("index", "first", "stop"))
        texts = [told["spec"], told["sha256"], *told["made_with"], *told["made_with"].values()]
        left_out = tuple((number, reason) for number, reason in told["left_out"])
        numbers = [index, first, stop, *(number for number, _ in left_out)]
        texts += [reason for _, reason in left_out]
        if any(type(one) is not int or one < 0 for one in numbers) or not all(
            isinstance(text, str) for text in texts
        ):
            raise ValueError("its values are of other kinds")
        found = Stamp(told["spec"], index, first, stop, left_out, told["sha256"], dict(told["made_with"]))
        if found.data() != data:
            raise ValueError("its hash is that of another text")
        return found


@cache
def versions() -> dict[str, str]:
    """Of what draws."""
    return {"dermis": version(), "wgpu": metadata.version("wgpu"), "python": platform.python_version()}


def made_with(adapter: str) -> dict[str, str]:
    """What a shard is made with."""
    return {"adapter": adapter, **versions()}


_BLOCK = 512
_END = bytes(2 * _BLOCK)
_CHUNK = 1 << 20


class TarWriter:
    """A tar file of regular files: fixed time, owner and mode, in the order in which they come."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("xb")
        self._hash = hashlib.sha256()

    def add(self, name: str, data: bytes) -> None:
        """Raises OSError when the disk is full."""
        for piece in _pieces(name, data):
            self._file.write(piece)
            self._hash.update(piece)

    def sha256(self) -> str:
        """Of all bytes so far."""
        return self._hash.hexdigest()

    def finish(self, stamp: bytes) -> None:
        """Close it with its stamp; it is on the disk then."""
        self.add(STAMP_NAME, stamp)
        self._file.write(_END)
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()

    def close(self) -> None:
        """Close it as it is."""
        self._file.close()


class TarMember(NamedTuple):
    """A file in a tar file, whose bytes lie at a place of it."""

    name: str
    place: int
    size: int


def tar_members(file: BinaryIO) -> Iterator[TarMember]:
    """The files in a tar file.

    ValueError : it is damaged or cut off, or holds what is no regular file
    """
    length, place = file.seek(0, os.SEEK_END), 0
    while True:
        file.seek(place)
        block = file.read(_BLOCK)
        if block == bytes(_BLOCK):
            return
        member = _member(block, place)
        place = member.place + member.size + -member.size % _BLOCK
        if place > length:
            raise ValueError("it is cut off")
        yield member


def tar_stamp(file: BinaryIO) -> tuple[int, bytes]:
    """Where the stamp of a tar file begins, and its bytes, found from the end.

    ValueError : there is none, or other bytes follow it
    """
    length = file.seek(0, os.SEEK_END)
    start = max(0, length - MOST_STAMP_BYTES - 3 * _BLOCK)
    file.seek(start)
    tail = file.read()
    at = tail.rfind(STAMP_NAME.encode() + b"\0")
    if at < 0 or (start + at) % _BLOCK:
        raise ValueError("it is cut off")
    member = _member(tail[at : at + _BLOCK], start + at)
    stamp = tail[member.place - start :][: member.size]
    if tail[at:] != b"".join(_pieces(STAMP_NAME, stamp)) + _END:
        raise ValueError("it is cut off or damaged")
    return start + at, stamp


def tar_sha256(file: BinaryIO, stop: int) -> str:
    """Of the bytes of a tar file before a place."""
    digest = hashlib.sha256()
    file.seek(0)
    while stop > 0 and (piece := file.read(min(_CHUNK, stop))):
        digest.update(piece)
        stop -= len(piece)
    return digest.hexdigest()


def _pieces(name: str, data: bytes) -> tuple[bytes, bytes, bytes]:
    """A file in a tar file: its header, its bytes, and what fills the last block."""
    head = tarfile.TarInfo(name)
    head.size = len(data)
    return head.tobuf(tarfile.USTAR_FORMAT), data, bytes(-len(data) % _BLOCK)


def _member(block: bytes, place: int) -> TarMember:
    try:
        head = tarfile.TarInfo.frombuf(block, "utf-8", "strict")
    except (tarfile.HeaderError, UnicodeDecodeError) as fault:
        raise ValueError(f"its header at byte {place} is damaged") from fault
    if head.type not in (tarfile.REGTYPE, tarfile.AREGTYPE) or head.size < 0:
        raise ValueError(f"it holds {head.name[:60]!r}, which is no regular file")
    return TarMember(head.name, place + _BLOCK, head.size)


class FolderWriter:
    """A folder of files, in the order in which they come."""

    def __init__(self, path: Path) -> None:
        path.mkdir()
        self._path, self._hash = path, hashlib.sha256()

    def add(self, name: str, data: bytes) -> None:
        """Raises OSError when the disk is full."""
        with (self._path / name).open("xb") as file:
            file.write(data)
        _count(self._hash, name, data)

    def sha256(self) -> str:
        """Of the names and bytes so far."""
        return self._hash.hexdigest()

    def finish(self, stamp: bytes) -> None:
        """Close it with its stamp; what a loss of power takes away is missed by the hash."""
        self.add(STAMP_NAME, stamp)
        sync(self._path / STAMP_NAME)
        sync(self._path)

    def close(self) -> None:
        """Nothing is open."""


def folder_sha256(path: Path, names: Iterable[str]) -> str:
    """As `FolderWriter.sha256` of the files in a folder.

    Raises DermisError for one that cannot be read.
    """
    digest = hashlib.sha256()
    for name in names:
        _count(digest, name, read_file(path / name, "a file of a shard", MOST_BYTES))
    return digest.hexdigest()


def _count(digest: Any, name: str, data: bytes) -> None:
    digest.update(f"{name} {len(data)}\n".encode())
    digest.update(data)
