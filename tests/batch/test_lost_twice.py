"""Workers that lose their device twice are replaced with a note; if all do, the run ends with status 2."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import losing_worker
import pytest
from small_set import HERE, SHARDS, contents, drawn

from dermis.apps.batch.spec import Spec
from dermis.cli import main

REOPENED, LOST_TWICE = "it is opened again", "it was lost twice"
ATTEMPTS = 2
SHARD = "shard-00002"  # the only one that is drawn, as the others exist


@pytest.fixture
def incomplete_set(
    undisturbed: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, Path]:
    """Return a data set without one shard, and the folder of the workers that lose their devices."""
    out, lost = tmp_path / "out", tmp_path / "lost"
    lost.mkdir()
    for name, data in undisturbed.items():
        if not name.startswith((SHARD, "index", "README")):
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            (out / name).write_bytes(data)
    monkeypatch.setattr("dermis.apps.batch.worker_pool.run_worker", losing_worker.run_worker)
    monkeypatch.setenv(losing_worker.FOLDER, str(lost))
    return out, lost


def test_another_worker_renders_the_shard_of_a_lost_device(
    small_spec: Spec,
    undisturbed: dict[str, bytes],
    incomplete_set: tuple[Path, Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out, lost = incomplete_set
    monkeypatch.setenv(losing_worker.WORKERS, "1")
    with pytest.warns(UserWarning) as caught:
        report = drawn(small_spec, out)
    notes = [note for note in (str(one.message) for one in caught) if "has no colour" not in note]
    assert [REOPENED in note for note in notes] == [True, False], notes
    assert LOST_TWICE in notes[1] and notes[1].endswith("its part is rendered again")
    assert (report.shards, report.skipped, report.is_complete) == (1, SHARDS - 1, True)
    assert len(list(lost.iterdir())) == 1 and contents(out) == undisturbed


def test_the_exit_status_is_2_if_all_workers_fail(
    small_folder: Path,
    incomplete_set: tuple[Path, Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out, lost = incomplete_set
    before = contents(out)
    monkeypatch.setattr("dermis.apps.batch.worker_pool.MAX_TASK_ATTEMPTS", ATTEMPTS)
    monkeypatch.setenv(losing_worker.WORKERS, "9")
    arguments = ["batch", str(small_folder / "spec.toml"), "-o", str(out), "--adapter", HERE.adapter]
    monkeypatch.setattr(sys, "argv", ["dermis", *arguments, "--workers", "1", "--encoders", "0"])
    with pytest.raises(SystemExit) as ended:
        main()
    errors = capsys.readouterr().err
    assert ended.value.code == 2 and REOPENED in errors and "its part is rendered again" in errors
    assert re.search(
        rf"images 40 to 47 of shard 2: .* but {ATTEMPTS} failed; .*{LOST_TWICE}.*\. Complete parts are kept",
        errors,
    )
    assert ".." not in errors and ".;" not in errors
    assert len(list(lost.iterdir())) == ATTEMPTS and contents(out) == before
