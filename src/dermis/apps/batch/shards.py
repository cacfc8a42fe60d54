"""Shards: the files or folders of consecutive images in which a data set is rendered."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Self

from dermis.apps.batch import shard_formats as formats
from dermis.apps.batch.atomic_files import move_into_place, remove_path, temporary_path, unfinished_files
from dermis.apps.batch.shard_formats import FolderWriter, ShardManifest, TarWriter
from dermis.apps.batch.spec import Spec
from dermis.base.atomic_write import refuse_output
from dermis.base.errors import DermisError, refuse, shorten
from dermis.base.reading import open_regular_file, parsing, read_file

SHARD_DESCRIPTION = "a shard of a data set"
_SHARD_NAME = re.compile(r"shard-(\d{5,9})(\.tar)?")
_MAX_REASON_LENGTH = 200  # characters


@dataclass(frozen=True, order=True)
class Shard:
    """Number of a shard, and its range of image numbers, from `first` up to but excluding `stop`."""

    index: int
    first: int
    stop: int


def list_shards(spec: Spec) -> list[Shard]:
    """Return all shards of a data set in order; the last one may have fewer images."""
    starts = range(0, spec.count, spec.shard_size)
    return [Shard(k, first, min(first + spec.shard_size, spec.count)) for k, first in enumerate(starts)]


def shard_path(out: Path, shard: Shard, spec: Spec) -> Path:
    """Return the path of a shard's tar file or folder."""
    return out / f"shard-{shard.index:05d}{'.tar' if spec.format == 'webdataset' else ''}"


def shard_index(path: Path) -> int | None:
    """Return the shard number in a file name such as shard-00012.tar; None for other names."""
    found = _SHARD_NAME.fullmatch(path.name)
    return int(found[1]) if found else None


def image_key(number: int) -> str:
    """Return the image number as 9 digits; the names of all files of the image begin with it."""
    return f"{number:09d}"


class ShardWriter:
    """Context manager that writes a shard, which is renamed to its final path on a normal exit.

    adapter : name of the adapter that renders the shard, for its manifest

    Raises DermisError if the shard cannot be written; nothing of it is then left on the disk.
    """

    def __init__(self, out: Path, shard: Shard, spec: Spec, adapter: str = "") -> None:
        self._target, self._shard, self._spec = shard_path(out, shard, spec), shard, spec
        self._temporary, self._adapter = temporary_path(self._target), adapter
        self._next_number = shard.first
        self._written, self._left_out = 0, dict[int, str]()

    def __enter__(self) -> Self:
        """Create the temporary file or folder to which the shard is written."""
        writer = TarWriter if self._spec.format == "webdataset" else FolderWriter
        try:
            self._files: TarWriter | FolderWriter = writer(self._temporary)
        except OSError as fault:
            refuse_output(self._target, fault)
        return self

    def add(self, number: int, entries: Mapping[str, bytes]) -> None:
        """Write the files of an image, given by suffix; images must come in the order of their numbers."""
        if not self._next_number <= number < self._shard.stop:
            raise ValueError(f"image {number} was added after {self._next_number - 1}, in {self._shard}")
        self._next_number, self._written = number + 1, self._written + 1
        try:
            for suffix in sorted(entries):
                self._files.add(f"{image_key(number)}.{suffix}", entries[suffix])
        except OSError as fault:
            refuse_output(self._target, fault)

    def leave_out(self, number: int, reason: str) -> None:
        """Record in the manifest that an image could not be rendered."""
        self._left_out[number] = shorten(reason, _MAX_REASON_LENGTH)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Write the manifest and rename the shard to its final path, or remove it after an error."""
        try:
            if kind is None:
                self._files.finish(self._manifest_bytes())
                move_into_place(self._temporary, self._target)
        except OSError as fault:
            refuse_output(self._target, fault)
        finally:
            with suppress(OSError):  # a full disk raises again
                self._files.close()
            remove_path(self._temporary)

    def _manifest_bytes(self) -> bytes:
        shard, spec = self._shard, self._spec
        if self._written + len(self._left_out) != shard.stop - shard.first:
            raise ValueError(f"{self._written} images and {len(self._left_out)} left out do not fill {shard}")
        left_out = tuple(sorted(self._left_out.items()))
        sha256, versions = self._files.sha256(), formats.software_versions(self._adapter)
        images = shard.index, shard.first, shard.stop
        data = ShardManifest(spec.digest(), *images, left_out, sha256, versions).to_bytes()
        if len(data) > formats.MAX_MANIFEST_BYTES:
            actual = f"{len(left_out)} failed, for example: {left_out[0][1]}"
            advice = "Correct the spec"
            refuse(self._target, "a shard in which most images can be rendered", actual, advice)
        return data


def read_manifest(path: Path) -> ShardManifest:
    """Return the manifest of a shard without reading its other files.

    Raises DermisError if the manifest is missing or damaged.
    """
    if path.is_dir():
        data = read_file(path / formats.MANIFEST_NAME, SHARD_DESCRIPTION, formats.MAX_MANIFEST_BYTES)
        return formats.parse_manifest(data, path)
    with open_regular_file(path, SHARD_DESCRIPTION) as file, parsing(path, SHARD_DESCRIPTION):
        return formats.parse_manifest(formats.read_tar_manifest(file)[1], path)


def shard_exists(out: Path, shard: Shard, spec: Spec) -> bool:
    """Return whether a complete shard exists at its final path.

    Raises DermisError for a shard of another data set.
    """
    path = shard_path(out, shard, spec)
    try:
        manifest = read_manifest(path)
    except DermisError:
        return False
    if (manifest.spec, manifest.index, manifest.first, manifest.stop) != (spec.digest(), *astuple(shard)):
        advice = "Choose another folder, or use the spec that the folder was created with"
        refuse(path, "a shard of this data set", "it belongs to another spec", advice)
    return True


def is_intact(out: Path, shard: Shard, spec: Spec) -> bool:
    """Return whether a shard exists and matches its SHA-256, by reading all of it.

    Raises DermisError for a shard of another data set.
    """
    if not shard_exists(out, shard, spec):
        return False
    path = shard_path(out, shard, spec)
    with suppress(DermisError):
        return _shard_sha256(path) == read_manifest(path).sha256
    return False


def remove_unfinished(out: Path, shards: Collection[Shard] | None = None) -> None:
    """Remove the temporary files that interrupted runs have left in a data set.

    shards : shards that no other run is writing; all if None
    """
    own = None if shards is None else {shard.index for shard in shards}
    for path, name in unfinished_files(out).items():
        index = shard_index(Path(name))
        if own is None or index is None or index in own:
            remove_path(path)


def _shard_sha256(path: Path) -> str:
    """Return the SHA-256 of a shard without its manifest."""
    if path.is_dir():
        names = {one.name for one in path.iterdir()} - {formats.MANIFEST_NAME}
        return formats.folder_sha256(path, sorted(names))
    with open_regular_file(path, SHARD_DESCRIPTION) as file, parsing(path, SHARD_DESCRIPTION):
        return formats.tar_sha256(file, formats.read_tar_manifest(file)[0])
