"""Cached atlases on disk: they are found again, and damaged ones are harmless."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.atlas import build as cached
from dermis.atlas.atlas import Atlas
from dermis.atlas.build import cached_atlas
from dermis.base import disk
from dermis.base.disk import cached_array
from dermis.formats.load import RiggedMesh, cached_rigged
from dermis.mesh.file_vertices import FileVertices
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import plane, uv_sphere


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    return tmp_path / "atlas"


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the list of sizes of atlases that were computed instead of loaded."""
    sizes: list[int] = []
    build = cached.build_atlas

    def counted(mesh: Mesh, size: int, layout: str, gutter_mm: float) -> Atlas:
        sizes.append(size)
        return build(mesh, size, layout, gutter_mm)

    monkeypatch.setattr(cached, "build_atlas", counted)
    return sizes


def same(a: Atlas, b: Atlas) -> bool:
    pairs = [(getattr(a, f.name), getattr(b, f.name)) for f in fields(Atlas)]
    return all(x.dtype == y.dtype and np.array_equal(x, y) for x, y in pairs)


def only(folder: Path) -> Path:
    (path,) = folder.iterdir()
    assert path.suffix == ".arrays"
    return path


def test_cached_value_equals_the_original(folder: Path, built: list[int]) -> None:
    first, second = (cached_atlas(uv_sphere(40.0, 12, 6), 64) for _ in range(2))
    assert same(first, second)
    assert built == [64]
    assert only(folder)


def test_mesh_and_size_are_part_of_the_key(folder: Path, built: list[int]) -> None:
    for mesh, size in ((plane(10.0), 64), (plane(20.0), 64), (plane(10.0), 65), (plane(10.0, 2), 64)):
        cached_atlas(mesh, size)
    assert len(built) == 4 and len(list(folder.iterdir())) == 4


def test_layout_and_reach_are_part_of_the_key(folder: Path, built: list[int]) -> None:
    sphere = uv_sphere(40.0, 24, 12)
    made = [
        cached_atlas(sphere, 64, *how)
        for how in (("mesh",), ("stitched",), ("stitched", 5.0), ("unwrapped",), ("stitched",))
    ]
    assert len(built) == 4 and len(list(folder.iterdir())) == 4
    assert same(made[1], made[4])
    assert len(made[1].gutter) > len(made[2].gutter) > len(made[0].gutter) == len(made[3].gutter) == 0


BROKEN: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda whole: b"",
    "another file": lambda whole: b"PK\x03\x04 half an archive",
    "a long line": lambda whole: b"x" * 3_000_000,
    "cut": lambda whole: whole[: len(whole) // 2],
    "one byte short": lambda whole: whole[:-1],
    "an array": lambda whole: whole[:-3000] + bytes(b ^ 0xFF for b in whole[-3000:-2900]) + whole[-2900:],
    "the last bit": lambda whole: whole[:-1] + bytes([whole[-1] ^ 1]),
    "a shape": lambda whole: whole.replace(b"[64, 64]", b"[32, 128]", 1),
    "a name": lambda whole: whole.replace(b'"triangle"', b'"triangel"'),
    "the hash": lambda whole: b"0" * 64 + whole[64:],
    "objects": lambda whole: forged(whole, lambda told: told["arrays"][0].__setitem__(1, "|O")),
    "other arrays": lambda whole: forged(whole, lambda told: told["arrays"].pop()),
    "deep": lambda whole: headed(b'{"key": ' + b"[" * 500_000),
    "no table": lambda whole: headed(b"[1, 2]"),
    "more than it holds": lambda whole: forged(
        whole, lambda told: told["arrays"][0].__setitem__(2, [1 << 50])
    ),
    "less than nothing": lambda whole: forged(
        whole, lambda told: told["arrays"][0].__setitem__(2, [-1, -4096])
    ),
    "longer": lambda whole: whole + b"more",
    "another key": lambda whole: forged(whole, lambda told: told.update(key="atlas/0")),
}


def shaped(told: dict[str, Any], *shape: int) -> None:
    told["arrays"][0][2] = shape


def forged(whole: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """Return a file with another header and the matching hash."""
    _, head, data = whole.split(b"\n", 2)
    change(told := json.loads(head))
    return headed(json.dumps(told).encode()) + data


def headed(head: bytes) -> bytes:
    """Return the header of a file after its hash."""
    return hashlib.sha256(head + b"\n").hexdigest().encode() + b"\n" + head + b"\n"


@pytest.mark.parametrize("broken", BROKEN)
def test_broken_file_is_recomputed(folder: Path, built: list[int], broken: str) -> None:
    first = cached_atlas(plane(10.0), 64)
    path = only(folder)
    path.write_bytes(BROKEN[broken](path.read_bytes()))
    assert same(cached_atlas(plane(10.0), 64), first)
    assert built == [64, 64]
    assert same(cached_atlas(plane(10.0), 64), first)
    assert built == [64, 64]
    assert only(folder) == path


def test_renamed_file_is_recomputed(folder: Path, built: list[int]) -> None:
    """It is valid, but of another mesh, size or kind."""
    first = cached_atlas(plane(10.0), 64)
    path = only(folder)
    cached_atlas(plane(11.0), 64)
    (other,) = set(folder.iterdir()) - {path}
    other.replace(path)
    assert same(cached_atlas(plane(10.0), 64), first)
    assert built == [64, 64, 64]
    (folder.parent / "links").mkdir()
    path.rename(folder.parent / "links" / path.name)
    assert disk.load_arrays("links", path.stem, ["triangle"]) is None


def test_a_large_file_is_checked_block_by_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    large = {"a": np.arange(3_000_000, dtype=np.uint32), "b": np.ones((1000, 777)).T}
    disk.save_arrays("large", "one", large)
    found = disk.load_arrays("large", "one", ["a", "b"])
    assert found is not None and all(np.array_equal(found[name], large[name]) for name in large)
    assert found["b"].flags.fnc  # sums over it round as they did
    path = only(tmp_path / "large")
    whole = bytearray(path.read_bytes())
    for place in (len(whole) // 3, len(whole) // 2, len(whole) - 1):
        whole[place] ^= 1
        path.write_bytes(whole)
        assert disk.load_arrays("large", "one", ["a", "b"]) is None
        whole[place] ^= 1
    path.write_bytes(whole)
    assert disk.load_arrays("large", "one", ["a", "b"]) is not None


@pytest.mark.parametrize("blocked", ["a file", "a folder in the file's place", "nothing may be written"])
def test_unusable_folder_is_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, blocked: str) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path / "here"))
    if blocked == "a file":
        (tmp_path / "here").write_text("")
    elif blocked == "a folder in the file's place":
        (tmp_path / "here" / "atlas" / f"{cached._atlas_key(plane(10.0), 64)}.arrays").mkdir(parents=True)
    else:
        monkeypatch.setattr(Path, "mkdir", _refuse)
    assert cached_atlas(plane(10.0), 64).size == 64
    assert not list(tmp_path.rglob("*.part"))


def test_a_folder_that_may_only_be_read_is_read(
    folder: Path, built: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = cached_atlas(plane(10.0), 64)
    monkeypatch.setattr(os, "utime", _refuse)
    assert same(cached_atlas(plane(10.0), 64), first)
    assert built == [64]


def _refuse(*_: object, **__: object) -> None:
    raise PermissionError("read-only file system")


def test_a_full_disk_leaves_no_part_file(
    folder: Path, built: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    assert cached_atlas(plane(10.0), 64).size == 64
    assert list(folder.iterdir()) == []


def test_least_recently_used_files_are_removed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cached_atlas(plane(10.0), 64)
    one = only(folder).stat().st_size
    monkeypatch.setattr(disk, "_MAX_FOLDER_BYTES", int(2.5 * one))
    first = only(folder)
    os.utime(first, (1, 1))
    cached_atlas(plane(11.0), 64)
    (second,) = set(folder.iterdir()) - {first}
    os.utime(second, (2, 2))
    cached_atlas(plane(10.0), 64)  # used again: now the second is the oldest
    cached_atlas(plane(12.0), 64)
    left = set(folder.iterdir())
    assert first in left and second not in left and len(left) == 2


def test_leftovers_of_killed_processes_are_removed_after_a_day(folder: Path) -> None:
    folder.mkdir()
    old, new = folder / "a.1.2.part", folder / "b.1.2.part"
    for path in (old, new):
        path.write_bytes(b"half of it")
    os.utime(old, (1, 1))
    cached_atlas(plane(10.0), 64)
    assert not old.exists() and new.exists()


def test_arrays_round_trip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    source = np.random.default_rng(1).random((6, 9)).astype(np.float32)
    made: list[str] = []

    def note(what: str, result: Any) -> Any:
        made.append(what)
        return result

    for _ in range(2):
        assert np.array_equal(cached_array(source, "a", lambda: note("picture", 2 * source)), 2 * source)
    assert made == ["picture"]
    for other, form in ((source, "b"), (source + 1, "a"), (source.reshape(9, 6), "a")):
        assert np.array_equal(cached_array(other, form, lambda: note("again", source)), source)
    assert made[1:] == ["again"] * 3


def test_order_of_sources_is_part_of_the_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    a, b = np.zeros(3), np.ones(3)
    made = [
        cached_array(sources, "sum", lambda k=k: np.full(2, k))[0]  # type: ignore[misc]
        for k, sources in enumerate([(a, b), (b, a), a, (a, b)])
    ]
    assert made == [0, 1, 2, 0]


def test_values_larger_than_the_folder_limit_are_not_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would evict all others, and itself, each time."""
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    monkeypatch.setattr(disk, "_MAX_FOLDER_BYTES", 1000)
    for k in (1, 2):
        assert cached_array(np.zeros(1), "large", lambda k=k: np.full(200, k))[0] == k  # type: ignore[misc]
        assert cached_array(np.zeros(1), "small", lambda k=k: np.full(20, k))[0] == 1  # type: ignore[misc]


def test_folder_limit_keeps_some_of_several_values(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The maps of one head may exceed the limit; otherwise each start would compute and write all of them."""
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    monkeypatch.setattr(disk, "_MAX_FOLDER_BYTES", 100_000)
    made: list[int] = []

    def start(first: int) -> None:
        made.clear()
        for k in range(first, first + 4):
            cached_array(np.array([k]), "map", lambda k=k: made.append(k) or np.zeros(30_000, np.uint8))  # type: ignore[misc]

    start(0)
    start(0)
    assert made == [3]
    for path in tmp_path.rglob("*.arrays"):  # another day
        os.utime(path, (1, 1))
    start(10)
    start(10)
    assert made == [13]


def test_all_array_types_round_trip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    arrays = {
        "none": np.zeros((0, 3), np.float16),
        "one": np.array(2.5),
        "turned": np.arange(12.0).reshape(3, 4).T,
        "strided": np.arange(20, dtype=np.uint16)[::3],
        "odd": np.arange(7, dtype=np.uint8),
        "true": np.array([True, False]),
    }
    for _ in range(2):
        found = disk.cached_arrays((), "kinds", list(arrays), lambda: arrays)
    assert found is not arrays
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype and found[name].shape == array.shape
        assert np.array_equal(found[name], array) and found[name].flags.writeable


def test_mesh_round_trip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    mesh, made = uv_sphere(20.0), []

    def load() -> RiggedMesh:
        made.append(1)
        vertex = np.arange(len(mesh.positions), dtype=np.int32)
        vertices = FileVertices(len(vertex), vertex, mesh.point, mesh.triangles, np.eye(3))
        return RiggedMesh(mesh, None, file_vertices=vertices)

    first, second = (cached_rigged(b"file", "up y", load).mesh for _ in range(2))
    for one in (first, second):
        assert one.materials == mesh.materials and np.array_equal(
            one.outline.points_mm, mesh.outline.points_mm
        )
        for name in ("positions", "normals", "uv", "dpdu", "dpdv", "point", "triangles", "material"):
            kept, given = getattr(one, name), getattr(mesh, name)
            assert kept.dtype == given.dtype and np.array_equal(kept, given)
    assert len(made) == 1
    cached_rigged(b"file", "up z", load)
    cached_rigged(b"another", "up y", load)
    assert len(made) == 3


def test_flipped_bits_are_detected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file is removed, so that the next start does not read it."""
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    disk.save_arrays("few", "one", {"a": np.arange(3, dtype=np.uint8)})
    path = only(tmp_path / "few")
    whole = path.read_bytes()
    for place in range(len(whole)):
        spoilt = bytearray(whole)
        spoilt[place] ^= 1 << 5 * place % 8
        path.write_bytes(spoilt)
        assert disk.load_arrays("few", "one", ["a"]) is None and not path.exists()
        path.touch(0o600)


def test_memory_is_allocated_only_after_the_size_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    disk.save_arrays("few", "one", {"a": np.arange(3, dtype=np.uint8)})
    path = only(tmp_path / "few")
    whole = path.read_bytes()
    monkeypatch.setattr(np, "empty", lambda *_: pytest.fail("made room"))
    for kind, shape in (
        ("|u1", [1 << 40]),
        ("|u1", [-3, -1]),
        ("|O", [3]),
        ("<f4,<f4", [3]),
        ("|S0", [1 << 62]),
    ):
        wrong = ["a", kind, shape, "C"]
        path.write_bytes(forged(whole, lambda told, wrong=wrong: told["arrays"].__setitem__(0, wrong)))
        assert disk.load_arrays("few", "one", ["a"]) is None


def test_concurrent_processes_leave_complete_files(tmp_path: Path) -> None:
    code = """
import sys
import numpy as np
from dermis.base import disk
from dermis.base.private import cache_folder
for k in range(60):
    for name in "ab":
        expected = np.full(3000, ord(name) + k % 3)
        found = disk.load_or_make("both", name + str(k % 3), ["array"], lambda: {"array": expected})
        assert np.array_equal(found["array"], expected)
        if k % 5 == 0:
            (cache_folder() / "both" / f"{name}{k % 3}.arrays").unlink(missing_ok=True)
"""
    environment = os.environ | {"DERMIS_CACHE": str(tmp_path)}
    command = [sys.executable, "-c", code]
    both = [subprocess.Popen(command, env=environment, stderr=subprocess.PIPE) for _ in range(2)]
    assert [(one.communicate()[1], one.returncode) for one in both] == [(b"", 0)] * 2
    assert not list(tmp_path.rglob("*.part"))
