"""Files that others could have written are not read, and cached files belong to this user alone."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from dermis.base import disk
from dermis.base.errors import DermisWarning
from dermis.base.private import describe_other_writers, make_private_folder, open_private_file

pytestmark = pytest.mark.skipif(os.name != "posix", reason="owners and modes are POSIX's")
_NOBODY = 54321


@pytest.fixture
def place(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a cache folder that does not exist yet, below one that everybody may enter."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        monkeypatch.setenv("DERMIS_CACHE", str(Path(folder, "cache")))
        yield Path(folder)


def _kept() -> bool:
    """Return whether an array that was computed once is found the next time."""
    made: list[int] = []
    for _ in range(2):
        array = disk.cached_array(np.zeros(1), "one", lambda: made.append(1) or np.arange(5.0))
        assert np.array_equal(array, np.arange(5.0))
    return len(made) < 2


def _not_kept(why: str) -> bool:
    """Return whether nothing is cached, with one note about it."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DermisWarning)
        kept = _kept()
    (note,) = [str(one.message) for one in caught]
    return not kept and why in note and "DERMIS_CACHE" in note


def _give_away(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a path belong to another user."""
    if os.geteuid() == 0:
        os.chown(path, _NOBODY, _NOBODY, follow_symlinks=False)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: _NOBODY)


def test_cache_files_are_readable_by_the_user_only(place: Path) -> None:
    umask = os.umask(0)
    try:
        assert _kept()
    finally:
        os.umask(umask)
    (file,) = place.rglob("*.arrays")
    assert file.stat().st_mode & 0o777 == 0o600
    for folder in (file.parent, file.parent.parent):
        assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("name", ["", "cache", "cache/arrays"])
@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o773])
def test_folder_writable_by_others_is_not_used(place: Path, name: str, mode: int) -> None:
    make_private_folder(place / name)
    (place / name).chmod(mode)
    if mode == 0o1777 and name != "cache/arrays":  # others cannot rename there what is not theirs
        assert _kept()
    else:
        assert _not_kept(f"other users can write to {place / name}")
        assert not list(place.rglob("*.arrays"))


@pytest.mark.parametrize("name", ["cache", "cache/arrays"])
def test_a_folder_of_another_user_is_not_used(
    place: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert _kept()
    _give_away(place / name, monkeypatch)
    assert _not_kept("belongs to another user")


def test_a_link_of_another_user_is_not_followed(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "mine").mkdir(0o700)
    (place / "cache").symlink_to("mine")
    assert _kept() and list((place / "mine").rglob("*.arrays"))
    _give_away(place / "cache", monkeypatch)
    assert _not_kept("belongs to another user")


def test_links_are_followed_step_by_step(place: Path) -> None:
    (place / "open").mkdir()
    (place / "open").chmod(0o777)
    (place / "open" / "inner").mkdir(0o700)
    (place / "one").symlink_to(place / "open" / ".." / "open" / "inner")
    (place / "cache").symlink_to("one")
    assert describe_other_writers(place / "cache") == f"other users can write to {place / 'open'}"
    (place / "round").symlink_to("round")
    with pytest.raises(OSError, match="symbolic links"):
        describe_other_writers(place / "round" / "more")


def test_file_writable_by_others_is_recomputed(place: Path) -> None:
    assert _kept()
    (file,) = place.rglob("*.arrays")
    file.chmod(0o666)
    made: list[int] = []
    disk.cached_array(np.zeros(1), "one", lambda: made.append(1) or np.arange(5.0))
    assert made == [1] and file.stat().st_mode & 0o777 == 0o600


def test_pipe_does_not_block_the_reader(place: Path) -> None:
    os.mkfifo(place / "pipe", 0o600)
    with pytest.raises(ValueError, match="not a private file of this user"):
        open_private_file(place / "pipe")
    (place / "link").symlink_to(place / "pipe")
    with pytest.raises(OSError, match="symbolic link"):
        open_private_file(place / "link")


@pytest.mark.parametrize("kind", ["pipe", "link", "folder", "link to nowhere"])
def test_non_file_at_a_cache_path_is_tolerated(place: Path, kind: str) -> None:
    assert _kept()
    (file,) = place.rglob("*.arrays")
    whole = file.read_bytes()
    file.unlink()
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        (file / "inner").mkdir(parents=True)
    else:
        (place / "elsewhere").write_bytes(whole)
        file.symlink_to(place / ("elsewhere" if kind == "link" else "nowhere"))
    assert _kept() == (kind != "folder")
    assert kind == "folder" or not file.is_symlink()
    other = disk.cached_array(np.ones(1), "other", lambda: np.ones(3))
    assert disk.load_arrays("arrays", disk.array_key([np.ones(1)], "other"), ["array"]) is not None
    assert np.array_equal(other, np.ones(3))


@pytest.mark.parametrize(
    "name", ["/dev/null", "/proc/dermis", "/dev/full/dermis", "x" * 300, "/dev/null/a/b"]
)
def test_unusable_cache_folder_is_tolerated(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DERMIS_CACHE", name)
    assert _kept() == (".." in name)


def test_user_without_home_has_no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No folder called ~ is created in the current folder."""
    monkeypatch.chdir(tmp_path)
    for name in ("DERMIS_CACHE", "HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pwd.getpwuid", lambda number: {}[number])
    assert not _kept() and not list(tmp_path.iterdir())


def test_full_disk_is_tolerated(place: Path) -> None:
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        assert not _kept()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert _kept() and len([path for path in place.rglob("*") if path.is_file()]) == 1
