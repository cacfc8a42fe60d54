"""Results kept on disk by the content of what they were made from.

A file begins with a line that is the SHA-256 of the next one; that one tells the file's key, its arrays and
the SHA-256 of each block of the bytes that follow. What does not fit is as good as not there, and removed.
Only folders that nobody else can write to are used.
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
from dermis.base.private import cache_folder, make_private, open_private, stranger

Array = NDArray[Any]
Arrays = dict[str, Array]
_SUFFIX, _UNFINISHED = ".arrays", ".part"
_MOST_BYTES = 2 << 30  # of each folder
_START_S = 300.0  # longer than a process takes to read all that it wants
_LONGEST_S = 24 * 3600.0  # after that nobody is still writing a file
_DAMAGED = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)
_PLAIN = "biufcSU"  # kinds of arrays that are bytes and nothing else
_BLOCK = 2 << 20  # bytes that a thread reads, or tells the hash of, at once
_MOST_HEAD = 1 << 20  # bytes of a line
_LARGE = 4 << 20  # bytes that more than one thread takes
_MOST_THREADS = 4


def cached_array(sources: Array | Sequence[Array], form: str, make: Callable[[], Array]) -> Array:
    """The array that `make` returns for one or more others, kept on disk in the same way.

    form : all that it depends on besides their content
    """
    return cached_arrays(sources, form, ["array"], lambda: {"array": make()})["array"]


def cached_arrays(
    sources: Array | Sequence[Array], form: str, names: list[str], make: Callable[[], Arrays]
) -> Arrays:
    """The arrays `names` that `make` returns for others, kept on disk in the same way."""
    sources = [sources] if isinstance(sources, np.ndarray) else sources
    return stored("arrays", array_key(sources, form), names, make)


def array_key(sources: Sequence[Array], form: str) -> str:
    """The key of what follows from these arrays.

    form : all that it depends on besides their content
    """
    digest = hashlib.sha256(form.encode())
    for source in sources:
        digest.update(f" {source.shape} {source.dtype}".encode())
        digest.update(np.ascontiguousarray(source).data)
    return digest.hexdigest()[:40]


def stored(folder: str, key: str, names: list[str], make: Callable[[], Arrays]) -> Arrays:
    """The arrays `names` from the file of that key, or made and stored."""
    found = find(folder, key, names)
    if found is None:
        found = make()
        keep(folder, key, found)
    return found


def keep(folder: str, key: str, arrays: Arrays) -> None:
    """`store` where there is room; the disk may fail without harm."""
    place = cache_folder() / folder
    with contextlib.suppress(OSError):
        if _has_room(place, sum(array.nbytes for array in arrays.values())):
            store(folder, key, arrays)
            _prune(place)


def find(folder: str, key: str, names: Sequence[str]) -> Arrays | None:
    """The arrays `names` from the file of that key, None when it is not there or not as it was stored."""
    path = cache_folder() / folder / f"{key}{_SUFFIX}"
    with contextlib.suppress(OSError, MemoryError):
        if not _is_trusted(path.parent):
            return None
        try:
            arrays = _read(path, f"{folder}/{key}")
        except _DAMAGED:
            path.unlink()
            return None
        with contextlib.suppress(OSError):  # others' folder: to be read only
            os.utime(path)
        return {name: arrays[name] for name in names} if arrays.keys() >= set(names) else None
    return None


def store(folder: str, key: str, arrays: Arrays) -> None:
    """Write arrays for `find`, whole or not at all.

    Raises OSError when the disk fails, or the folder is others' too.
    """
    path = cache_folder() / folder / f"{key}{_SUFFIX}"
    if not _is_trusted(path.parent):
        raise PermissionError(path.parent)
    data = {k: a if a.flags.fnc else np.ascontiguousarray(a).reshape(a.shape) for k, a in arrays.items()}
    blocks = _blocks(data.values())
    told = {
        "key": f"{folder}/{key}",
        "arrays": [[k, a.dtype.str, a.shape, "F" if a.flags.fnc else "C"] for k, a in data.items()],
        "blocks": _in_threads(lambda block: hashlib.sha256(block).hexdigest(), blocks),
    }
    head = json.dumps(told).encode() + b"\n"
    with _whole(path) as file:
        file.write(_line_of(head) + head)
        file.writelines(blocks)


def _is_trusted(folder: Path) -> bool:
    """Whether only this user can have written what lies there; else a note says why nothing is kept."""
    if why := stranger(folder):
        _tell(f"{cache_folder()} is not used, as {why}: make it yours alone, or name another in DERMIS_CACHE")
    return not why


@cache
def _tell(message: str) -> None:
    notify(message)


def _has_room(folder: Path, size: int) -> bool:
    """Whether that many bytes fit beside what was just used; in turn, they would drive each other out."""
    now = time.time()
    used = sum(told.st_size for _, told in _files(folder, _SUFFIX) if now - told.st_mtime < _START_S)
    return size + used <= _MOST_BYTES


def _files(folder: Path, suffix: str) -> list[tuple[Path, os.stat_result]]:
    """The files there whose names end so; others may come and go meanwhile."""
    found = []
    with contextlib.suppress(FileNotFoundError), os.scandir(folder) as entries:
        for entry in entries:
            with contextlib.suppress(OSError):
                if entry.name.endswith(suffix) and entry.is_file(follow_symlinks=False):
                    found.append((Path(entry.path), entry.stat(follow_symlinks=False)))
    return found


def _read(path: Path, key: str) -> Arrays:
    """The arrays of a file.

    Raises OSError or MemoryError when it cannot be read, one of `_DAMAGED` unless it is as it was stored
    under that key.
    """
    with open_private(path) as raw, io.BufferedReader(raw) as file:
        digest, head = file.readline(_MOST_HEAD), file.readline(_MOST_HEAD)
        start, size = file.tell(), os.fstat(file.fileno()).st_size
    told = json.loads(head) if digest == _line_of(head) else {}
    if told.get("key") != key:
        raise ValueError(key)
    kinds = [(name, np.dtype(kind), shape, order) for name, kind, shape, order in told["arrays"]]
    if start + sum(_length(kind, shape) for _, kind, shape, _ in kinds) != size:
        raise ValueError(key)
    arrays = {name: np.empty(shape, kind, order) for name, kind, shape, order in kinds}
    blocks = _blocks(arrays.values())
    places = start + np.cumsum([0, *(len(block) for block in blocks)])
    if _in_threads(partial(_read_block, path), blocks, places.tolist()) != told["blocks"]:
        raise ValueError(key)
    return arrays


def _line_of(head: bytes) -> bytes:
    return hashlib.sha256(head).hexdigest().encode() + b"\n"


def _length(kind: np.dtype[Any], shape: Sequence[int]) -> int:
    """Bytes of an array, told before there is room for it."""
    if kind.kind not in _PLAIN or not kind.itemsize or any(type(n) is not int or n < 0 for n in shape):
        raise ValueError(f"no array: {kind} {shape}")
    return math.prod(shape) * kind.itemsize


def _read_block(path: Path, block: memoryview, place: int) -> str:
    """Fill a block with what the file holds from a place on, and tell its hash."""
    with open_private(path) as file:
        file.seek(place)
        if file.readinto(block) != len(block):  # what lay in memory before may be right
            raise ValueError(path)
    return hashlib.sha256(block).hexdigest()


def _blocks(arrays: Iterable[Array]) -> list[memoryview]:
    """The bytes of arrays one after the other."""
    whole = [array.reshape(-1, order="A").view(np.uint8).data for array in arrays]
    return [data[start : start + _BLOCK] for data in whole for start in range(0, len(data), _BLOCK)]


def _in_threads(work: Callable[..., str], blocks: list[memoryview], *more: Sequence[int]) -> list[str]:
    """What a function returns of each block; neither reading nor hashing holds other threads up."""
    if sum(map(len, blocks)) < _LARGE:
        return list(map(work, blocks, *more))
    with ThreadPoolExecutor(min(os.cpu_count() or 1, _MOST_THREADS)) as pool:
        return list(pool.map(work, blocks, *more))


@contextlib.contextmanager
def _whole(path: Path) -> Iterator[BinaryIO]:
    """A file that takes its name when all was written, and is removed when not."""
    make_private(path.parent)
    unfinished = path.with_name(f"{path.name}.{os.urandom(6).hex()}{_UNFINISHED}")
    try:
        with open(unfinished, "xb", opener=partial(os.open, mode=0o600)) as file:
            yield file
        unfinished.replace(path)
    finally:
        with contextlib.suppress(OSError):
            unfinished.unlink()


def _prune(folder: Path) -> None:
    """Forget the files used longest ago while the folder holds more than its share, and unfinished ones."""
    stored = sorted(_files(folder, _SUFFIX), key=lambda one: one[1].st_mtime, reverse=True)
    total, now = 0, time.time()
    for path, told in stored:
        total += told.st_size
        if total > _MOST_BYTES:
            path.unlink(missing_ok=True)
    for path, told in _files(folder, _UNFINISHED):  # of processes that were killed
        if now - told.st_mtime > _LONGEST_S:
            path.unlink(missing_ok=True)
