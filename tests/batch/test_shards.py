"""Shards: completeness, equality of bytes, and manifests."""

from __future__ import annotations

import errno
import os
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_observation import observation, small_spec, write_all, write_shard

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.shards import (
    Shard,
    ShardWriter,
    is_intact,
    list_shards,
    read_manifest,
    remove_unfinished_files,
    shard_exists,
    shard_path,
)
from dermis.apps.batch.spec import Spec
from dermis.base.errors import DermisError

FORMATS = "webdataset", "folder"


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(params=FORMATS)
def spec(request: pytest.FixtureRequest) -> Spec:
    return small_spec(format=request.param, outputs=("depth",))


def test_shards_hold_each_image_once() -> None:
    assert list_shards(small_spec()) == [Shard(0, 0, 3), Shard(1, 3, 6), Shard(2, 6, 7)]
    assert list_shards(small_spec(count=3)) == [Shard(0, 0, 3)]


def test_shards_have_equal_bytes_in_any_order(
    tmp_path: Path, spec: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_all(tmp_path / "a", spec)
    monkeypatch.setattr("time.time", lambda: 2e9)
    os.umask(os.umask(0o077) ^ 0o055)  # another one than before
    (tmp_path / "b").mkdir()
    for shard in reversed(list_shards(spec)):
        write_shard(tmp_path / "b", shard, spec)
    found = contents(tmp_path / "a")
    assert found == contents(tmp_path / "b") and len(found) >= 3
    assert not [name for name in found if "part" in name or "tmp" in name or name.startswith(".")]


def test_entries_of_tar_files_have_fixed_time_owner_and_order(tmp_path: Path) -> None:
    write_all(tmp_path, small_spec(outputs=("depth",)))
    with tarfile.open(tmp_path / "shard-00001.tar") as shard:
        members = shard.getmembers()
    assert [one.name for one in members] == [
        *(f"00000000{k}.{suffix}" for k in (3, 4, 5) for suffix in ("depth.png", "json", "png")),
        "__whole__",
    ]
    assert {(one.mtime, one.uid, one.gid, one.uname, one.gname, one.mode) for one in members} == {
        (0, 0, 0, "", "", 0o644)
    }


def test_complete_shards_are_detected(tmp_path: Path, spec: Spec) -> None:
    first, *_, last = list_shards(spec)
    assert not shard_exists(tmp_path, first, spec) and not is_intact(tmp_path, first, spec)
    write_all(tmp_path, spec)
    assert all(
        is_intact(tmp_path, shard, spec) and shard_exists(tmp_path, shard, spec)
        for shard in list_shards(spec)
    )
    stamp = read_manifest(shard_path(tmp_path, last, spec))
    assert (stamp.spec, stamp.first, stamp.stop) == (spec.digest(), 6, 7)
    assert stamp.made_with["adapter"] == "an adapter" and stamp.made_with["wgpu"]


def test_any_damage_is_noticed_and_the_shard_written_again(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    spec = small_spec(outputs=("depth",))
    shard = list_shards(spec)[0]
    write_shard(tmp_path, shard, spec)
    path = shard_path(tmp_path, shard, spec)
    sound = path.read_bytes()
    for at in [0, len(sound) - 1, *rng.integers(0, len(sound), 200).tolist()]:
        path.write_bytes(sound[:at] + bytes([sound[at] ^ 1 << int(rng.integers(8))]) + sound[at + 1 :])
        assert not is_intact(tmp_path, shard, spec), at
    for size in [0, 1, 511, len(sound) // 2, len(sound) - 1, len(sound) - 1024]:
        path.write_bytes(sound[:size])
        assert not is_intact(tmp_path, shard, spec) and not shard_exists(tmp_path, shard, spec), size
    head = sound.rindex(b"__whole__\0")  # two digits in another order have the same checksum
    path.write_bytes(sound[:head] + sound[head:].replace(b"0000644", b"0000464"))
    assert not is_intact(tmp_path, shard, spec)
    path.write_bytes(sound + b"\0")
    assert not is_intact(tmp_path, shard, spec)
    write_shard(tmp_path, shard, spec)
    assert path.read_bytes() == sound and is_intact(tmp_path, shard, spec)


def test_damage_of_folders_is_noticed_and_the_shard_written_again(tmp_path: Path) -> None:
    spec = small_spec(format="folder", outputs=("depth",))
    shard = list_shards(spec)[0]
    write_shard(tmp_path, shard, spec)
    sound, path = contents(tmp_path), tmp_path / "shard-00000"

    def damage(name: str, data: bytes | None) -> None:
        (path / name).unlink() if data is None else (path / name).write_bytes(data)
        assert not is_intact(tmp_path, shard, spec)
        write_shard(tmp_path, shard, spec)
        assert contents(tmp_path) == sound and is_intact(tmp_path, shard, spec)

    damage("000000001.png", None)
    damage("000000001.png", b"")
    damage("000000009.png", b"more")
    damage("__whole__", b"{}")
    damage("__whole__", None)


def test_shards_of_another_data_set_are_refused(tmp_path: Path, spec: Spec) -> None:
    write_all(tmp_path, spec)
    other = small_spec(format=spec.format, outputs=("depth",), seed=5)
    for known in (shard_exists, is_intact):
        with pytest.raises(DermisError, match=r"shard-00000.*another spec\. Choose another folder"):
            known(tmp_path, list_shards(other)[0], other)


def test_temporary_files_of_killed_runs_are_removed_and_those_of_others_kept(
    tmp_path: Path, spec: Spec
) -> None:
    first, second, _ = list_shards(spec)
    for shard in (first, second):
        writer = ShardWriter(tmp_path, shard, spec)
        writer.__enter__()
        writer.add(shard.first, {"json": b"{}"})
        writer._files.close()
    (tmp_path / ".spec.toml-0123456789ab.unfinished").touch()
    (tmp_path / ".mine").touch()
    write_shard(tmp_path, list_shards(spec)[2], spec)
    left = {path.name for path in tmp_path.iterdir()}
    assert len(left) == 5 and not [name for name in left if "part" in name or "tmp" in name]
    remove_unfinished_files(tmp_path, [shard_path(tmp_path, first, spec).name])
    assert sum(path.name.startswith(".shard-00001") for path in tmp_path.iterdir()) == 1
    assert len(list(tmp_path.iterdir())) == 3
    remove_unfinished_files(tmp_path)
    whole = shard_path(tmp_path, list_shards(spec)[2], spec).name
    assert {path.name for path in tmp_path.iterdir()} == {".mine", whole}


def test_a_failed_shard_leaves_no_files(tmp_path: Path, spec: Spec) -> None:
    shard = list_shards(spec)[0]
    with pytest.raises(KeyboardInterrupt), ShardWriter(tmp_path, shard, spec) as writer:
        writer.add(0, {"json": b"{}"})
        raise KeyboardInterrupt
    for images, said in (([0], "1 images and 0 left out"), ([0, 0], "image 0 was added after 0")):
        with pytest.raises(ValueError, match=said), ShardWriter(tmp_path, shard, spec) as writer:
            for number in images:
                writer.add(number, {"json": b"{}"})
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_ends_cleanly_and_keeps_complete_shards(
    tmp_path: Path, spec: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second, _ = list_shards(spec)
    write_shard(tmp_path, first, spec)

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for name in ("TarWriter.add", "FolderWriter.add", "move_into_place"):
        home = "shards." if name == "move_into_place" else "shard_formats."
        with monkeypatch.context() as patch:
            patch.setattr(f"dermis.apps.batch.{home}{name}", full)
            if name.startswith("Tar") != (spec.format == "webdataset") and name != "move_into_place":
                continue
            with pytest.raises(DermisError, match=r"shard-00001.*No space left.*with space left"):
                write_shard(tmp_path, second, spec)
        assert [path.name for path in tmp_path.iterdir()] == [shard_path(tmp_path, first, spec).name]
    assert is_intact(tmp_path, first, spec)


def test_a_missing_folder_is_reported(tmp_path: Path, spec: Spec) -> None:
    with pytest.raises(DermisError, match=r"shard-00000.*No such file"):
        write_shard(tmp_path / "none", list_shards(spec)[0], spec)


def test_images_that_were_left_out_are_recorded(tmp_path: Path, spec: Spec) -> None:
    shard = list_shards(spec)[1]
    with ShardWriter(tmp_path, shard, spec) as writer:
        for number in (3, 5):
            writer.add(number, encode_record(number, observation(number), spec.parameters(number), spec))
        writer.leave_out(4, "a head\nthat is “damaged”" + "." * 300)
    assert is_intact(tmp_path, shard, spec)
    ((number, reason),) = read_manifest(shard_path(tmp_path, shard, spec)).left_out
    assert number == 4 and "“damaged”" in reason and len(reason) <= 200


def test_files_that_others_remove_meanwhile_are_written_again(tmp_path: Path) -> None:
    tries = []

    def write(path: Path) -> None:
        path.write_bytes(b"whole")
        tries.append(path)
        if len(tries) < 3:
            remove_unfinished_files(tmp_path)

    atomic_write(tmp_path / "index.parquet", write)
    assert len(tries) == 3 and contents(tmp_path) == {"index.parquet": b"whole"}
    with pytest.raises(DermisError, match=r"no/README\.md: expected a writable path"):
        atomic_write(tmp_path / "no" / "README.md", lambda path: path.write_bytes(b""))
