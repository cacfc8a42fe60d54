"""Data sets have the same bytes for all numbers of workers and after interruptions."""

from __future__ import annotations

import multiprocessing
import os
import random
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from small_set import COUNT, HERE, PARTS, SHARD_SIZE, SHARDS, contents, drawn, drawn_here, read, write_spec

from dermis.apps.batch.reader import shard_files
from dermis.apps.batch.run import Progress, run
from dermis.apps.batch.shards import ShardWriter, list_shards, shard_path
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.worker import RunOptions
from dermis.apps.batch.worker_pool import ProcessPool
from dermis.base.errors import DermisError

Files = dict[str, bytes]
pytestmark = pytest.mark.usefixtures("many_form_factor_lines")  # as in other processes


def killing(moments: set[int], rng: random.Random) -> Callable[[Progress], None]:
    """Return a function that kills a worker when given numbers of images are done."""

    def kill_worker(progress: Progress) -> None:
        if progress.images in moments:
            moments.discard(progress.images)
            workers = sorted(multiprocessing.active_children(), key=lambda one: one.pid or 0)
            if workers:
                rng.choice(workers).kill()

    return kill_worker


def test_the_set_has_all_that_it_should(undisturbed: Files) -> None:
    shards = [name for name in undisturbed if name.startswith("shard-")]
    assert len(shards) == SHARDS
    assert {"spec.toml", "index.parquet", "README.md"} <= undisturbed.keys()
    assert not [name for name in undisturbed if "part" in Path(name).stem or "tmp" in name]


def test_two_workers_that_have_encoders_write_the_same(
    small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    progress: list[tuple[int, int]] = []
    report = drawn(
        small_spec, tmp_path / "out", 2, 1, on_progress=lambda now: progress.append((now.images, now.total))
    )
    assert contents(tmp_path / "out") == undisturbed
    assert (report.images, report.shards, report.skipped) == (COUNT, SHARDS, 0)
    assert progress[-1] == (COUNT, COUNT)


def test_shares_of_shards_make_the_whole_in_any_order(
    small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    first = drawn_here(small_spec, tmp_path, shard_selection=(1, 2))
    assert not first.is_complete and "index.parquet" not in contents(tmp_path)
    second = drawn_here(small_spec, tmp_path, shard_selection=(0, 2))
    assert second.is_complete and first.shards + second.shards == SHARDS
    assert contents(tmp_path) == undisturbed


def test_sets_of_another_generator_are_not_continued(
    small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    put(undisturbed, tmp_path)
    assert "generator = 6" in small_spec.to_toml()
    (tmp_path / "spec.toml").write_text(small_spec.to_toml().replace("generator = 6\n", ""))
    with pytest.raises(DermisError, match=r"of generator number 6, but it was made with number 1"):
        drawn(small_spec, tmp_path)
    assert b"generator" not in contents(tmp_path)["spec.toml"], "the folder is as it was"


def test_shares_of_parts_make_the_whole_in_any_order(
    small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    reports = [drawn_here(small_spec, tmp_path, part_selection=(share, 2)) for share in (1, 0)]
    assert [one.is_complete for one in reports] == [False, True]
    assert [one.images for one in reports] == [
        sum(stop - first for first, stop in PARTS[k::2]) for k in (1, 0)
    ]
    assert sum(one.shards for one in reports) == SHARDS and contents(tmp_path) == undisturbed


def test_a_set_that_grows_is_the_one_made_at_once(
    small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    """An interrupted run ends in the middle of a part, and other workers add to it."""
    first = drawn_here(small_spec.replace(count=35), tmp_path, shard_selection=(1, 2))
    assert (first.images, first.shards, first.is_complete) == (15, 1, False)
    second = drawn(small_spec, tmp_path, 2)
    assert (second.images, second.shards, second.is_complete) == (COUNT - 15, SHARDS, True)
    assert contents(tmp_path) == undisturbed


def test_images_that_are_there_keep_their_bytes(small_spec: Spec, undisturbed: Files, tmp_path: Path) -> None:
    """Pictures that no renderer would draw survive growth, so they are not rendered again."""
    small, mark = small_spec.replace(count=18), b"THERE"
    put(undisturbed, tmp_path / "whole")
    put({"spec.toml": small.to_toml().encode()}, tmp_path / "out")
    (shard,) = list_shards(small)
    with (
        shard_files(shard_path(tmp_path / "whole", shard, small)) as images,
        ShardWriter(tmp_path / "out", shard, small) as writer,
    ):
        for key, files in list(images.items())[:18]:
            entries = {suffix: read() for suffix, read in files.items()}
            writer.add(int(key), {**entries, "normal.png": entries["normal.png"] + mark})
    assert drawn_here(small_spec.replace(count=36), tmp_path / "out").images == 18
    pictures = [
        data.count(mark) for name, data in contents(tmp_path / "out").items() if name.endswith(".tar")
    ]
    assert pictures == [18, 0]


def test_missing_packages_are_found_before_the_first_image(
    small_spec: Spec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(DermisError, match="expected the package pyarrow"):
        drawn(small_spec, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_whole_is_not_drawn_again(small_spec: Spec, undisturbed: Files, tmp_path: Path) -> None:
    put(undisturbed, tmp_path)
    (tmp_path / "index.parquet").unlink()
    verified: list[tuple[int, int]] = []
    report = drawn(
        small_spec, tmp_path, on_progress=lambda now: verified.append((now.verified, now.to_verify))
    )
    assert (report.images, report.shards, report.skipped) == (0, 0, SHARDS)
    assert verified == [(1, SHARDS), (2, SHARDS), (3, SHARDS)], "by workers"
    assert contents(tmp_path) == undisturbed


def test_a_shard_that_was_damaged_is_drawn_again(
    small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    put(undisturbed, tmp_path)
    name = next(name for name in sorted(undisturbed) if name.startswith("shard-"))
    data = bytearray(undisturbed[name])
    data[700] ^= 1
    (tmp_path / name).write_bytes(data)
    report = drawn_here(small_spec, tmp_path)
    assert (report.shards, report.skipped) == (1, SHARDS - 1)
    assert contents(tmp_path) == undisturbed


def test_killed_workers_lose_nothing(small_spec: Spec, undisturbed: Files, tmp_path: Path) -> None:
    rng = random.Random(1)
    moments = set(rng.sample(range(1, COUNT - 1), 2))
    with pytest.warns(UserWarning, match=r"SIGKILL; its part is rendered again"):
        report = drawn(small_spec, tmp_path, 2, 1, on_progress=killing(moments, rng))
    assert report.is_complete and contents(tmp_path) == undisturbed


def test_a_shard_that_no_worker_survives_is_given_up(
    small_spec: Spec, undisturbed: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.apps.batch.worker_pool.MAX_TASK_ATTEMPTS", 2)
    put(undisturbed, tmp_path)
    lost = next(name for name in sorted(undisturbed) if name.startswith("shard-"))
    (tmp_path / lost).unlink()
    kill_all = lambda now: [one.kill() for one in multiprocessing.active_children()]  # noqa: E731
    with (
        pytest.warns(UserWarning, match="rendered again"),
        pytest.raises(DermisError, match=r"images 0 to 15 of shard 0: .*2 failed.*SIGKILL"),
    ):
        drawn(small_spec, tmp_path, on_progress=kill_all)
    assert contents(tmp_path).keys() == undisturbed.keys() - {lost}


def test_another_data_set_is_refused(small_spec: Spec, undisturbed: Files, tmp_path: Path) -> None:
    put(undisturbed, tmp_path)
    with pytest.raises(DermisError, match=r"its spec\.toml differs"):
        drawn(small_spec.replace(seed=4), tmp_path)
    assert contents(tmp_path) == undisturbed


def test_a_bad_head_is_refused_and_what_is_whole_stays(tmp_path: Path) -> None:
    spec = read(write_spec(tmp_path, "bad.obj"))
    with pytest.raises(DermisError, match=r"image \d: .*bad\.obj"):
        drawn_here(spec, tmp_path / "out")
    left = contents(tmp_path / "out")
    assert all(name == "spec.toml" or name.startswith(("shard-", "part-")) for name in left)


def test_bad_heads_are_left_out_the_same_by_all(tmp_path: Path) -> None:
    spec = read(write_spec(tmp_path, "bad.obj"))
    bad = [k for k in range(COUNT) if spec.parameters(k)["person.head"] == "bad.obj"]
    assert bad and len(bad) < COUNT - SHARD_SIZE
    reports = [
        drawn(spec, tmp_path / str(workers), workers, workers - 1, keep_going=True) for workers in (1, 2)
    ]
    for report in reports:
        assert [one.number for one in report.failed] == bad and report.images == COUNT - len(bad)
        assert all("bad.obj" in one.reason for one in report.failed)
    assert contents(tmp_path / "1") == contents(tmp_path / "2")
    assert "bad.obj" in contents(tmp_path / "1")["README.md"].decode()


@pytest.mark.skipif(os.name != "posix", reason="limits of files are POSIX's")
def test_a_full_disk_keeps_what_is_whole(small_spec: Spec, undisturbed: Files, tmp_path: Path) -> None:
    import resource

    lost = [name for name in undisturbed if name.startswith("shard-00002")]
    put({name: data for name, data in undisturbed.items() if name not in lost}, tmp_path)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(
        resource.RLIMIT_FSIZE, (2048, before[1])
    )  # another error than of a full disk, handled alike
    try:
        with pytest.raises(DermisError, match="cannot be written"):
            run(RunOptions(small_spec, tmp_path), ProcessPool([HERE]))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert contents(tmp_path).keys() == undisturbed.keys() - set(lost)
    assert drawn_here(small_spec, tmp_path).skipped == SHARDS - 1
    assert contents(tmp_path) == undisturbed


def put(files: Files, folder: Path) -> None:
    """Write files into a folder."""
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
