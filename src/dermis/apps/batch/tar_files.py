"""Tar files whose bytes follow from what is in them, and what others wrote as such."""

from __future__ import annotations

import hashlib
import os
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from dermis.apps.batch.stamps import MOST_BYTES, NAME

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
        self.add(NAME, stamp)
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
    start = max(0, length - MOST_BYTES - 3 * _BLOCK)
    file.seek(start)
    tail = file.read()
    at = tail.rfind(NAME.encode() + b"\0")
    if at < 0 or (start + at) % _BLOCK:
        raise ValueError("it is cut off")
    member = _member(tail[at : at + _BLOCK], start + at)
    stamp = tail[member.place - start :][: member.size]
    if tail[at:] != b"".join(_pieces(NAME, stamp)) + _END:
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
