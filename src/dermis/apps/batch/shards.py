"""Shards and parts of a data set: a shard is a file or folder of images, and is rendered in parts."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from dermis.apps.batch import shard_formats as formats
from dermis.apps.batch.atomic_files import move_into_place, remove_path, temporary_path, unfinished_files
from dermis.apps.batch.shard_formats import FolderWriter, ShardManifest, TarWriter
from dermis.apps.batch.spec import Spec
from dermis.base.atomic_write import refuse_output
from dermis.base.errors import DermisError, refuse, shorten
from dermis.base.reading import open_regular_file, read_file, refuse_parse_errors

SHARD_DESCRIPTION = "a shard of a data set"
_SHARD_NAME_PATTERN = re.compile(r"shard-(\d{5,9})(\.tar)?")
_PART_NAME_PATTERN = re.compile(r"part-(\d{9})(\.tar)?")
_VERSION_SEPARATOR = " + "  # between the adapters, or versions, that rendered the parts of a shard
_MAX_REASON_LENGTH = 200  # characters
_MIN_PART_IMAGES, _MAX_PART_IMAGES = 16, 32


@dataclass(frozen=True, order=True, slots=True)
class Shard:
    """Shard: its number and its range of image numbers, from `first` up to but excluding `stop`."""

    index: int
    first: int
    stop: int

    def __str__(self) -> str:
        """Return the name by which messages refer to the shard."""
        return f"shard {self.index}"

    def __len__(self) -> int:
        """Return the number of images."""
        return self.stop - self.first


class Part(Shard):
    """Part of a shard, the unit of work: the number of the shard, and the part's range of image numbers."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return the name by which messages refer to the part."""
        return f"images {self.first} to {self.stop - 1} of shard {self.index}"


def list_shards(spec: Spec) -> list[Shard]:
    """Return all shards of a data set in order; the last shard may have fewer images."""
    return [shard_at(index, spec) for index in range(-(-spec.count // spec.shard_size))]


def shard_at(shard_number: int, spec: Spec) -> Shard:
    """Return the shard with a given number."""
    first = shard_number * spec.shard_size
    return Shard(shard_number, first, min(first + spec.shard_size, spec.count))


def list_parts(shard: Shard, spec: Spec) -> list[Part]:
    """Return the parts of a shard in order.

    The part size is the smallest multiple of the number of images per person that is between 16 and 32; it
    is 16 if there is no such multiple. Except for the first part of a shard, every part starts at an image
    number that is a multiple of the part size. The first and the last part may therefore be smaller.
    """
    group = spec.images_per_person
    size = -(-_MIN_PART_IMAGES // group) * group if group <= _MAX_PART_IMAGES else _MIN_PART_IMAGES
    starts = [shard.first, *range((shard.first // size + 1) * size, shard.stop, size)]
    return [Part(shard.index, *ends) for ends in zip(starts, [*starts[1:], shard.stop], strict=True)]


def shard_path(dataset_folder: Path, shard: Shard, spec: Spec) -> Path:
    """Return the path of the tar file or folder of a shard, or of one part of a shard.

    A part has its own file or folder until all parts of its shard are joined.

    shard : shard, or its part as an object of the class `Part`
    """
    name = f"part-{image_key(shard.first)}" if isinstance(shard, Part) else f"shard-{shard.index:05d}"
    return dataset_folder / f"{name}{'.tar' if spec.format == 'webdataset' else ''}"


def shard_index(path: Path) -> int | None:
    """Return the shard number in a file name such as shard-00012.tar; None for other names."""
    found = _SHARD_NAME_PATTERN.fullmatch(path.name)
    return int(found[1]) if found else None


def image_key(image_number: int) -> str:
    """Return the image number as 9 digits; the names of all files of the image begin with these digits."""
    return f"{image_number:09d}"


class ShardWriter:
    """Context manager that writes a shard or a part, and renames it to its final path on a normal exit.

    adapter : name of the graphics adapter to record in the manifest; "" if all images are copied

    Raises DermisError if the shard cannot be written; the temporary file is then removed.
    """

    def __init__(self, dataset_folder: Path, shard: Shard, spec: Spec, adapter: str = "") -> None:
        self._target, self._shard, self._spec = shard_path(dataset_folder, shard, spec), shard, spec
        self._temporary = temporary_path(self._target)
        self._made_with = formats.software_versions(adapter) if adapter else {}
        self._next_number = shard.first
        self._written, self._left_out = 0, dict[int, str]()

    def __enter__(self) -> Self:
        """Create the temporary file or folder to which the shard is written."""
        self._replaces_folder = isinstance(self._shard, Part) or self._target.exists()
        writer = TarWriter if self._spec.format == "webdataset" else FolderWriter
        try:
            self._files: TarWriter | FolderWriter = writer(self._temporary)
        except OSError as fault:
            refuse_output(self._target, fault)
        return self

    def add(self, image_number: int, files_by_suffix: Mapping[str, bytes]) -> None:
        """Write the files of an image; images must come in the order of their numbers.

        files_by_suffix : content of each file, by suffix
        """
        if not self._next_number <= image_number < self._shard.stop:
            raise ValueError(
                f"image {image_number} was added after {self._next_number - 1}, in {self._shard}"
            )
        self._next_number, self._written = image_number + 1, self._written + 1
        try:
            for suffix in sorted(files_by_suffix):
                self._files.add(f"{image_key(image_number)}.{suffix}", files_by_suffix[suffix])
        except OSError as fault:
            refuse_output(self._target, fault)

    def leave_out(self, image_number: int, reason: str) -> None:
        """Record in the manifest that an image could not be rendered."""
        self._left_out[image_number] = shorten(reason, _MAX_REASON_LENGTH)

    def add_versions(self, versions: Mapping[str, str]) -> None:
        """Record in the manifest the adapter and the software that rendered copied images.

        versions : name of the adapter and versions of the software, as from `software_versions`
        """
        for name, value in versions.items():
            known = self._made_with.get(name, value).split(_VERSION_SEPARATOR)
            merged = sorted({*known, *value.split(_VERSION_SEPARATOR)})
            self._made_with = {**self._made_with, name: _VERSION_SEPARATOR.join(merged)}

    def __exit__(self, exception_type: type[BaseException] | None, *_: object) -> None:
        """Finish the shard and rename it to its final path; on an error, remove the unfinished shard."""
        try:
            if exception_type is None:
                self._files.finish(self._manifest_bytes())
                move_into_place(self._temporary, self._target, self._replaces_folder)
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
        sha256, images = self._files.sha256(), (shard.index, shard.first, shard.stop)
        data = ShardManifest(spec.digest(), *images, left_out, sha256, self._made_with).to_bytes()
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
    with open_regular_file(path, SHARD_DESCRIPTION) as file, refuse_parse_errors(path, SHARD_DESCRIPTION):
        return formats.parse_manifest(formats.read_tar_manifest(file)[1], path)


def shard_exists(dataset_folder: Path, shard: Shard, spec: Spec) -> bool:
    """Return whether a shard, or a `Part` of a shard, is complete at its final path.

    A shard with too few images, written before the data set was enlarged, is not complete.

    Raises DermisError for a shard of another data set.
    """
    path = shard_path(dataset_folder, shard, spec)
    try:
        manifest = read_manifest(path)
    except DermisError:
        return False
    same_place = (manifest.index, manifest.first) == (shard.index, shard.first)
    if manifest.spec != spec.digest() or not same_place or manifest.stop > shard.stop:
        advice = "Choose another folder, or use the spec that the folder was created with"
        refuse(path, "a shard of this data set", "it belongs to another spec", advice)
    return manifest.stop == shard.stop


def is_intact(dataset_folder: Path, shard: Shard, spec: Spec) -> bool:
    """Read a shard, or one part of it, completely; return whether it exists and matches its SHA-256.

    Raises DermisError for a shard of another data set.
    """
    if not shard_exists(dataset_folder, shard, spec):
        return False
    path = shard_path(dataset_folder, shard, spec)
    with suppress(DermisError, OSError):
        return shard_sha256(path) == read_manifest(path).sha256
    return False


def part_files(dataset_folder: Path) -> dict[int, Path]:
    """Return the file or folder of each complete part in a data set, by the part's first image number."""
    found = {path: _PART_NAME_PATTERN.fullmatch(path.name) for path in dataset_folder.iterdir()}
    return {int(match[1]): path for path, match in found.items() if match}


def remove_unfinished_files(dataset_folder: Path, removable_names: Collection[str] | None = None) -> None:
    """Remove the temporary files that interrupted runs have left in a data set.

    removable_names : names of shards and parts that no other run is writing; temporary files of other shards
        and parts are kept. None if there is no other run
    """
    for path, name in unfinished_files(dataset_folder).items():
        is_images = _SHARD_NAME_PATTERN.fullmatch(name) or _PART_NAME_PATTERN.fullmatch(name)
        if removable_names is None or name in removable_names or not is_images:
            remove_path(path)


def shard_sha256(path: Path) -> str:
    """Return the SHA-256 of a shard without its manifest."""
    if path.is_dir():
        names = {one.name for one in path.iterdir()} - {formats.MANIFEST_NAME}
        return formats.folder_sha256(path, sorted(names))
    with open_regular_file(path, SHARD_DESCRIPTION) as file, refuse_parse_errors(path, SHARD_DESCRIPTION):
        return formats.tar_sha256(file, formats.read_tar_manifest(file)[0])
