"""Joining of complete parts into a shard, and reuse of existing images when a data set is enlarged."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from dermis.apps.batch.atomic_files import remove_path
from dermis.apps.batch.reader import shard_files
from dermis.apps.batch.shards import (
    Part,
    Shard,
    ShardWriter,
    is_intact,
    list_parts,
    read_manifest,
    shard_at,
    shard_exists,
    shard_path,
    shard_sha256,
)
from dermis.apps.batch.spec import Spec
from dermis.base.errors import DermisError

_MAX_JOIN_ATTEMPTS = 3


class KeptImages(NamedTuple):
    """Images at the beginning of a shard's part that were rendered before the data set was enlarged.

    path : path of the existing shard or part that contains them; None if there are no such images
    stop : first image number after these images
    """

    path: Path | None
    stop: int


def kept_images(dataset_folder: Path, part: Part, spec: Spec) -> KeptImages:
    """Return the images of a part that were rendered before the data set was enlarged."""
    for piece in (part, shard_at(part.index, spec)):
        path = shard_path(dataset_folder, piece, spec)
        with suppress(DermisError):
            manifest = read_manifest(path)
            is_shorter = manifest.first <= part.first < manifest.stop < piece.stop
            if is_shorter and manifest.spec == spec.digest() and _matches_sha256(path, manifest.sha256):
                return KeptImages(path, min(manifest.stop, part.stop))
    return KeptImages(None, part.first)


@lru_cache(maxsize=2)  # one shard is read for many parts
def _matches_sha256(path: Path, expected_sha256: str) -> bool:
    return shard_sha256(path) == expected_sha256


def copy_images(writer: ShardWriter, source_path: Path, first_image: int, stop_image: int) -> None:
    """Copy a range of images from a shard or part to another shard or part.

    For images of the range that could not be rendered, the recorded reasons are copied.

    writer : writer of the shard or part to which the images are copied
    source_path : path of the shard or part that contains the images
    first_image, stop_image : first image number, and the number after the last image

    Raises DermisError if the shard or part cannot be read.
    """
    manifest = read_manifest(source_path)
    writer.add_versions(manifest.made_with)
    for number, reason in manifest.left_out:
        if first_image <= number < stop_image:
            writer.leave_out(number, reason)
    with shard_files(source_path) as images:
        for key, files in images.items():
            if first_image <= int(key) < stop_image:
                writer.add(int(key), {suffix: read() for suffix, read in files.items()})


def join_parts(dataset_folder: Path, shard: Shard, spec: Spec) -> tuple[Part, ...]:
    """Join the parts of a shard if all parts exist, then remove the parts; return the damaged parts.

    If there are damaged parts, nothing is joined: the damaged parts are removed, and must be rendered again.
    Several processes may join the same parts at once: all write identical bytes, and parts are only removed
    when the shard exists.

    Raises DermisError if the shard cannot be written.
    """
    parts = {part: shard_path(dataset_folder, part, spec) for part in list_parts(shard, spec)}
    for attempts_left in reversed(range(_MAX_JOIN_ATTEMPTS)):  # another process may remove files in between
        if not all(path.exists() for path in reversed(parts.values())):  # the last one is usually missing
            return ()
        damaged = tuple(part for part in parts if not is_intact(dataset_folder, part, spec))
        if not shard_exists(dataset_folder, shard, spec):
            if damaged:
                _remove_paths(parts[part] for part in damaged)
                return damaged
            try:
                with ShardWriter(dataset_folder, shard, spec) as writer:
                    for part, path in parts.items():
                        copy_images(writer, path, part.first, part.stop)
            except (DermisError, OSError):
                if not attempts_left:
                    raise
                continue
        _remove_paths(parts.values())
        break
    return ()


def _remove_paths(paths: Iterable[Path]) -> None:
    for path in paths:
        remove_path(path)
