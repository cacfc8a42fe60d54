"""`dermis batch`: its output, and refusals before anything is rendered."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from small_set import SHARDS, write_spec

from dermis.apps.batch.run import Progress
from dermis.cli.batch import ImageRate, ProgressLog

Run = Callable[..., Any]


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the path of a spec in the current folder."""
    monkeypatch.chdir(tmp_path)
    return write_spec(tmp_path)


def test_a_set_is_drawn_and_reported(run: Run, spec: Path) -> None:
    words = "--count 3 --size 24x16 --seed 9 --adapter cpu --workers 1 --encoders 0 --format folder"
    ended = run("batch", "spec.toml", "-o", "out", *words.split(), "--json")
    assert ended.code == 0 and "Traceback" not in ended.stderr
    told = json.loads(ended.stdout)
    assert (told["images"], told["shards"], told["skipped"], told["failed"]) == (3, 1, 0, [])
    assert told["whole"] and told["images_per_s"] > 0 and told["folder"] == "out"
    pictures = sorted(Path("out").glob("shard-*/*.png"))
    assert pictures and pictures[0].name.startswith("000000000.")
    again = run("batch", "spec.toml", "-o", "out", *words.split())
    assert again.code == 0 and "0 images in 0 shards (1 reused)" in again.stdout


def test_a_part_says_that_others_are_missing(run: Run, spec: Path) -> None:
    last = SHARDS - 1
    ended = run(
        "batch", spec, "-o", "out", "--shard", f"{last}/{last + 1}", "--adapter", "cpu", "--workers", 1
    )
    assert (
        ended.code == 0 and "1 shards" in ended.stdout and "images of other jobs are missing" in ended.stdout
    )
    assert [path.name for path in Path("out").glob("shard-*")] == [f"shard-{last:05d}.tar"]


def test_a_dry_run_writes_a_sheet_alone(run: Run, spec: Path) -> None:
    before = set(spec.parent.iterdir())
    ended = run("batch", spec, "--dry-run", "-o", "sheet.png", "--adapter", "cpu", "--count", 2)
    assert (ended.code, ended.stderr) == (0, "") and "camera.yaw_deg" in ended.stdout
    assert {path.name for path in set(spec.parent.iterdir()) - before} == {"sheet.png"}
    rows = json.loads(run("batch", spec, "--dry-run", "--adapter", "cpu", "--count", 2, "--json").stdout)
    assert [row for row in rows["parameters"] if row["parameter"] == "camera.yaw_deg"]
    assert rows["estimate"]["bytes"] > 0 and "2 images: about " in ended.stdout
    assert run("batch", spec, "--dry-run", "-o", "folder").code == 2


def test_the_example_is_a_spec(run: Run, tmp_path: Path) -> None:
    from dermis.apps.batch.spec import load_spec

    ended = run("batch", "--example")
    assert (ended.code, ended.stderr) == (0, "")
    (tmp_path / "spec.toml").write_text(ended.stdout)
    assert load_spec(tmp_path / "spec.toml").count > 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("", "SPEC: expected a file"),
        ("nobody.toml -o out", "nobody.toml: expected "),
        ("spec.toml", "--output: expected the folder"),
        ("spec.toml -o out --shard 2/2", "--shard: expected I/N"),
        ("spec.toml -o out --shard 1", "--shard: expected I/N"),
        ("spec.toml -o out --part 3/3", "--part: expected I/N"),
        ("spec.toml -o out --size 3", "--size: expected WIDTHxHEIGHT"),
        ("spec.toml -o out --count 0", "count: expected "),
        ("spec.toml -o out --workers 0", "--workers: expected 1 to "),
        ("spec.toml -o out --encoders 9999", "--encoders: expected 0 to "),
        ("spec.toml -o out --workers 2 --workers-per-gpu 2", "--workers-per-gpu: expected no --workers"),
        ("spec.toml -o out --adapters 0,x", "--adapters: expected numbers"),
        ("spec.toml -o out --adapters 0 --adapter cpu", "--adapters: expected no --adapter"),
        ("spec.toml -o out --adapters 99", "adapter '#99': expected one of this machine's"),
        ("spec.toml -o out --scheduler tcp://a --cluster b.json", "--cluster: expected no --scheduler"),
        ("spec.toml -o out --cluster b.json --workers 2", "--workers: expected no such option"),
        ("spec.toml -o spec.toml --workers 1 --adapter cpu", "spec.toml: expected a writable path"),
    ],
)
def test_what_cannot_be_is_refused(run: Run, spec: Path, words: str, says: str) -> None:
    before = set(spec.parent.iterdir())
    ended = run("batch", *words.split())
    assert (ended.code, ended.stdout) == (2, "") and says in ended.stderr, ended.stderr
    assert ended.stderr.count("\n") == 1 and set(spec.parent.iterdir()) == before


def test_pace_is_that_of_the_last_minute() -> None:
    clock = iter([0.0, *range(10, 200, 10)])
    pace = ImageRate(lambda: float(next(clock)))
    slow = [pace.update(done) for done in range(1, 10)]
    fast = [pace.update(9 + 10 * done) for done in range(1, 9)]
    assert slow[-1] == pytest.approx(0.1) and fast[-1] == pytest.approx(1.0)


def test_logs_get_a_line_now_and_then() -> None:
    now, written = [0.0], list[str]()
    lines = ProgressLog(written.append, lambda: now[0])
    for done in range(1, 101):
        now[0] = done * 1.0
        lines.report(Progress(done, 220))
    assert len(written) == 3 and written[0] == "30 of 220 images, 1 images/s, 3 min left"
    now[0] = 200.0
    lines.report(Progress(220, 220, verified=7, to_verify=1000))
    assert written[3:] == ["7 of 1,000 shards verified"]
