"""`benchmarks/gpu_server.py` at tiny sizes: figures of each part, and reports of failures and timeouts."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from dermis.base.errors import DermisError
from dermis.gpu import Device


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Any:
    # Last, for a name there is also one of the standard library's.
    monkeypatch.setattr(sys, "path", [*sys.path, str(Path(__file__).parents[2] / "benchmarks")])
    import gpu_server

    monkeypatch.setattr(gpu_server, "ENVIRONMENTS", {"lamps": (True, None), "room": (False, "uniform")})
    monkeypatch.setattr(gpu_server, "_NEEDED_S", dict.fromkeys(gpu_server.PARTS, 0))
    return gpu_server


@pytest.fixture
def run(server: Any, device: Device, tmp_path: Path, opened: None) -> Any:
    """Return a function that runs some parts quickly and returns the written figures."""
    from small_head import write_head

    head, out = write_head(tmp_path / "head.obj"), tmp_path / "figures.json"

    def told(parts: str, **given: Any) -> Any:
        words = {"head": str(head), "adapter": device.adapter.name, "parts": parts, "quick": True}
        server.main(output=out, **(words | given))
        return json.loads(out.read_text(encoding="utf-8"))

    return told


@pytest.fixture
def opened(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda _: device)


def test_all_parts_are_measured(run: Any, device: Device) -> None:
    told = run("bench,sequences,lights,options")
    assert told["adapter"] == device.adapter.name and told["versions"]["wgpu"]
    assert set(told["seconds"]) == {"bench", "sequences", "lights", "options"}
    assert [row["technique"] for row in told["bench"]["rows"]] == ["texture-space", "published-fragments"]
    assert told["bench"]["published_fragments_ratio"] > 0.0
    assert set(told["sequences"]["per_second"]) == {"bytes", "floats", "png", "exr"}
    assert min(told["sequences"]["per_second"].values()) > 0.0
    assert {"lamps", "room"} == set(told["lights"]) and "shade" in told["lights"]["room"]
    assert told["lights"]["lamps"]["shadows"] > 0.0
    assert "diffuse" in told["options"]["usual"] and "diffuse" not in told["options"]["none"]


def test_failed_and_skipped_parts_are_reported(
    run: Any, server: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: Any) -> Any:
        raise DermisError("no screen here")

    monkeypatch.setattr(server, "viewer", broken)
    monkeypatch.setitem(server._NEEDED_S, "film", 1000)
    told = run("viewer,film,lobes", minutes=10)
    assert told["viewer"] == {"left_out": "no screen here"}
    assert "s were left" in told["film"]["left_out"]
    assert min(told["lobes"].values()) >= 0.0 and "kelemen, schlick" in told["lobes"]


def test_the_last_output_of_a_failed_program_is_reported(
    server: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    from gpu_server import run_time_s

    with pytest.raises(DermisError, match="nobody"):
        run_time_s([sys.executable, "-m", "dermis", "head", "nobody"])
    assert "nobody" in capsys.readouterr().err
    assert run_time_s([sys.executable, "-c", "pass"]) > 0.0


def test_a_hanging_program_ends_with_its_child_processes(
    server: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import gpu_server

    other, heard, usual = tmp_path / "other", threading.Event(), subprocess.Popen.wait

    def wait(program: Any, timeout: float | None = None) -> int:
        """Let the time limit pass when the program has printed something."""
        if timeout is None:
            return int(usual(program))
        assert heard.wait(120.0)
        raise subprocess.TimeoutExpired(program.args, timeout)

    monkeypatch.setattr(subprocess.Popen, "wait", wait)
    monkeypatch.setattr(gpu_server, "print_note", lambda line: heard.set())
    words = ["/bin/sh", "-c", f"sleep 600 & echo $! > {other}; echo still at it >&2; wait"]
    with pytest.raises(DermisError, match=r"-c sleep .*within 5 s.*Last words: still at it"):
        gpu_server.run_time_s(words, 5.0)
    process, patient_until = int(other.read_text(encoding="utf-8")), time.monotonic() + 120.0
    while _runs(process):  # for a moment: it closes what it wrote to before it is gone
        assert time.monotonic() < patient_until
        time.sleep(0.01)


def _runs(process: int) -> bool:
    """Return whether a process exists and is not a zombie."""
    status = Path(f"/proc/{process}/stat")
    try:
        return status.read_text(encoding="utf-8").rsplit(")", 1)[1].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


def test_a_stopped_viewer_leaves_partial_results(
    run: Any, server: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(words: list[str], longest_s: float) -> float:
        asked = dict(zip(words[2::2], words[3::2], strict=True))
        assert float(asked["--seconds"]) < longest_s <= 120.0
        Path(asked["--output"]).write_text('{"speed": {"camera": {"frames_per_s": 50.0}}}', encoding="utf-8")
        raise DermisError("viewer.py: too late. Last words: page")

    monkeypatch.setattr(server, "run_time_s", stopped)
    told = run("viewer")["viewer"]
    assert told["speed"]["camera"]["frames_per_s"] == 50.0 and "Last words: page" in told["ended"]


def test_unknown_part_names_are_refused(server: Any, tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="--parts: expected names of bench, lobes"):
        server.main(output=tmp_path / "figures.json", parts="bench,sun")
    with pytest.raises(DermisError, match=r"figures\.txt"):
        server.main(output=tmp_path / "figures.txt")
    assert not list(tmp_path.iterdir())


def test_the_full_plan_covers_all_tables_of_the_documentation(server: Any) -> None:
    plan = server.full_plan("auto", "human")
    assert (
        plan.base_case.image == (1920, 1080) and plan.base_case.atlas == 2048 and plan.base_case.lights == 3
    )
    assert {(512, 512), (1024, 1024), (3840, 2160)} <= {case.image for case in plan.cases}
    assert [case.varies for case in plan.film] == ["", "technique", "subdivide"]
