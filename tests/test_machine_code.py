"""Cached machine code: it is found again, and never run if it was changed or written by another user."""

from __future__ import annotations

import os
import pickle
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("numba", reason="the extra `truth` is not installed")

from dermis.base import disk
from dermis.base.compiled import compiled
from dermis.base.errors import DermisWarning


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the cache folder, below one that everybody may enter."""
    with tempfile.TemporaryDirectory() as made:
        Path(made).chmod(0o755)
        monkeypatch.setenv("DERMIS_CACHE", made)
        yield Path(made)


def _outer() -> Any:
    """Return a new function that calls another new one, as in a new process."""
    inner = compiled(_inner)
    namespace = {"inner": inner, "__name__": __name__}
    function = type(_call)(_call.__code__, namespace, "_call")
    return compiled(function)


def _inner(number: int) -> int:
    return 2 * number


def _call(number: int) -> int:
    return inner(number) + 1  # type: ignore[name-defined, no-any-return]  # noqa: F821


def _was_found(function: Any) -> bool:
    assert function(20) == 41
    return bool(function.stats.cache_hits)


def _files(folder: Path) -> list[Path]:
    return sorted((folder / "machine-code").iterdir())


def test_compiled_code_is_reused_and_stored_in_one_folder(folder: Path) -> None:
    beside = set(Path(__file__).parent.rglob("*.nb[ic]"))
    assert not _was_found(_outer()) and len(_files(folder)) == 2
    assert _was_found(_outer())
    assert set(Path(__file__).parent.rglob("*.nb[ic]")) == beside
    assert all(file.stat().st_mode & 0o777 == 0o600 for file in _files(folder))


def test_other_types_and_sources_compile_separately(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    function = _outer()
    assert function(20) == 41 and function(0.5) == 2.0
    assert _outer()(0.5) == 2.0 and len(_files(folder)) == 4
    monkeypatch.setattr("dermis.base.compiled._source_hash", lambda folder: "a file was changed")
    assert not _was_found(_outer())


class _Marks:
    """Object that creates a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.mark),)


BROKEN: dict[str, Callable[[bytes, bytes], bytes]] = {
    "empty": lambda whole, bad: b"",
    "cut": lambda whole, bad: whole[: len(whole) // 2],
    "one bit": lambda whole, bad: whole[:-9] + bytes([whole[-9] ^ 4]) + whole[-8:],
    "another pickle": lambda whole, bad: bad,
    "another pickle inside": lambda whole, bad: whole[: -len(bad)] + bad,
}


@pytest.mark.parametrize("broken", BROKEN)
def test_damaged_code_is_not_run(folder: Path, broken: str) -> None:
    assert not _was_found(_outer())
    bad, whole = pickle.dumps(_Marks(folder / "mark")), [file.read_bytes() for file in _files(folder)]
    for file, data in zip(_files(folder), whole, strict=True):
        file.write_bytes(BROKEN[broken](data, bad))
    assert not _was_found(_outer()) and not (folder / "mark").exists()
    assert _was_found(_outer())


@pytest.mark.skipif(os.name != "posix", reason="modes are POSIX's")
def test_code_writable_by_others_is_not_run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import numpy as np

    assert not _was_found(_outer())
    data = np.frombuffer(pickle.dumps(_Marks(folder / "mark")), np.uint8)
    for file in _files(folder):
        disk.save_arrays("machine-code", file.stem, {"code": data})
    folder.chmod(0o777)
    with pytest.warns(DermisWarning, match="other users can write"):
        assert not _was_found(_outer())
    assert not (folder / "mark").exists()


def test_code_is_recompiled_without_a_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", os.devnull)
    for _ in range(2):
        assert not _was_found(_outer())
