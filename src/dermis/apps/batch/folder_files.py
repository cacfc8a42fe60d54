"""Shards that are folders of files."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from dermis.apps.batch.settling import sync
from dermis.apps.batch.stamps import NAME
from dermis.base.reading import read_file
from dermis.images.sizes import MOST_BYTES


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
        self.add(NAME, stamp)
        sync(self._path / NAME)
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
