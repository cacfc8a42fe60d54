"""Dask workers write the same bytes, also when some of them are killed."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from small_set import COUNT, SHARDS, contents, read, write_spec

from dermis.apps.batch import dask_cluster as module
from dermis.apps.batch.dask_cluster import DaskCluster
from dermis.apps.batch.run import Progress, RunReport, run
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.worker import RunOptions
from dermis.base.errors import DermisError

Files = dict[str, bytes]
pytestmark = pytest.mark.filterwarnings("ignore")  # dask's own


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Return a cluster of two processes with one thread each."""
    distributed = pytest.importorskip("distributed")
    import dask

    slow = {"connect": "300s", "tcp": "300s"}  # of a busy machine
    with (
        dask.config.set({"distributed.comm.timeouts": slow, "distributed.scheduler.worker-ttl": None}),
        distributed.LocalCluster(2, threads_per_worker=1, processes=True, dashboard_address=None) as local,
    ):
        yield local


def drawn(
    cluster: Any, spec: Spec, out: Path, on_progress: Callable[[Progress], None] = lambda now: None
) -> RunReport:
    return run(
        RunOptions(spec, out, encoders=1),
        DaskCluster(cluster.scheduler_address, None, "cpu"),
        on_progress=on_progress,
    )


def test_dask_workers_write_the_same_bytes_as_local_workers(
    cluster: Any, small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    report = drawn(cluster, small_spec, tmp_path)
    assert (report.images, report.shards, report.is_complete) == (COUNT, SHARDS, True)
    assert contents(tmp_path) == undisturbed


def test_a_killed_worker_loses_no_shard(
    cluster: Any, small_spec: Spec, undisturbed: Files, tmp_path: Path
) -> None:
    killed: list[int] = []

    def kill_once(progress: Progress) -> None:
        if not killed:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], 9)

    assert drawn(cluster, small_spec, tmp_path, kill_once).is_complete
    assert killed and contents(tmp_path) == undisturbed


def test_a_bad_head_ends_the_run(cluster: Any, tmp_path: Path) -> None:
    spec = read(write_spec(tmp_path, "bad.obj"))
    with pytest.raises(DermisError, match=r"image \d+: .*bad\.obj"):
        drawn(cluster, spec, tmp_path / "out")


def test_files_that_differ_on_a_worker_are_refused(cluster: Any, tmp_path: Path) -> None:
    spec = read(write_spec(tmp_path))
    (tmp_path / "head.obj").write_text((tmp_path / "large.obj").read_text())
    with pytest.raises(DermisError, match=r"files: head\.obj: expected a file with SHA-256"):
        drawn(cluster, spec, tmp_path / "out")


def test_a_worker_without_the_shared_disk_is_refused(tmp_path: Path) -> None:
    client = SimpleNamespace(
        run=lambda path_exists, marker: {"tcp://a": path_exists(marker), "tcp://b": False}
    )
    with (
        module._create_marker_file(tmp_path) as marker,
        pytest.raises(DermisError, match=r"a disk that all workers share.*tcp://b"),
    ):
        module._check_shared_disk(client, marker)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_scheduler_is_reported(
    small_spec: Spec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_CONNECTION_TIMEOUT_S", 0.5)
    with pytest.raises(DermisError, match=r"a scheduler of dask\.distributed"):
        run(RunOptions(small_spec, tmp_path), DaskCluster("tcp://127.0.0.1:9", None))
    with pytest.raises(DermisError, match=r"cluster\.json: expected the file that dask's scheduler wrote"):
        run(RunOptions(small_spec, tmp_path), DaskCluster(None, tmp_path / "cluster.json"))
