"""Shards: the unit in which a data set is rendered, written and found again."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import astuple, dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from dermis.apps.batch.atomic_files import unfinished_files, remove, move_into_place, temporary_path
from dermis.apps.batch.shard_formats import (
    MAX_MANIFEST_BYTES,
    MANIFEST_NAME,
    FolderWriter,
    ShardManifest,
    TarWriter,
    folder_sha256,
    made_with,
    parse_manifest,
    tar_sha256,
    read_tar_manifest,
)
from dermis.apps.batch.spec import Spec
from dermis.base.atomic_write import refuse_output
from dermis.base.errors import DermisError, refuse, shortened
from dermis.base.reading import opened, read_file, understood

EXPECTED = "a shard of a data set"
_SHARD_NAME = re.compile(r"shard-(\d{5,9})(\.tar)?")
_LONGEST_REASON = 200  # letters


@dataclass(frozen=True, order=True)
class Shard:
    """Images from `first` to before `stop`."""

    index: int
    first: int
    stop: int


def list_shards(spec: Spec) -> list[Shard]:
    """Return all shards of a data set, the last one with the remaining images."""
    starts = range(0, spec.count, spec.shard_size)
    return [Shard(k, first, min(first + spec.shard_size, spec.count)) for k, first in enumerate(starts)]


def shard_path(out: Path, shard: Shard, spec: Spec) -> Path:
    """Return the path of a shard's tar file or folder."""
    return out / f"shard-{shard.index:05d}{'.tar' if spec.format == 'webdataset' else ''}"


def shard_index(path: Path) -> int | None:
    """Return the number of a shard by its name, None for other names."""
    found = _SHARD_NAME.fullmatch(path.name)
    return int(found[1]) if found else None


def image_key(number: int) -> str:
    """Return the prefix of the names of an image's files."""
    return f"{number:09d}"


class ShardWriter:
    """Writer of a shard, which gets its name when the context is left without an error.

    adapter : that renders it, for the datasheet

    Raises DermisError when it cannot be written, with nothing left of it.
    """

    def __init__(self, out: Path, shard: Shard, spec: Spec, adapter: str = "") -> None:
        self._target, self._shard, self._spec = shard_path(out, shard, spec), shard, spec
        self._unfinished, self._adapter = temporary_path(self._target), adapter
        self._next = shard.first
        self._written, self._left_out = 0, dict[int, str]()

    def __enter__(self) -> Self:
        kind = TarWriter if self._spec.format == "webdataset" else FolderWriter
        try:
            self._files: TarWriter | FolderWriter = kind(self._unfinished)
        except OSError as fault:
            refuse_output(self._target, fault)
        return self

    def add(self, number: int, entries: Mapping[str, bytes]) -> None:
        """Write the files of an image by suffix; images come in the order of their numbers."""
        if not self._next <= number < self._shard.stop:
            raise ValueError(f"image {number} comes after {self._next - 1}, in {self._shard}")
        self._next, self._written = number + 1, self._written + 1
        try:
            for suffix in sorted(entries):
                self._files.add(f"{image_key(number)}.{suffix}", entries[suffix])
        except OSError as fault:
            refuse_output(self._target, fault)

    def leave_out(self, number: int, reason: str) -> None:
        """Record an image that could not be made."""
        self._left_out[number] = shortened(reason, _LONGEST_REASON)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is None:
                self._files.finish(self._stamp())
                move_into_place(self._unfinished, self._target)
        except OSError as fault:
            refuse_output(self._target, fault)
        finally:
            with suppress(OSError):  # a full disk says so again
                self._files.close()
            remove(self._unfinished)

    def _stamp(self) -> bytes:
        shard, spec = self._shard, self._spec
        if self._written + len(self._left_out) != shard.stop - shard.first:
            raise ValueError(f"{self._written} images and {len(self._left_out)} left out are not {shard}")
        left_out = tuple(sorted(self._left_out.items()))
        digest, made = self._files.sha256(), made_with(self._adapter)
        stamp = ShardManifest(spec.digest(), shard.index, shard.first, shard.stop, left_out, digest, made).data()
        if len(stamp) > MAX_MANIFEST_BYTES:
            came = f"{len(left_out)} could not be made, such as: {left_out[0][1]}"
            refuse(self._target, "a shard of images most of which can be made", came, "Correct the spec")
        return stamp


def read_manifest(path: Path) -> ShardManifest:
    """Return the stamp of a shard; its other bytes are not read.

    Raises DermisError where it is not whole, as far as its end shows.
    """
    if path.is_dir():
        return parse_manifest(read_file(path / MANIFEST_NAME, EXPECTED, MAX_MANIFEST_BYTES), path)
    with opened(path, EXPECTED) as file, understood(path, EXPECTED):
        return parse_manifest(read_tar_manifest(file)[1], path)


def is_there(out: Path, shard: Shard, spec: Spec) -> bool:
    """Return whether a shard exists under its name, which it gets when it is whole.

    Raises DermisError for a shard of another data set.
    """
    path = shard_path(out, shard, spec)
    try:
        stamp = read_manifest(path)
    except DermisError:
        return False
    if (stamp.spec, stamp.index, stamp.first, stamp.stop) != (spec.digest(), *astuple(shard)):
        remedy = "Choose another folder, or give the spec that it was begun with"
        refuse(path, "a shard of this data set", "it belongs to that of another spec", remedy)
    return True


def is_whole(out: Path, shard: Shard, spec: Spec) -> bool:
    """Return whether a shard exists with every byte as it was written: all of it is read.

    Raises DermisError for a shard of another data set.
    """
    if not is_there(out, shard, spec):
        return False
    path = shard_path(out, shard, spec)
    with suppress(DermisError):
        return _sha256(path) == read_manifest(path).sha256
    return False


def remove_unfinished(out: Path, shards: Collection[Shard] | None = None) -> None:
    """Remove unfinished files of killed runs.

    shards : that no other run works on; all where None
    """
    mine = None if shards is None else {shard.index for shard in shards}
    for path, name in unfinished_files(out).items():
        index = shard_index(Path(name))
        if mine is None or index is None or index in mine:
            remove(path)


def _sha256(path: Path) -> str:
    """Return the hash of all files of a shard before its stamp."""
    if path.is_dir():
        return folder_sha256(path, sorted(one.name for one in path.iterdir() if one.name != MANIFEST_NAME))
    with opened(path, EXPECTED) as file, understood(path, EXPECTED):
        return tar_sha256(file, read_tar_manifest(file)[0])
