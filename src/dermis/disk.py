"""Results kept on disk by the content of what they were made from.

A file begins with a line that is the SHA-256 of the next one; that one tells the file's key, its arrays and
the SHA-256 of each block of the bytes that follow. What does not fit is as good as not there.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Arrays = dict[str, Array]
_SUFFIX = ".arrays"
_MOST_BYTES = 2 << 30  # of each folder
_START_S = 300.0  # longer than a process takes to read all that it wants
_LONGEST_S = 24 * 3600.0  # after that nobody is still writing a file
_DAMAGED = (OSError, ValueError, TypeError, KeyError, MemoryError)
_BLOCK = 2 << 20  # bytes that a thread reads, or tells the hash of, at once
_MOST_HEAD = 1 << 20  # bytes of a line
_LARGE = 4 << 20  # bytes that more than one thread takes
_MOST_THREADS = 4


def cache_folder() -> Path:
    """Where files lie that can all be had again: DERMIS_CACHE, else the user's cache folder."""
    import platformdirs

    return Path(os.environ.get("DERMIS_CACHE") or platformdirs.user_cache_dir("dermis"))


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
    if found is not None:
        return found
    arrays = make()
    with contextlib.suppress(OSError):
        if _has_room(cache_folder() / folder, sum(array.nbytes for array in arrays.values())):
            store(folder, key, arrays)
            _prune(cache_folder() / folder)
    return arrays


def find(folder: str, key: str, names: Sequence[str]) -> Arrays | None:
    """The arrays `names` from the file of that key, None when it is not there or not as it was stored."""
    path = cache_folder() / folder / f"{key}{_SUFFIX}"
    with contextlib.suppress(*_DAMAGED):
        arrays = _read(path, f"{folder}/{key}")
        with contextlib.suppress(OSError):  # others' folder: to be read only
            path.touch()
        return {name: arrays[name] for name in names}
    return None


def store(folder: str, key: str, arrays: Arrays) -> None:
    """Write arrays for `find`, whole or not at all.

    Raises OSError when the disk fails.
    """
    path = cache_folder() / folder / f"{key}{_SUFFIX}"
    data = {k: a if a.flags.fnc else np.ascontiguousarray(a).reshape(a.shape) for k, a in arrays.items()}
    blocks = _blocks(data.values())
    told = {
        "key": f"{folder}/{key}",
        "arrays": [[k, a.dtype.str, a.shape, "F" if a.flags.fnc else "C"] for k, a in data.items()],
        "blocks": _in_threads(lambda block: hashlib.sha256(block).hexdigest(), blocks),
    }
    head = json.dumps(told).encode() + b"\n"
    with _whole(path) as unfinished, unfinished.open("wb") as file:
        file.write(hashlib.sha256(head).hexdigest().encode() + b"\n" + head)
        file.writelines(blocks)


def stored_file(folder: str, name: str, make: Callable[[], bytes]) -> Path:
    """The file of that name with the bytes that `make` returns; their hash lies beside it.

    Raises OSError when the disk fails.
    """
    path = cache_folder() / folder / name
    beside = path.with_name(f"{name}.sha256")
    with contextlib.suppress(OSError):
        if hashlib.sha256(path.read_bytes()).hexdigest() == beside.read_text().strip():
            return path
    data = make()
    for target, content in ((path, data), (beside, hashlib.sha256(data).hexdigest().encode())):
        with _whole(target) as unfinished:
            unfinished.write_bytes(content)
    return path


def _has_room(folder: Path, size: int) -> bool:
    """Whether that many bytes fit beside what was just used; in turn, they would drive each other out."""
    now = time.time()
    stored = (path.stat() for path in folder.glob(f"*{_SUFFIX}"))
    return size + sum(one.st_size for one in stored if now - one.st_mtime < _START_S) <= _MOST_BYTES


def _read(path: Path, key: str) -> Arrays:
    """The arrays of a file; raises one of `_DAMAGED` unless it is as it was stored under that key."""
    with path.open("rb") as file:
        digest, head = file.readline(_MOST_HEAD), file.readline(_MOST_HEAD)
        start = file.tell()
    told = json.loads(head) if hashlib.sha256(head).hexdigest().encode() == digest.strip() else {}
    if told.get("key") != key:
        raise ValueError(key)
    arrays = {name: np.empty(shape, kind, order) for name, kind, shape, order in told["arrays"]}
    blocks = _blocks(arrays.values())
    places = start + np.cumsum([0, *(len(block) for block in blocks)])
    if _in_threads(partial(_read_block, path), blocks, places.tolist()) != told["blocks"]:
        raise ValueError(key)
    return arrays


def _read_block(path: Path, block: memoryview, place: int) -> str:
    """Fill a block with what the file holds from a place on, and tell its hash."""
    with path.open("rb", buffering=0) as file:
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
def _whole(path: Path) -> Iterator[Path]:
    """A name that becomes the path when all was written, and is removed when not."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.{os.getpid()}.{threading.get_ident()}.part")
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _prune(folder: Path) -> None:
    """Forget the files used longest ago while the folder holds more than its share, and unfinished ones."""
    stored = sorted(folder.glob(f"*{_SUFFIX}"), key=lambda p: p.stat().st_mtime, reverse=True)
    total = 0
    for path in stored:
        total += path.stat().st_size
        if total > _MOST_BYTES:
            path.unlink(missing_ok=True)
    for path in folder.glob("*.part"):  # of processes that were killed
        if time.time() - path.stat().st_mtime > _LONGEST_S:
            path.unlink(missing_ok=True)
