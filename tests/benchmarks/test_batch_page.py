"""The page about large data sets follows from the measurements."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(autouse=True)
def scripts(monkeypatch: pytest.MonkeyPatch) -> None:
    # Last, for a name there is also one of the standard library's.
    monkeypatch.setattr(sys, "path", [*sys.path, str(FOLDER)])


def told(**more: Any) -> dict[str, Any]:
    machine = {"adapters": ["H200"], "cores": 16, "size": [512, 512], "atlas": 1024, "outputs": ["depth"]}
    run = {"workers": 2, "adapters": 2, "encoders": 4, "images_per_s": 200.0, "bytes_per_image": 1e6}
    return {
        "machine": machine,
        "versions": {"dermis": "1", "wgpu": "2"},
        "date": "2026-01-01T",
        "load": "0.1",
        "new": [{**run, "images_per_s": 100.0, "worker_bytes": []}, {**run, "worker_bytes": [10**9, 10**9]}],
        **more,
    }


def test_extrapolation_uses_the_fastest_run() -> None:
    from batch_page import extrapolation

    steps = {"parameters": 1.0, "scene": 5.0, "draw_and_read": 4.0, "encode": 50.0}
    rows = dict(extrapolation(told(steps=steps, disk={"bytes_per_s": 5e8})))
    assert (rows["hours on this machine"], rows["adapter hours"]) == ("14", "28")
    assert (rows["bytes"], rows["files"]) == ("10 TB", "10,000 shards of 1,000 MB")
    assert rows["limit by the workers' own time"] == "200 images/s"
    assert rows["limit by encoding"] == "160 images/s"
    assert rows["limit by the disk"] == "500 images/s"
    assert rows["lowest limit"] == "encoding"


def test_the_page_has_each_run_with_its_ratio() -> None:
    from batch_page import page

    text = page([told(dask={"workers": 2, "dask_over_plain": 0.98})])
    assert "| new people | 2 | 2 | 4 | 200 | 2.00 | 1000 to 1000 |" in text
    assert "0.980 times" in text and "lowest limit" not in text


def test_memory_is_listed_by_number_of_images() -> None:
    from batch import RunRecorder
    from batch_page import page

    from dermis.apps.batch.run import Progress

    recorder = RunRecorder(workers=2)
    for images in range(1, 50):
        recorder.record(Progress(images, 50))
    assert list(recorder.resident) == [10, 20]
    run = told()["new"][1] | {"resident_bytes": {"10": 5 * 10**8, "20": 6 * 10**8}}
    text = page([told(new=[run])])
    assert "| new people | 2 | 10 | 500 |" in text and "| new people | 2 | 20 | 600 |" in text


def test_the_rate_is_measured_in_the_middle_of_the_run() -> None:
    from batch import RunRecorder

    recorder = RunRecorder([(10.0 if n == 1 else 20.0 + 0.5 * n, n) for n in range(1, 101)])
    assert recorder.rate() == pytest.approx(2.0)
