"""Parts of shards: their sizes, joining, images kept by growth, and data sets of earlier versions."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from small_observation import observation, small_spec, write_shard
from small_set import HERE, contents

from dermis.apps.batch import parts as module
from dermis.apps.batch import worker_pool
from dermis.apps.batch.parts import copy_images, join_parts, kept_images
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.run import claim_folder
from dermis.apps.batch.shards import (
    Part,
    Shard,
    ShardWriter,
    is_intact,
    list_parts,
    list_shards,
    part_files,
    read_manifest,
    shard_exists,
    shard_path,
)
from dermis.apps.batch.spec import COUNT_LINE_PATTERN, GENERATOR_LINE_PATTERN, Spec
from dermis.apps.batch.worker import RunOptions, Worker, WorkerEvent
from dermis.base.errors import DermisError

COUNT, SHARD_SIZE = 50, 40


@pytest.fixture(params=["webdataset", "folder"])
def spec(request: pytest.FixtureRequest) -> Spec:
    return small_spec(count=COUNT, shard_size=SHARD_SIZE, format=request.param, outputs=("depth",))


def write_parts(out: Path, spec: Spec) -> list[Part]:
    """Write all parts of the first shard, the last one first."""
    out.mkdir(exist_ok=True)
    parts = list_parts(list_shards(spec)[0], spec)
    for part in reversed(parts):
        write_shard(out, part, spec)
    return parts


def whole_shard(out: Path, spec: Spec) -> dict[str, bytes]:
    """Return the files of the first shard, written at once."""
    out.mkdir()
    write_shard(out, list_shards(spec)[0], spec)
    return contents(out)


@pytest.mark.parametrize(("person", "size"), [(1, 16), (3, 18), (15, 30), (17, 17), (32, 32), (40, 16)])
def test_parts_hold_each_image_once_and_split_no_person(person: int, size: int) -> None:
    spec = small_spec(count=2500, shard_size=1000, images_per_person=person)
    parts = [part for shard in list_shards(spec) for part in list_parts(shard, spec)]
    assert [number for part in parts for number in range(part.first, part.stop)] == list(range(2500))
    assert max(map(len, parts)) == size
    ends = {part.stop for part in parts} - {shard.stop for shard in list_shards(spec)}
    assert all(end % size == 0 for end in ends)


def test_joined_parts_are_the_shard(tmp_path: Path, spec: Spec) -> None:
    out, shard = tmp_path / "out", list_shards(spec)[0]
    *_, last = parts = write_parts(out, spec)
    assert [(part.first, part.stop) for part in parts] == [(0, 16), (16, 32), (32, 40)]
    assert part_files(out).keys() == {0, 16, 32} and str(last) == "images 32 to 39 of shard 0"
    shutil.move(shard_path(out, last, spec), tmp_path / "away")
    assert join_parts(out, shard, spec) == () and not shard_exists(out, shard, spec)
    shutil.move(tmp_path / "away", shard_path(out, last, spec))
    assert join_parts(out, shard, spec) == () and is_intact(out, shard, spec)
    assert contents(out) == whole_shard(tmp_path / "whole", spec)


def test_a_double_join_is_harmless(tmp_path: Path, spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight threads join at once; then one joins in the middle of the join of another."""
    out, shard = tmp_path / "out", list_shards(spec)[0]
    sound = whole_shard(tmp_path / "whole", spec)
    write_parts(out, spec)
    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(lambda _: join_parts(out, shard, spec), range(8))) == {()}
    assert contents(out) == sound
    shutil.rmtree(out)
    write_parts(out, spec)
    copied: list[int] = []

    def copy_and_join(writer: ShardWriter, path: Path, first: int, stop: int) -> None:
        copied.append(first)
        if copied == [0, 16]:
            assert join_parts(out, shard, spec) == () and part_files(out) == {}
        copy_images(writer, path, first, stop)

    monkeypatch.setattr(module, "copy_images", copy_and_join)
    assert join_parts(out, shard, spec) == () and copied[:2] == [0, 16]
    assert contents(out) == sound


def test_damaged_parts_are_removed_and_reported(tmp_path: Path, spec: Spec) -> None:
    shard = list_shards(spec)[0]
    _, second, _ = write_parts(tmp_path, spec)
    path = shard_path(tmp_path, second, spec)
    file = path / "000000020.png" if path.is_dir() else path
    data = bytearray(file.read_bytes())
    data[700] ^= 1
    file.write_bytes(data)
    assert join_parts(tmp_path, shard, spec) == (second,) and part_files(tmp_path).keys() == {0, 32}
    write_shard(tmp_path, second, spec)
    assert join_parts(tmp_path, shard, spec) == () and is_intact(tmp_path, shard, spec)


def test_manifests_of_parts_are_merged(tmp_path: Path, spec: Spec) -> None:
    shard = list_shards(spec)[0]
    for part, adapter in zip(list_parts(shard, spec), ("B", "A", "B"), strict=True):
        with ShardWriter(tmp_path, part, spec, adapter) as writer:
            writer.leave_out(part.first, f"left out of {part.first}")
            for number in range(part.first + 1, part.stop):
                seen = observation(number, outputs=spec.outputs)
                writer.add(number, encode_record(number, seen, spec.parameters(number), spec))
    join_parts(tmp_path, shard, spec)
    manifest = read_manifest(shard_path(tmp_path, shard, spec))
    assert manifest.left_out == tuple((first, f"left out of {first}") for first in (0, 16, 32))
    assert manifest.made_with["adapter"] == "A + B" and " + " not in manifest.made_with["python"]


def test_images_of_a_smaller_shard_are_kept(tmp_path: Path, spec: Spec) -> None:
    """A shard of 20 images has the first part of a larger one, and a quarter of its second part."""
    small = spec.replace(count=20)
    write_shard(tmp_path, list_shards(small)[0], small)
    shard = list_shards(spec)[0]
    path = shard_path(tmp_path, shard, spec)
    assert not shard_exists(tmp_path, shard, spec), "it is not complete"
    kept = [kept_images(tmp_path, part, spec) for part in list_parts(shard, spec)]
    assert kept == [(path, 16), (path, 20), (None, 32)]
    write_shard(tmp_path, Part(0, 32, 36), spec)
    assert kept_images(tmp_path, Part(0, 32, 40), spec).stop == 36
    module._matches_sha256.cache_clear()
    file = path / "000000001.png" if path.is_dir() else path
    file.write_bytes(file.read_bytes()[:-1] + b"!")
    assert kept_images(tmp_path, Part(0, 0, 16), spec) == (None, 0), "it is damaged"


@pytest.mark.parametrize(
    ("known", "count", "message"),
    [
        (lambda text: text, COUNT - 1, r"count of at least the 50 images .* got 49\. Use --count 50"),
        (lambda text: text.replace("generator = 6", "generator = 7"), COUNT, "generator number 6.* number 7"),
        (lambda text: GENERATOR_LINE_PATTERN.sub("", text), COUNT, "generator number 6.* number 1"),
        (lambda text: text.replace("seed = 0", "seed = 5"), COUNT + 1, r"its spec\.toml differs"),
        (lambda text: COUNT_LINE_PATTERN.sub("", text), COUNT, r"its spec\.toml differs"),
    ],
)
def test_other_sets_are_refused(tmp_path: Path, known: Any, count: int, message: str) -> None:
    spec = small_spec(count=COUNT)
    (tmp_path / "spec.toml").write_text(known(spec.to_toml()))
    before = contents(tmp_path)
    with pytest.raises(DermisError, match=message):
        claim_folder(tmp_path, spec.replace(count=count))
    assert contents(tmp_path) == before


def test_a_set_that_grows_has_the_larger_spec(tmp_path: Path, spec: Spec) -> None:
    claim_folder(tmp_path, spec)
    larger = spec.replace(count=10 * COUNT)
    claim_folder(tmp_path, larger)
    assert (tmp_path / "spec.toml").read_text() == larger.to_toml()
    assert larger.digest() == spec.digest() != spec.replace(seed=9).digest()


def test_another_generator_number_is_refused() -> None:
    with pytest.raises(DermisError, match="generator: expected 6, the generator number of this version"):
        small_spec(generator=1)


def test_the_next_part_is_requested_while_frames_are_in_flight(small_spec: Spec, tmp_path: Path) -> None:
    log: list[str] = []

    def tasks() -> Iterator[Part]:
        for part in list_parts(list_shards(small_spec)[0], small_spec):
            log.append(f"requested {part.first}")
            yield part

    def record(event: WorkerEvent) -> None:
        if isinstance(event.done, Part):
            log.append(f"done {event.done.first}")

    with closing(Worker(HERE.adapter, RunOptions(small_spec, tmp_path))) as worker:
        worker.run_tasks(tasks(), record)
    assert log == ["requested 0", "requested 16", "done 0", "done 16"]
    assert [path.name for path in tmp_path.iterdir()] == ["shard-00000.tar"]


class Child:
    """Worker process that does nothing: a pipe with prepared events, and the tasks that were sent to it."""

    def __init__(self, *_: object) -> None:
        self.pipe, self.sent, self.events = self, list[Shard](), list[WorkerEvent]()
        self.send, self.recv = self.sent.append, lambda: self.events.pop(0)

    def kill(self) -> None:
        """Do nothing."""


def test_the_next_part_is_handed_out_early_unless_a_worker_died(
    spec: Spec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_pool, "start_process", Child)
    parts = [part for shard in list_shards(spec) for part in list_parts(shard, spec)]
    pool = worker_pool._PoolState(RunOptions(spec, tmp_path), parts, [HERE])
    pool.start_workers()

    def receive(event: WorkerEvent) -> list[Shard]:
        """Return all tasks of the current worker after an event."""
        pool.workers[0].child.events.append(event)  # type: ignore[attr-defined]
        pool.receive(pool.workers[0])
        return pool.workers[0].child.sent if pool.workers else []  # type: ignore[attr-defined]

    assert receive(WorkerEvent(images=1)) == parts[:2] == receive(WorkerEvent(images=1))
    assert receive(WorkerEvent(done=parts[0])) == parts[:3], "one is in progress and one waits"
    assert receive(WorkerEvent(retry="it died")) == parts[1:2]
    assert receive(WorkerEvent(images=1)) == parts[1:2], "the second attempt is alone"
    assert receive(WorkerEvent(done=parts[1])) == parts[1:3]
    assert receive(WorkerEvent(images=1)) == parts[1:4], "the one that waited had no attempt"
    assert receive(WorkerEvent(done=parts[2], missing=(parts[0],))) == [*parts[1:4], parts[0]]
    for part in (parts[3], parts[0], parts[4]):
        receive(WorkerEvent(done=part))
    assert pool.workers == []
