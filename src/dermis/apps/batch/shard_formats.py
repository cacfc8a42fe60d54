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
from typing import BinaryIO, NamedTuple

from dermis.apps.batch.atomic_files import sync
from dermis.base.reading import parse_json, read_file, understood
from dermis.base.version import version
from dermis.images.sizes import MOST_BYTES

MANIFEST_NAME = "__whole__"
"""Of the file in a shard that says so: its last one, which the library webdataset passes over."""
MAX_MANIFEST_BYTES = 1 << 20


@dataclass(frozen=True)
class ShardManifest:
    """Record that ends a shard and proves that it is whole.

    spec : digest of the spec
    first, stop : its images, from `first` to before `stop`
    left_out : number and reason of images that could not be made
    sha256 : of all bytes before the stamp
    made_with : adapter and versions of the software
    """

    spec: str
    index: int
    first: int
    stop: int
    left_out: tuple[tuple[int, str], ...] = ()
    sha256: str = ""
    made_with: dict[str, str] = field(default_factory=dict)

    def data(self) -> bytes:
        """Return the bytes, which end with a hash of the others."""
        values = asdict(self)
        check = hashlib.sha256(json.dumps(values).encode()).hexdigest()
        return (json.dumps({**values, "check": check}, indent=1) + "\n").encode()


def parse_manifest(data: bytes, culprit: object) -> ShardManifest:
    """Return the stamp of its bytes.

    Raises DermisError for other bytes.
    """
    values = parse_json(data, culprit, "what a whole shard says of itself")
    with understood(culprit, "what a whole shard says of itself", KeyError, TypeError, AttributeError):
        index, first, stop = (values[name] for name in ("index", "first", "stop"))
        left_out = tuple((number, reason) for number, reason in values["left_out"])
        spec, sha256, made = values["spec"], values["sha256"], values["made_with"]
        numbers = [index, first, stop, *(number for number, _ in left_out)]
        texts = [spec, sha256, *made, *made.values(), *(reason for _, reason in left_out)]
        whole = all(type(one) is int and one >= 0 for one in numbers)
        if not whole or not all(isinstance(text, str) for text in texts):
            raise ValueError("its values are of other kinds")
        found = ShardManifest(spec, index, first, stop, left_out, sha256, dict(made))
        if found.data() != data:
            raise ValueError("its hash is that of another text")
        return found


@cache
def made_with(adapter: str) -> dict[str, str]:
    """Return the adapter and the versions of the software that renders."""
    versions = {"dermis": version(), "wgpu": metadata.version("wgpu"), "python": platform.python_version()}
    return {"adapter": adapter, **versions}


_BLOCK = 512
_END = bytes(2 * _BLOCK)
_CHUNK = 1 << 20


class TarWriter:
    """Writer of a tar file of regular files with fixed time, owner and mode."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("xb")
        self._hash = hashlib.sha256()

    def add(self, name: str, data: bytes) -> None:
        """Write a file. Raises OSError when the disk is full."""
        for piece in _pieces(name, data):
            self._file.write(piece)
            self._hash.update(piece)

    def sha256(self) -> str:
        """Return the hash of all bytes so far."""
        return self._hash.hexdigest()

    def finish(self, stamp: bytes) -> None:
        """Close it with its stamp, after it has reached the disk."""
        self.add(MANIFEST_NAME, stamp)
        self._file.write(_END)
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()

    def close(self) -> None:
        """Close it unfinished."""
        self._file.close()


class TarMember(NamedTuple):
    """File in a tar file: its name, and where its bytes are."""

    name: str
    place: int
    size: int


def tar_members(file: BinaryIO) -> Iterator[TarMember]:
    """Yield the files of a tar file.

    Raises ValueError where it is damaged or cut off, or holds something else than regular files.
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


def read_tar_manifest(file: BinaryIO) -> tuple[int, bytes]:
    """Return where the stamp of a tar file begins, and its bytes, found from the end.

    Raises ValueError where there is none, or other bytes follow it.
    """
    length = file.seek(0, os.SEEK_END)
    start = max(0, length - MAX_MANIFEST_BYTES - 3 * _BLOCK)
    file.seek(start)
    tail = file.read()
    at = tail.rfind(MANIFEST_NAME.encode() + b"\0")
    if at < 0 or (start + at) % _BLOCK:
        raise ValueError("it is cut off")
    member = _member(tail[at : at + _BLOCK], start + at)
    stamp = tail[member.place - start :][: member.size]
    if tail[at:] != b"".join(_pieces(MANIFEST_NAME, stamp)) + _END:
        raise ValueError("it is cut off or damaged")
    return start + at, stamp


def tar_sha256(file: BinaryIO, stop: int) -> str:
    """Return the hash of the bytes of a tar file before an offset."""
    digest = hashlib.sha256()
    file.seek(0)
    while stop > 0 and (piece := file.read(min(_CHUNK, stop))):
        digest.update(piece)
        stop -= len(piece)
    return digest.hexdigest()


def _pieces(name: str, data: bytes) -> tuple[bytes, bytes, bytes]:
    """Return a file of a tar file: header, bytes, and padding of the last block."""
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
    """Writer of a folder of files."""

    def __init__(self, path: Path) -> None:
        path.mkdir()
        self._path, self._hash = path, hashlib.sha256()

    def add(self, name: str, data: bytes) -> None:
        """Write a file. Raises OSError when the disk is full."""
        with (self._path / name).open("xb") as file:
            file.write(data)
        self._hash.update(_hashed(name, data))

    def sha256(self) -> str:
        """Return the hash of the names and bytes so far."""
        return self._hash.hexdigest()

    def finish(self, stamp: bytes) -> None:
        """Write the stamp; files lost with the power are detected by the hash."""
        self.add(MANIFEST_NAME, stamp)
        sync(self._path / MANIFEST_NAME)
        sync(self._path)

    def close(self) -> None:
        """Do nothing: no file is open."""


def folder_sha256(path: Path, names: Iterable[str]) -> str:
    """Return `FolderWriter.sha256` of the files in a folder.

    Raises DermisError for one that cannot be read.
    """
    digest = hashlib.sha256()
    for name in names:
        digest.update(_hashed(name, read_file(path / name, "a file of a shard", MOST_BYTES)))
    return digest.hexdigest()


def _hashed(name: str, data: bytes) -> bytes:
    """Return the bytes of a file in the hash of a folder."""
    return f"{name} {len(data)}\n".encode() + data
