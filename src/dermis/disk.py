"""Results kept on disk by the content of what they were made from."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import struct
import threading
import time
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Arrays = dict[str, Array]
_MOST_BYTES = 2 << 30  # of each folder
_START_S = 300.0  # longer than a process takes to read all that it wants
_LONGEST_S = 24 * 3600.0  # after that nobody is still writing a file
_DAMAGED: tuple[type[Exception], ...] = (OSError, ValueError, TypeError, KeyError, EOFError, RuntimeError)
_DAMAGED += (MemoryError, struct.error, zipfile.BadZipFile)
_NAME_LENGTHS = 26  # where a member of an archive tells how long its name and what follows are
_MOST_HEAD = 4096  # bytes before an array's own


def cache_folder() -> Path:
    """Where files lie that can all be had again: DERMIS_CACHE, else the user's cache folder."""
    import platformdirs

    return Path(os.environ.get("DERMIS_CACHE") or platformdirs.user_cache_dir("dermis"))


def cached_mips(source: Array, form: str, make: Callable[[], list[Array]]) -> list[Array]:
    """The mip levels that `make` returns for a picture, kept on disk in the same way.

    source : all that they are made of
    form : how
    """
    names = [f"level {k}" for k in range(max(source.shape[:2]).bit_length())]

    def levels() -> Arrays:
        return dict(zip(names, make(), strict=True))

    made = stored("mips", _array_key([source], form), names, levels)
    return [made[name] for name in names]


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
    return stored("arrays", _array_key(sources, form), names, make)


def stored(folder: str, key: str, names: list[str], make: Callable[[], Arrays]) -> Arrays:
    """The arrays `names` from the file of that key, or made and stored."""
    path = cache_folder() / folder / f"{key}.npz"
    with contextlib.suppress(*_DAMAGED):
        with path.open("rb") as file, zipfile.ZipFile(file) as stored:
            arrays = {name: _array(file, stored.getinfo(f"{name}.npy")) for name in names}
        with contextlib.suppress(OSError):  # others' folder: to be read only
            path.touch()
        return arrays
    arrays = make()
    with contextlib.suppress(OSError):
        if _has_room(path.parent, sum(array.nbytes for array in arrays.values())):
            _store(path, arrays)
            _prune(path.parent)
    return arrays


def _array_key(sources: Sequence[Array], form: str) -> str:
    digest = hashlib.sha256(form.encode())
    for source in sources:
        digest.update(f" {source.shape} {source.dtype}".encode())
        digest.update(np.ascontiguousarray(source).data)
    return digest.hexdigest()[:40]


def _has_room(folder: Path, size: int) -> bool:
    """Whether that many bytes fit beside what was just used; in turn, they would drive each other out."""
    now = time.time()
    stored = (path.stat() for path in folder.glob("*.npz"))
    return size + sum(one.st_size for one in stored if now - one.st_mtime < _START_S) <= _MOST_BYTES


def _array(file: io.BufferedReader, member: zipfile.ZipInfo) -> Array:
    """An array that `np.savez` has stored; NumPy's own reader takes three times as long for large ones."""
    file.seek(member.header_offset + _NAME_LENGTHS)
    file.seek(sum(struct.unpack("<HH", file.read(4))), os.SEEK_CUR)
    data = np.empty(member.file_size, np.uint8)
    if file.readinto(data.data) != len(data) or zlib.crc32(data.data) != member.CRC or member.compress_type:
        raise zipfile.BadZipFile(member.filename)
    head = io.BytesIO(data[:_MOST_HEAD].tobytes())
    np.lib.format.read_magic(head)
    shape, in_columns, kind = np.lib.format.read_array_header_1_0(head)
    return data[head.tell() :].view(kind).reshape(shape, order="F" if in_columns else "C")


def _store(path: Path, arrays: Arrays) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.{threading.get_ident()}.part")
    try:
        with unfinished.open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]  # its last parameter is no array
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _prune(folder: Path) -> None:
    """Forget the files used longest ago while the folder holds more than its share, and unfinished ones."""
    stored = sorted(folder.glob("*.npz"), key=lambda p: p.stat().st_mtime, reverse=True)
    total = 0
    for path in stored:
        total += path.stat().st_size
        if total > _MOST_BYTES:
            path.unlink(missing_ok=True)
    for path in folder.glob("*.part"):  # of processes that were killed
        if time.time() - path.stat().st_mtime > _LONGEST_S:
            path.unlink(missing_ok=True)
