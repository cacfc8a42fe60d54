"""Disk cache of computed arrays; the key of an entry is a hash of the inputs of the computation.

The first line of a file is the SHA-256 of the second line. The second line is JSON with the key of the entry,
the types and shapes of the arrays, and the SHA-256 of each block of the bytes that follow. Files that do not
match these hashes are deleted. Only folders that no other user can write to are used.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import notify
from dermis.base.private import cache_folder, describe_other_writers, make_private_folder, open_private_file

Array = NDArray[Any]
Arrays = dict[str, Array]
_CACHE_FILE_SUFFIX, _UNFINISHED_SUFFIX = ".arrays", ".part"
_MAX_FOLDER_BYTES = 2 << 30
_MAX_RECENT_USE_AGE_S = 300.0  # longer than a process takes to read all its cached files
_MAX_UNFINISHED_AGE_S = 24 * 3600.0  # older unfinished files were left by processes that were killed
_DAMAGE_ERRORS = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)
_PLAIN_DTYPE_KINDS = "biufcSU"  # NumPy kinds without pointers
_BYTES_PER_BLOCK = 2 << 20  # bytes that a thread reads or hashes at once
_MAX_HEADER_LINE_BYTES = 1 << 20  # bytes
_MIN_THREADED_BYTES = 4 << 20
_MAX_THREADS = 4


def cached_array(
    source_arrays: Array | Sequence[Array], parameters: str, compute: Callable[[], Array]
) -> Array:
    """Return the result of `compute`, which depends on `source_arrays`, from the disk cache if possible.

    parameters : text with all other inputs on which the result depends; part of the cache key
    """
    return cached_arrays(source_arrays, parameters, ["array"], lambda: {"array": compute()})["array"]


def cached_arrays(
    source_arrays: Array | Sequence[Array],
    parameters: str,
    array_names: list[str],
    compute: Callable[[], Arrays],
) -> Arrays:
    """Return the results of `compute`, which depend on `source_arrays`, from the disk cache if possible.

    parameters : text with all other inputs on which the result depends; part of the cache key
    array_names : names of the arrays in the result
    """
    source_arrays = [source_arrays] if isinstance(source_arrays, np.ndarray) else source_arrays
    return load_or_make("arrays", array_key(source_arrays, parameters), array_names, compute)


def array_key(source_arrays: Sequence[Array], parameters: str) -> str:
    """Return the cache key of a result that is computed from arrays.

    source_arrays : arrays from which the result is computed
    parameters : text with all other inputs on which the result depends
    """
    digest = hashlib.sha256(parameters.encode())
    for source in source_arrays:
        digest.update(f" {source.shape} {source.dtype}".encode())
        digest.update(np.ascontiguousarray(source).data)
    return digest.hexdigest()[:40]


def load_or_make(
    folder: str, cache_key: str, array_names: list[str], compute: Callable[[], Arrays]
) -> Arrays:
    """Return arrays from the disk cache; if there is no valid entry, compute the arrays and cache them.

    folder : name of a folder inside the cache folder
    cache_key : key of the entry, a hash of the inputs of the computation
    array_names : names of the arrays in the result
    compute : function that returns the arrays as a dictionary from name to array
    """
    arrays = load_arrays(folder, cache_key, array_names)
    if arrays is None:
        arrays = compute()
        try_save_arrays(folder, cache_key, arrays)
    return arrays


def try_save_arrays(folder: str, cache_key: str, arrays: Arrays) -> None:
    """Save arrays to the disk cache if the cache has room; disk errors are ignored."""
    path = cache_folder() / folder
    with contextlib.suppress(OSError):
        if _has_room(path, sum(array.nbytes for array in arrays.values())):
            save_arrays(folder, cache_key, arrays)
            _prune_folder(path)


def load_arrays(folder: str, cache_key: str, array_names: Sequence[str]) -> Arrays | None:
    """Return the named arrays from the disk cache; None if the entry is missing, damaged or incomplete."""
    path = cache_folder() / folder / f"{cache_key}{_CACHE_FILE_SUFFIX}"
    with contextlib.suppress(OSError, MemoryError):
        if not _is_trusted(path.parent):
            return None
        try:
            arrays = _read_arrays(path, f"{folder}/{cache_key}")
        except _DAMAGE_ERRORS:
            path.unlink()
            return None
        with contextlib.suppress(OSError):  # a read-only folder
            os.utime(path)
        return {name: arrays[name] for name in array_names} if arrays.keys() >= set(array_names) else None
    return None


def save_arrays(folder: str, cache_key: str, arrays: Arrays) -> None:
    """Write arrays to the disk cache atomically.

    Raises OSError when the disk fails, or when other users can write to the folder.
    """
    path = cache_folder() / folder / f"{cache_key}{_CACHE_FILE_SUFFIX}"
    if not _is_trusted(path.parent):
        raise PermissionError(path.parent)
    data = {k: a if a.flags.fnc else np.ascontiguousarray(a).reshape(a.shape) for k, a in arrays.items()}
    blocks = _byte_blocks(data.values())
    header = {
        "key": f"{folder}/{cache_key}",
        "arrays": [[k, a.dtype.str, a.shape, "F" if a.flags.fnc else "C"] for k, a in data.items()],
        "blocks": _map_threaded(lambda block: hashlib.sha256(block).hexdigest(), blocks),
    }
    head = json.dumps(header).encode() + b"\n"
    with _temporary_file(path) as file:
        file.write(_digest_line(head) + head)
        file.writelines(blocks)


def _is_trusted(folder: Path) -> bool:
    """Return whether no other user can write to a folder; if others can, warn once."""
    if reason := describe_other_writers(folder):
        advice = "make it private, or name another in DERMIS_CACHE"
        _notify_once(f"{cache_folder()} is not used, because {reason}: {advice}")
    return not reason


@cache
def _notify_once(message: str) -> None:
    notify(message)


def _has_room(folder: Path, byte_count: int) -> bool:
    """Return whether a folder has room for `byte_count` more bytes without deleting recently used files.

    Without this check, files that a process needs at the same time would evict each other.
    """
    now = time.time()
    used = sum(
        status.st_size
        for _, status in _folder_files(folder, _CACHE_FILE_SUFFIX)
        if now - status.st_mtime < _MAX_RECENT_USE_AGE_S
    )
    return byte_count + used <= _MAX_FOLDER_BYTES


def _folder_files(folder: Path, suffix: str) -> list[tuple[Path, os.stat_result]]:
    """Return the path and the status of each file with a given suffix in a folder.

    Files that another process deletes meanwhile are skipped.
    """
    found = []
    with contextlib.suppress(FileNotFoundError), os.scandir(folder) as entries:
        for entry in entries:
            with contextlib.suppress(OSError):
                if entry.name.endswith(suffix) and entry.is_file(follow_symlinks=False):
                    found.append((Path(entry.path), entry.stat(follow_symlinks=False)))
    return found


def _read_arrays(path: Path, cache_key: str) -> Arrays:
    """Return the arrays in a file of the cache.

    Raises OSError or MemoryError when the file cannot be read, and one of `_DAMAGE_ERRORS` when the file is
    damaged or has another key.
    """
    with open_private_file(path) as raw, io.BufferedReader(raw) as file:
        digest, head = file.readline(_MAX_HEADER_LINE_BYTES), file.readline(_MAX_HEADER_LINE_BYTES)
        start, size = file.tell(), os.fstat(file.fileno()).st_size
    header = json.loads(head) if digest == _digest_line(head) else {}
    if header.get("key") != cache_key:
        raise ValueError(cache_key)
    kinds = [(name, np.dtype(kind), shape, order) for name, kind, shape, order in header["arrays"]]
    if start + sum(_byte_count(kind, shape) for _, kind, shape, _ in kinds) != size:
        raise ValueError(cache_key)
    arrays = {name: np.empty(shape, kind, order) for name, kind, shape, order in kinds}
    blocks = _byte_blocks(arrays.values())
    offsets = start + np.cumsum([0, *(len(block) for block in blocks)])
    if _map_threaded(partial(_read_block, path), blocks, offsets.tolist()) != header["blocks"]:
        raise ValueError(cache_key)
    return arrays


def _digest_line(header_line: bytes) -> bytes:
    return hashlib.sha256(header_line).hexdigest().encode() + b"\n"


def _byte_count(dtype: np.dtype[Any], array_shape: Sequence[int]) -> int:
    """Return the size of an array in bytes; raise ValueError if the type or the shape is invalid."""
    if (
        dtype.kind not in _PLAIN_DTYPE_KINDS
        or not dtype.itemsize
        or any(type(n) is not int or n < 0 for n in array_shape)
    ):
        raise ValueError(f"no array: {dtype} {array_shape}")
    return math.prod(array_shape) * dtype.itemsize


def _read_block(path: Path, buffer: memoryview, offset: int) -> str:
    """Read a block of bytes of a file into memory, and return the SHA-256 of the block.

    buffer : memory to be filled
    offset : position of the block in the file [bytes]
    """
    with open_private_file(path) as file:
        file.seek(offset)
        if file.readinto(buffer) != len(buffer):  # uninitialised memory may hold the right bytes
            raise ValueError(path)
    return hashlib.sha256(buffer).hexdigest()


def _byte_blocks(arrays: Iterable[Array]) -> list[memoryview]:
    """Return views of at most 2 MiB each, which together cover the bytes of all arrays in order."""
    buffers = [array.reshape(-1, order="A").view(np.uint8).data for array in arrays]
    return [
        data[start : start + _BYTES_PER_BLOCK]
        for data in buffers
        for start in range(0, len(data), _BYTES_PER_BLOCK)
    ]


def _map_threaded(
    function: Callable[..., str], blocks: list[memoryview], *further_arguments: Sequence[int]
) -> list[str]:
    """Apply a function to each block, and return the results; several threads are used for large data.

    further_arguments : sequences with one value per block; each call gets the values for its block
    """
    if sum(map(len, blocks)) < _MIN_THREADED_BYTES:
        return list(map(function, blocks, *further_arguments))
    with ThreadPoolExecutor(min(os.cpu_count() or 1, _MAX_THREADS)) as pool:
        return list(pool.map(function, blocks, *further_arguments))


@contextlib.contextmanager
def _temporary_file(path: Path) -> Iterator[BinaryIO]:
    """Yield a new file that is renamed to `path` on success and deleted after an error."""
    make_private_folder(path.parent)
    unfinished = path.with_name(f"{path.name}.{os.urandom(6).hex()}{_UNFINISHED_SUFFIX}")
    try:
        with open(unfinished, "xb", opener=partial(os.open, mode=0o600)) as file:
            yield file
        unfinished.replace(path)
    finally:
        with contextlib.suppress(OSError):
            unfinished.unlink()


def _prune_folder(cache_path: Path) -> None:
    """Delete the least recently used files of a cache folder that is too large, and old unfinished files."""
    newest_first = sorted(
        _folder_files(cache_path, _CACHE_FILE_SUFFIX), key=lambda entry: entry[1].st_mtime, reverse=True
    )
    total, now = 0, time.time()
    for path, status in newest_first:
        total += status.st_size
        if total > _MAX_FOLDER_BYTES:
            path.unlink(missing_ok=True)
    for path, status in _folder_files(cache_path, _UNFINISHED_SUFFIX):
        if now - status.st_mtime > _MAX_UNFINISHED_AGE_S:
            path.unlink(missing_ok=True)
