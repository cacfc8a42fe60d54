"""Refusal of too little address space before drivers are loaded, which would abort the process."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dermis.base.errors import DermisError
from dermis.gpu import memory

resource = pytest.importorskip("resource", reason="Windows limits no address space")

GB = 1_000_000_000
TOLD = re.compile(
    r"dermis: address space \(ulimit -v\): expected at least 2\.\d GB for .+, but the limit is [\d.]+ GB, "
    r"of which [\d.]+ GB are taken\. Raise it: ulimit -v unlimited\.\n"
)
TOO_LITTLE, ENOUGH = 1.4, 4.0  # [GB] with the two threads of the software adapter that the test allows
DRAW = "render", "ball.obj", "--size", "32x32", "--atlas", "64", "--shadow-size", "64", "--adapter", "cpu"


def limited(limit: float, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run `dermis` with these arguments under a limit of address space [bytes]."""
    return subprocess.run(
        [sys.executable, "-m", "dermis", *words],
        env=os.environ | {"LP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"},
        cwd=folder,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (int(limit), int(limit))),
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from small_head import obj_text

    made = tmp_path_factory.mktemp("limited")
    (made / "ball.obj").write_text(obj_text())
    return made


@pytest.mark.parametrize("limit", [0.6, TOO_LITTLE, 2.5, ENOUGH])
def test_a_picture_under_a_limit_is_drawn_or_refused(folder: Path, limit: float) -> None:
    """Check that the picture is rendered or refused, and that no driver aborts.

    Between the two limits the outcome depends on the machine's own libraries.
    """
    ended = limited(limit * GB, folder, *DRAW, "-o", f"{limit}.png")
    drawn = ended.returncode == 0
    error = re.sub("(?m)^note: .*\n", "", ended.stderr)
    assert drawn or TOLD.fullmatch(error), ended.stderr[-1000:]
    assert drawn or (ended.returncode == 2 and limit < ENOUGH), ended.stderr[-1000:]
    assert drawn == (folder / f"{limit}.png").exists()
    assert not drawn or limit > TOO_LITTLE


@pytest.mark.parametrize("limit", [1.0, 1.8])
def test_doctor_reports_a_memory_limit(folder: Path, limit: float) -> None:
    ended = limited(limit * GB, folder, "doctor", "--adapter", "cpu")
    said = ended.stdout + ended.stderr  # as adapters are listed, or as one is opened
    assert ended.returncode == 2 and "Traceback" not in said
    assert "address space (ulimit -v): expected at least 2." in said


@pytest.mark.parametrize("words", [["--help"], ["cite"], ["lights", "window"], ["profile", "skin1"]])
def test_commands_without_device_work_under_a_limit(folder: Path, words: list[str]) -> None:
    ended = limited(0.6 * GB, folder, *words)
    assert ended.returncode == 0 and ended.stdout, ended.stderr[-1000:]


def test_memory_grows_with_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "_address_space_limit", lambda: 3.0 * GB)
    monkeypatch.setattr(memory, "_address_space_used", lambda: 0.5 * GB)
    monkeypatch.setenv("LP_NUM_THREADS", "2")
    memory.check_software_address_space()
    monkeypatch.setenv("LP_NUM_THREADS", "16")
    assert memory.available_memory() <= 2.5 * GB
    with pytest.raises(DermisError, match=r"at least 5\.\d GB for graphics drivers"):
        memory.check_software_address_space()


def test_control_group_limit_is_below_the_machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Check the memory limit of a control group, as in containers."""
    machine, group = memory.main_memory(), tmp_path / "job"
    group.mkdir()
    (tmp_path / "memory.max").write_text("max\n")
    (group / "memory.max").write_text("1000000\n")
    monkeypatch.setattr(memory, "_CGROUP_FOLDER", tmp_path)
    monkeypatch.setattr(memory, "_control_group_paths", lambda: ["job"])
    assert memory.main_memory() == 1e6 < machine < math.inf
